//! How many samples a frame's time is enough for, from what they have cost so far.

/// Samples of the first portion, whose cost is not known yet.
const FIRST: usize = 256;
/// Fewest samples of a portion, so that every light is done some day.
const LEAST: usize = 64;

/// Turns milliseconds into numbers of samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// Milliseconds a sample; `None` before the first portion.
    each: Option<f64>,
}

impl Pace {
    /// Samples that fit into `milliseconds`; at least [`LEAST`] where that is more than none.
    pub fn samples(&self, milliseconds: f64) -> usize {
        if !(milliseconds > 0.0) {
            return 0;
        }
        self.each.map_or(FIRST, |each| ((milliseconds / each) as usize).max(LEAST))
    }

    /// What a portion has cost: halfway from what was known to that, so that one slow portion does not change it. Small portions
    /// tell little: threads are awake and data is at hand.
    pub fn learn(&mut self, samples: usize, milliseconds: f64) {
        if samples == 0 || !(milliseconds.is_finite() && milliseconds >= 0.0) {
            return;
        }
        if samples < 2 * LEAST && self.each.is_some() {
            return;
        }
        let now = milliseconds.max(1e-3) / samples as f64;
        self.each = Some(self.each.map_or(now, |old| 0.5 * (old + now)));
    }

    /// Samples a second; 0 before the first portion.
    pub fn per_second(&self) -> f64 {
        self.each.map_or(0.0, |each| 1e3 / each)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_what_was_measured() {
        let mut pace = Pace::default();
        assert_eq!((pace.samples(2.0), pace.samples(0.0), pace.samples(f64::NAN)), (FIRST, 0, 0));
        pace.learn(FIRST, 1.0);
        assert_eq!(pace.samples(2.0), 2 * FIRST);
        pace.learn(FIRST, 0.25);
        // 1/256 and 1/1024 of a millisecond a sample: 1/409.6.
        assert_eq!((pace.samples(2.0), pace.per_second().round()), (819, 409_600.0));
        pace.learn(10, f64::NAN);
        pace.learn(0, 1.0);
        pace.learn(LEAST, 9.0);
        assert_eq!((pace.samples(2.0), pace.samples(1e-9)), (819, LEAST));
    }
}
