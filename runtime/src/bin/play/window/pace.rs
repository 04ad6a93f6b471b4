//! How fine the picture is while it moves and when it rests, from what frames have cost so far.

/// Milliseconds a frame may take while something moves.
const MOVING: f64 = 50.0;
/// Milliseconds a ray of every pixel may take when nothing does: the window answers no faster.
const RESTING: f64 = 400.0;
/// Coarsest picture: a pixel for 8 × 8 of the window's.
const COARSEST: u32 = 8;

/// Picks window pixels per picture pixel, along each side.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Milliseconds of a picture pixel, from the last frame; `None` before the first.
    per_pixel: Option<f64>,
    first: u32,
}

impl Pace {
    /// Software adapters start with coarse pictures.
    pub fn new(software: bool) -> Self {
        Self {
            per_pixel: None,
            first: if software { 4 } else { 1 },
        }
    }

    /// What one ray in each of `pixels` cost.
    pub fn learn(&mut self, pixels: u64, milliseconds: f64) {
        if pixels > 0 && milliseconds.is_finite() {
            let now = milliseconds / pixels as f64;
            // Halfway towards the new value, so that one slow frame does not change the picture.
            self.per_pixel = Some(self.per_pixel.map_or(now, |old| 0.5 * (old + now)));
        }
    }

    /// 1, 2, 4 or 8 for a window area of `pixels`.
    pub fn divisor(&self, pixels: u64, moving: bool) -> u32 {
        let Some(per_pixel) = self.per_pixel else {
            return self.first;
        };
        let budget = if moving { MOVING } else { RESTING };
        let mut divisor = 1;
        while divisor < COARSEST && per_pixel * pixels as f64 / f64::from(divisor * divisor) > budget {
            divisor *= 2;
        }
        divisor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_adapters_draw_every_pixel() {
        let mut pace = Pace::new(false);
        pace.learn(1_000_000, 5.0);
        assert_eq!(
            (pace.divisor(2_000_000, true), pace.divisor(2_000_000, false)),
            (1, 1)
        );
    }

    #[test]
    fn slow_ones_draw_fewer_while_moving() {
        let mut pace = Pace::new(true);
        assert_eq!(pace.divisor(640_000, true), 4);
        // 0.005 ms a pixel: 3.2 s for the whole window.
        pace.learn(40_000, 200.0);
        assert_eq!(
            (pace.divisor(640_000, true), pace.divisor(640_000, false)),
            (8, 4)
        );
        pace.learn(0, f64::NAN);
        assert_eq!(pace.divisor(640_000, false), 4);
    }
}
