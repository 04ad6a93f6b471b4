//! Levels of detail by a budget of time: coarser where frames take longer, finer where there is time left.
//!
//! Milliseconds of frames and the samples drawn in them come in, a [`Fineness`] goes out. What kernels may reach is multiplied by
//! 2^x; x grows while the median of the last frames is above the budget and falls while it is well below, by bounded steps. Levels
//! are few and far apart (a factor of four in samples), so that the budget mostly lies between two of them. What was too slow is
//! therefore remembered, and is not tried again before it is expected to fit: of t = a + b n, n the samples, both
//! constants are known from two levels, and when t changes at the same n it is b that is taken to have changed, which is the best
//! that can be hoped for. Attempts in vain make the next one wait twice as long. Where levels fade into each other two of them are
//! drawn meanwhile, which has to fit too.

use super::Fineness;

/// Above this share of the budget frames are too slow, below the other one there is time left.
const SLOW: f64 = 1.05;
const TIME_LEFT: f64 = 0.85;
/// Frames whose median counts, and fewest of them: single slow frames change nothing.
const FRAMES: usize = 9;
const FEWEST: usize = 3;
/// Steps of x a frame: the largest towards coarser levels, which must not jump over a level (kernels of the next one reach 1.6 times
/// as far, of which 1.25 times are fading), the smallest, and that towards finer ones.
const COARSER: f32 = 0.25;
const LEAST: f32 = 1.0 / 16.0;
const FINER: f32 = 1.0 / 8.0;
/// Samples that differ by this share are another level.
const OTHER: f64 = 0.1;
/// Frames between attempts to draw what was too slow: at first, and at the most.
const PAUSE: u32 = 16;
const LONGEST_PAUSE: u32 = 2048;
/// Pixels that kernels may reach as soon as a budget asks for it, and at the most.
const FIRST_REACH: f32 = 1.0;
const LAST_REACH: f32 = 512.0;

/// Keeps frames within a budget of milliseconds through the levels that they are drawn with.
#[derive(Clone, Debug)]
pub struct Governor {
    finest: Fineness,
    budget: f64,
    /// x.
    octaves: f32,
    /// The greatest x of use.
    most: f32,
    /// Milliseconds of the last frames of about so many samples.
    times: Vec<f64>,
    samples: u64,
    /// x of the frame before, where it was another one.
    stepped_from: Option<f32>,
    too_slow: Option<TooSlow>,
    /// Frames since something was found to be too slow, and how long not to try it again.
    waited: u32,
    pause: u32,
}

/// What took too long.
#[derive(Clone, Copy, Debug)]
struct TooSlow {
    /// From this x on it was over.
    octaves: f32,
    samples: u64,
    milliseconds: f64,
    /// Samples and milliseconds of what was drawn instead.
    instead: Option<(u64, f64)>,
}

impl Governor {
    /// Frames are to take at most `budget` milliseconds, and are as fine as `finest` where they do.
    pub fn new(finest: Fineness, budget: f64) -> Self {
        let mut governor = Self {
            finest,
            budget,
            octaves: 0.0,
            most: 0.0,
            times: Vec::new(),
            samples: 0,
            stepped_from: None,
            too_slow: None,
            waited: 0,
            pause: PAUSE,
        };
        governor.set_coarsest(LAST_REACH);
        governor
    }

    /// Reaches beyond so many pixels change nothing, because the coarsest level is drawn already ([`Fineness::coarsest`]). Need not
    /// be told; where it is, finer levels are back sooner.
    pub fn set_coarsest(&mut self, kernel_pixels: f32) {
        let most = (kernel_pixels.min(LAST_REACH) / self.first_reach()).log2();
        self.most = if most > 0.0 { most } else { 0.0 };
        self.octaves = self.octaves.min(self.most);
    }

    /// The budget, milliseconds.
    pub fn budget(&self) -> f64 {
        self.budget
    }

    /// What the next frame is to be drawn with.
    pub fn fineness(&self) -> Fineness {
        if self.octaves <= 0.0 {
            return self.finest;
        }
        Fineness { kernel_pixels: self.first_reach() * self.octaves.exp2(), ..self.finest }
    }

    /// Whether levels cannot be coarser.
    pub fn is_coarsest(&self) -> bool {
        self.octaves >= self.most
    }

    fn first_reach(&self) -> f32 {
        self.finest.kernel_pixels.max(FIRST_REACH)
    }

    /// Takes what a frame drawn with [`Self::fineness`] took, and how many samples of all levels were in it. Returns what the next
    /// one is to be drawn with. Times that are none are left out, and frames in which nothing was drawn.
    pub fn learn(&mut self, milliseconds: f64, samples: u64) -> Fineness {
        if milliseconds.is_finite() && milliseconds > 0.0 && samples > 0 {
            self.take(milliseconds, samples);
            self.step();
        }
        self.fineness()
    }

    fn take(&mut self, milliseconds: f64, samples: u64) {
        let before = self.samples as f64;
        if let Some(octaves) = self.stepped_from.take()
            && (samples as f64 - before).abs() > OTHER * before
        {
            if self.octaves > octaves && samples < self.samples {
                self.remember();
            }
            self.times.clear();
        }
        self.samples = samples;
        if self.times.len() == FRAMES {
            self.times.remove(0);
        }
        self.times.push(milliseconds);
        self.waited = self.waited.saturating_add(1);
    }

    /// The last frames were too slow; from this x on they have fewer samples.
    fn remember(&mut self) {
        // On the way to levels that are coarser yet nothing was tried in vain.
        let on_the_way = self.too_slow.is_some();
        if !on_the_way {
            let soon = self.waited < 4 * self.pause;
            self.pause = if soon { (2 * self.pause).min(LONGEST_PAUSE) } else { PAUSE };
        }
        let milliseconds = median(&self.times);
        let (octaves, samples) = (self.octaves, self.samples);
        self.too_slow = Some(TooSlow { octaves, samples, milliseconds, instead: None });
        self.waited = 0;
    }

    fn step(&mut self) {
        if self.times.len() < FEWEST {
            return;
        }
        let milliseconds = median(&self.times);
        let step = if milliseconds > SLOW * self.budget {
            (0.5 * (milliseconds / self.budget).log2() as f32).clamp(LEAST, COARSER)
        } else if milliseconds < TIME_LEFT * self.budget && self.may_be_finer(milliseconds) {
            -FINER
        } else {
            0.0
        };
        let next = (self.octaves + step).clamp(0.0, self.most);
        if next != self.octaves {
            self.stepped_from = Some(self.octaves);
            self.octaves = next;
        }
    }

    /// Whether a step towards finer levels leads to nothing that is known to be too slow still.
    fn may_be_finer(&mut self, milliseconds: f64) -> bool {
        let Some(slow) = &mut self.too_slow else { return true };
        if slow.instead.is_none() && self.times.len() == FRAMES {
            slow.instead = Some((self.samples, milliseconds));
        }
        // Fewer samples than were fast enough: something has moved since.
        let fewer = slow.instead.is_some_and(|(n, _)| (self.samples as f64) < (1.0 - OTHER) * n as f64);
        if fewer || self.octaves - FINER >= slow.octaves {
            return true;
        }
        let again = self.waited >= self.pause
            && slow.expected(milliseconds, self.samples).is_some_and(|ms| ms < TIME_LEFT * self.budget);
        if again {
            self.too_slow = None;
            self.waited = 0;
        }
        again
    }
}

impl TooSlow {
    /// What it would take now that frames of so many samples take `milliseconds`; `None` before it is known what they took at first.
    fn expected(&self, milliseconds: f64, samples: u64) -> Option<f64> {
        let (fewer, faster) = self.instead?;
        let (all, fewer, now) = (self.samples as f64, fewer as f64, samples as f64);
        let per_sample = (self.milliseconds - faster) / (all - fewer);
        if !(per_sample > 0.0 && per_sample.is_finite()) || samples == 0 {
            return Some(self.milliseconds * milliseconds / faster);
        }
        let fixed = (faster - per_sample * fewer).max(0.0);
        Some(fixed.min(milliseconds) + (milliseconds - fixed).max(0.0) / now * all)
    }
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
#[path = "governor_tests.rs"]
mod tests;
