//! Which level of detail the window shows, at which size: all samples where nothing moves or no budget is given; else what keeps frames
//! within the budget.

use super::pace::Pace;
use diaphane_formats::asset::{Asset, Info};
use diaphane_runtime::detail::{Detail, Fineness, Governor, details, pixels_at_nearest};
use diaphane_runtime::frame::Frame;

/// Fine enough for a picture at rest.
const ALL: Fineness = Fineness { kernel_pixels: 0.0, ..Fineness::DEFAULT };

/// The levels of the asset that is shown, and what frames of each cost.
pub struct Levels {
    governor: Option<Governor>,
    details: Vec<Detail>,
    varies: bool,
    /// Samples and width of kernels.
    sizes: Vec<(usize, f32)>,
    paces: Vec<Pace>,
}

/// What to draw a frame with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chosen {
    pub level: usize,
    /// Window pixels per picture pixel, along each side.
    pub divisor: u32,
}

impl Levels {
    /// Before the first frame of an asset. A budget is in milliseconds a frame while something moves.
    pub fn new(asset: &Asset, budget: Option<f64>, software: bool) -> Self {
        let sizes = asset.level_sizes();
        let pace = budget.map_or_else(|| Pace::new(software), |ms| Pace::within(ms, software));
        Self {
            governor: budget.map(|ms| Governor::new(ALL, ms)),
            details: details(asset),
            varies: asset.density.is_some(),
            paces: vec![pace; sizes.len()],
            sizes,
        }
    }

    /// Whether levels are chosen by a budget.
    pub fn are_governed(&self) -> bool {
        self.governor.is_some()
    }

    /// What to draw the next frame with, all samples if it must be; `whole` is that frame with a pixel for every one of the window.
    pub fn choose(&mut self, moving: bool, whole_only: bool, whole: &Frame, info: &Info) -> Chosen {
        let level = match &mut self.governor {
            Some(governor) if moving && !whole_only => {
                let pixels = pixels_at_nearest(whole, info);
                governor.set_coarsest(ALL.coarsest(&self.details, pixels, self.varies));
                governor.fineness().choose(&self.details, pixels, self.varies).level
            }
            _ => 0,
        };
        Chosen { level, divisor: self.paces[level].divisor(moving) }
    }

    /// What a frame of one ray in each pixel cost. While something moves the governor learns what it would cost in all pixels: fewer
    /// of them are for what levels alone cannot do.
    pub fn learn(&mut self, chosen: Chosen, moving: bool, milliseconds: f64) {
        let pace = &mut self.paces[chosen.level];
        pace.learn(chosen.divisor, milliseconds);
        if let (Some(governor), true, Some(whole)) = (&mut self.governor, moving, pace.expected(1)) {
            governor.learn(whole, self.sizes[chosen.level].0 as u64);
        }
    }

    /// Milliseconds that a ray in each of the window's pixels takes with all samples; `None` before the first frame.
    pub fn expected(&self) -> Option<f64> {
        self.paces[0].expected(1)
    }

    /// The parameters of a level where `info` are those of the whole asset.
    pub fn info(&self, level: usize, info: Info) -> Info {
        if level == 0 {
            return info;
        }
        let (samples, width_factor) = self.sizes[level];
        Info { samples: samples as u64, width_factor, certificate: None, ..info }
    }
}

#[cfg(test)]
#[path = "../../../../tests/gpu/objects.rs"]
#[allow(dead_code, missing_docs, reason = "shared with the tests of the GPU")]
mod objects;

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_runtime::framing::default_scene;

    /// A ball with two coarser levels, and a frame that it fills.
    fn ball() -> (Asset, Frame) {
        let mut asset = objects::Object { spacing: 0.2, ..objects::ball() }.build();
        for level in [1, 2] {
            let weight = vec![1.0; asset.samples.len() >> (2 * level)];
            let width_factor = asset.info.width_factor * 1.6f32.powi(level);
            asset.levels.push(diaphane_formats::asset::Level { width_factor, weight, error: None });
        }
        let mut scene = default_scene(&asset.info);
        (scene.image.width, scene.image.height) = (800, 800);
        let frame = Frame::new(&scene, &asset.info).unwrap();
        (asset, frame)
    }

    /// Draws frames that take so long a sample in all pixels, in proportion to those; what came of it.
    fn draw(levels: &mut Levels, (asset, frame): &(Asset, Frame), frames: usize, per_sample: f64) -> Chosen {
        for _ in 0..frames {
            let chosen = levels.choose(true, false, frame, &asset.info);
            let pixels = 0.25f64.powi(chosen.divisor.ilog2() as i32);
            levels.learn(chosen, true, 1.0 + per_sample * levels.sizes[chosen.level].0 as f64 * pixels);
        }
        levels.choose(true, false, frame, &asset.info)
    }

    #[test]
    fn without_a_budget_all_samples_are_shown() {
        let shown = ball();
        let mut levels = Levels::new(&shown.0, None, false);
        let chosen = draw(&mut levels, &shown, 100, 1.0);
        assert_eq!((chosen.level, levels.are_governed()), (0, false));
        assert!(chosen.divisor > 1);
    }

    #[test]
    fn a_budget_takes_levels_first_and_pixels_where_they_do_not_suffice() {
        let shown = ball();
        let all = shown.0.samples.len() as f64;
        let mut levels = Levels::new(&shown.0, Some(16.0), false);
        let fast = draw(&mut levels, &shown, 100, 10.0 / all);
        assert_eq!(fast, Chosen { level: 0, divisor: 1 });
        // A level that fits does without fewer pixels.
        let slower = draw(&mut levels, &shown, 300, 50.0 / all);
        assert_eq!(slower, Chosen { level: 1, divisor: 1 });
        let slow = draw(&mut levels, &shown, 300, 3000.0 / all);
        assert!(slow.level == 2 && slow.divisor > 1, "{slow:?}");
        // At rest, and as soon as there is time again.
        assert_eq!(levels.choose(false, false, &shown.1, &shown.0.info).level, 0);
        assert_eq!(draw(&mut levels, &shown, 600, 10.0 / all), Chosen { level: 0, divisor: 1 });
    }

    #[test]
    fn a_level_has_the_parameters_that_it_has_alone() {
        let (asset, _) = ball();
        let levels = Levels::new(&asset, Some(16.0), true);
        for level in 0..3 {
            assert_eq!(levels.info(level, asset.info.clone()), asset.level(level).unwrap().info);
        }
    }
}
