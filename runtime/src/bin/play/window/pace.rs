//! How fine the picture is while it moves and when it rests, from what frames have cost so far.

/// Milliseconds a frame may take while something moves.
const MOVING: f64 = 50.0;
/// Milliseconds a ray of every pixel may take when nothing does: the window answers no faster.
const RESTING: f64 = 400.0;
/// Window pixels per picture pixel, along each side: 1, 2, 4 or 8.
const LEVELS: usize = 4;
/// Cost grows slower than the number of pixels, because samples are transformed however few there are.
const GROWTH: f64 = 0.7;

/// Picks window pixels per picture pixel, along each side.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Milliseconds of a frame with one ray in each pixel, by level; `None` where none was drawn yet.
    known: [Option<f64>; LEVELS],
    first: u32,
    /// Milliseconds a frame may take while something moves.
    moving: f64,
}

impl Pace {
    /// Software adapters start with coarse pictures.
    pub fn new(software: bool) -> Self {
        Self::within(MOVING, software)
    }

    /// The same with so many milliseconds for a frame while something moves.
    pub fn within(moving: f64, software: bool) -> Self {
        Self { known: [None; LEVELS], first: if software { 4 } else { 1 }, moving }
    }

    /// What a frame of one ray in each pixel cost. What is known of other sizes changes in proportion.
    pub fn learn(&mut self, divisor: u32, milliseconds: f64) {
        if !(milliseconds.is_finite() && milliseconds > 0.0) {
            return;
        }
        let level = (divisor.max(1).ilog2() as usize).min(LEVELS - 1);
        // Halfway towards the new value, so that one slow frame does not change the picture.
        let now = self.known[level].map_or(milliseconds, |old| 0.5 * (old + milliseconds));
        let ratio = self.known[level].map_or(1.0, |old| now / old);
        self.known.iter_mut().flatten().for_each(|v| *v *= ratio);
        self.known[level] = Some(now);
        // No more than in proportion to the pixels, or what was slow once would not be tried again.
        for (k, finer) in self.known[..level].iter_mut().enumerate() {
            *finer = finer.map(|ms| ms.min(now * 4f64.powi((level - k) as i32)));
        }
    }

    /// Milliseconds that a ray in each pixel will take; `None` before the first frame.
    pub fn expected(&self, divisor: u32) -> Option<f64> {
        let level = divisor.max(1).ilog2() as usize;
        let nearest = (0..LEVELS).filter(|&k| self.known[k].is_some()).min_by_key(|k| k.abs_diff(level))?;
        self.known[nearest].map(|ms| ms * 4f64.powf(GROWTH * (nearest as f64 - level as f64)))
    }

    /// 1, 2, 4 or 8.
    pub fn divisor(&self, moving: bool) -> u32 {
        let budget = if moving { self.moving } else { RESTING };
        let coarsest = 1 << (LEVELS - 1);
        let fits = |divisor: u32| self.expected(divisor).map(|ms| ms <= budget);
        match fits(1) {
            None => self.first,
            Some(_) => (0..LEVELS).map(|k| 1 << k).find(|&d| fits(d) == Some(true)).unwrap_or(coarsest),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_adapters_draw_every_pixel() {
        let mut pace = Pace::new(false);
        assert_eq!(pace.divisor(true), 1);
        pace.learn(1, 5.0);
        assert_eq!((pace.divisor(true), pace.divisor(false)), (1, 1));
    }

    #[test]
    fn slow_ones_draw_fewer_while_moving() {
        let mut pace = Pace::new(true);
        assert_eq!(pace.divisor(true), 4);
        pace.learn(4, 200.0);
        // 2.6 times as much for four times the pixels.
        assert_eq!((pace.divisor(true), pace.divisor(false)), (8, 4));
        assert!((pace.expected(2).unwrap() - 527.8).abs() < 0.1);
        pace.learn(8, f64::NAN);
        assert_eq!(pace.divisor(false), 4);
    }

    #[test]
    fn what_was_slow_once_is_tried_again() {
        let mut pace = Pace::new(false);
        pace.learn(1, 500.0);
        assert_eq!(pace.divisor(true), 8);
        // Something else took the time then.
        (0..8).for_each(|_| pace.learn(pace.divisor(true), 5.0));
        assert_eq!(pace.divisor(true), 1);
    }

    #[test]
    fn a_measured_size_needs_no_guess_and_follows_the_others() {
        let mut pace = Pace::new(true);
        pace.learn(4, 200.0);
        pace.learn(8, 150.0);
        assert_eq!(pace.expected(4), Some(200.0));
        // Halfway from 150 to 50: everything is a third cheaper now.
        pace.learn(8, 50.0);
        assert!((pace.expected(4).unwrap() - 133.3).abs() < 0.1);
    }
}
