//! Which level of detail is fine enough for an object of some size in the picture, and for a budget of time.

mod governor;

pub use governor::Governor;

use crate::frame::Frame;
use diaphane_formats::asset::{Asset, Info};
use diaphane_formats::kernel;

/// What a choice knows of a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail {
    /// How far its kernels reach, mesh units: the mean over its samples.
    pub reach: f32,
    /// Its error as the bake measured it ([`Asset::level_errors`]).
    pub error: Option<f64>,
}

/// When a level is fine enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Kernels reach no further than so many pixels; 0: always all samples. A third of it where the density varies, or where the
    /// bake measured an error that is larger than the ratio below.
    pub kernel_pixels: f32,
    /// A level that the bake measured to have no more than so many times the error of all samples may reach
    /// [`Self::MEASURED`] times as far.
    pub error_ratio: f64,
}

impl Fineness {
    /// At 3.2 pixels the bunny at 1/10 of 192 pixels is drawn with 1/16 of its samples, for 1.17 times the error; errors of 1.2
    /// times are what is asked of levels that were measured.
    pub const DEFAULT: Self = Self { kernel_pixels: 3.2, error_ratio: 1.2 };
    /// How much further kernels reach where the error is known to be small.
    pub const MEASURED: f32 = 5.0;
    /// Between this many times the reach that is allowed and that reach a level is faded in.
    const FADE: f32 = 1.25;

    /// What an object of these levels (level 0 first) is drawn with where it has `pixels` pixels to a mesh unit; `varies`: its
    /// density does.
    pub fn choose(&self, levels: &[Detail], pixels: f32, varies: bool) -> Choice {
        // Reach of a level over what it may be.
        let excess =
            |k: usize| levels[k].reach * pixels / (self.factor(levels, k, varies) * self.kernel_pixels);
        // Not a number where nothing is allowed and nothing is asked for.
        let level = (1..levels.len()).rev().find(|k| excess(*k) <= 1.0).unwrap_or(0);
        let next = if level + 1 < levels.len() { excess(level + 1) } else { f32::INFINITY };
        let coarser = ((Self::FADE - next) / (Self::FADE - 1.0)).clamp(0.0, 1.0);
        Choice { level, coarser: if coarser > 0.0 { coarser } else { 0.0 } }
    }

    /// How much further the kernels of a level may reach, by what is known of its error.
    fn factor(&self, levels: &[Detail], level: usize, varies: bool) -> f32 {
        let all = levels[0].error;
        let good = all.zip(levels[level].error).map(|(all, own)| own <= self.error_ratio * all);
        match (good, varies) {
            (Some(true), _) => Self::MEASURED,
            (Some(false), _) | (None, true) => 1.0 / 3.0,
            (None, false) => 1.0,
        }
    }

    /// From so many [`Self::kernel_pixels`] on the coarsest level is chosen: see [`Self::choose`], and [`Governor::set_coarsest`].
    pub fn coarsest(&self, levels: &[Detail], pixels: f32, varies: bool) -> f32 {
        let Some(last) = levels.len().checked_sub(1).filter(|last| *last > 0) else { return 0.0 };
        // Not less for rounding.
        1.001 * levels[last].reach * pixels / self.factor(levels, last, varies)
    }
}

/// A level, and the next coarser one that it fades into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The finer of both.
    pub level: usize,
    /// Share of the next coarser one, 0..1.
    pub coarser: f32,
}

/// The levels of an asset, level 0 first.
pub fn details(asset: &Asset) -> Vec<Detail> {
    let radii = asset.samples.position_radius.iter().map(|p| f64::from(p[3]));
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(radii.scan(0.0, |sum, radius| {
            *sum += radius;
            Some(*sum)
        }))
        .collect();
    let reach = |count: usize, width_factor: f32| {
        let mean = sums.get(count).map_or(0.0, |sum| sum / count.max(1) as f64) as f32;
        kernel::CUT_OFF_RADIUS / kernel::sharpness(mean, width_factor)
    };
    let errors = asset.level_errors();
    let sizes = asset.level_sizes().into_iter().zip(errors);
    sizes.map(|((count, width), error)| Detail { reach: reach(count, width), error }).collect()
}

/// Pixels to a mesh unit where an object is nearest to the camera.
pub fn pixels_at_nearest(frame: &Frame, info: &Info) -> f32 {
    let nearest = frame.view.origin.length() - 0.5 * info.diagonal();
    0.5 * frame.height as f32 / (frame.view.up.length() * nearest.max(1e-6 * info.diagonal()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels(errors: Option<[f64; 4]>) -> Vec<Detail> {
        let one = |k: usize| Detail { reach: 0.02 * 1.6f32.powi(k as i32), error: errors.map(|e| e[k]) };
        (0..4).map(one).collect()
    }

    #[test]
    fn small_objects_get_coarse_levels_and_large_ones_all_samples() {
        let levels = levels(None);
        let level = |pixels| Fineness::DEFAULT.choose(&levels, pixels, false).level;
        assert_eq!([level(1000.0), level(90.0), level(60.0), level(1.0)], [0, 1, 2, 3]);
        assert_eq!(Fineness::DEFAULT.choose(&levels, 60.0, true).level, 0);
        let never = Fineness { kernel_pixels: 0.0, ..Fineness::DEFAULT };
        assert_eq!(never.choose(&levels, 1.0, false), Choice { level: 0, coarser: 0.0 });
    }

    #[test]
    fn a_level_measured_to_be_good_serves_larger_objects() {
        let good = levels(Some([0.02, 0.021, 0.05, 0.1]));
        assert_eq!(Fineness::DEFAULT.choose(&good, 400.0, false).level, 1);
        // Varying density or not: the error says it.
        assert_eq!(Fineness::DEFAULT.choose(&good, 400.0, true).level, 1);
        assert_eq!(Fineness::DEFAULT.choose(&levels(None), 400.0, false).level, 0);
        // A level known to be worse only where it hardly shows.
        let level = |pixels| Fineness::DEFAULT.choose(&good, pixels, false).level;
        assert_eq!([level(60.0), level(20.0), level(1.0)], [1, 2, 3]);
    }

    #[test]
    fn the_coarsest_level_is_chosen_from_where_it_is_said() {
        for errors in [None, Some([0.02, 0.021, 0.05, 0.1]), Some([0.02, 0.021, 0.021, 0.021])] {
            for (pixels, varies) in [(20.0, false), (400.0, true), (1234.5, false)] {
                let levels = levels(errors);
                let enough = Fineness::DEFAULT.coarsest(&levels, pixels, varies);
                let level = |kernel_pixels| {
                    Fineness { kernel_pixels, ..Fineness::DEFAULT }.choose(&levels, pixels, varies).level
                };
                assert_eq!((level(enough), level(0.99 * enough)), (3, 2), "{errors:?} {pixels}");
            }
        }
        assert_eq!(Fineness::DEFAULT.coarsest(&levels(None)[..1], 100.0, false), 0.0);
    }

    #[test]
    fn levels_fade_into_each_other_without_a_jump() {
        let levels = levels(None);
        // Fineness as a number: the level, and how far it has faded into the next.
        let at = |pixels: f32| {
            let choice = Fineness::DEFAULT.choose(&levels, pixels, false);
            choice.level as f32 + choice.coarser
        };
        let steps: Vec<f32> = (0..4000).map(|k| at(200.0 * 0.999f32.powi(k))).collect();
        assert_eq!((steps[0], steps[3999]), (0.0, 3.0));
        for pair in steps.windows(2) {
            assert!((0.0..0.01).contains(&(pair[1] - pair[0])), "{pair:?}");
        }
    }
}
