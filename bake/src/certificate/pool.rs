//! From radiance along rays to the figures of the certificate.
//!
//! A picture shows one view under two lights of equal strength: light l and another one that changes with the view.
//! (One light alone, often from behind, overrates what a user sees; three underrate it. Measured against pictures of
//! the reference, pairs came closest.) The player's sum over two lights is taken as the sum of its pictures, from which
//! it differs only by how slopes mix. All squares are pooled: rel_rmse² = Σ(I-R)² / ΣR², with the unbiased products of
//! [`crate::measure::truth`] in place of the squares and equal weight for every picture.

use crate::measure::truth::Radiance;
use diaphane_formats::phase::Phase;
use glam::DVec3;

/// Truth and played radiance of all views and lights, light l in channel l % 3.
#[derive(Clone, Copy)]
pub(super) struct Pictures<'a> {
    /// Direction and number of rays of each view.
    pub views: &'a [(DVec3, usize)],
    /// Unit vectors towards the lights.
    pub lights: &'a [DVec3],
    /// Per channel; left out of the radiance below, as the phase function.
    pub albedo: DVec3,
    pub phase: Phase,
    /// Per light, per ray over all views.
    pub truth: &'a [Radiance],
    /// In the same order.
    pub played: &'a [Vec<f32>],
}

/// What is said of all pictures.
pub(super) struct Figures {
    pub rel_rmse: f64,
    pub psnr_db: f64,
    pub bias: f64,
}

/// Means over the rays of a picture, and their sums over pictures.
#[derive(Clone, Copy, Default)]
struct Sums {
    square_error: f64,
    square: f64,
    played: f64,
    truth: f64,
    pictures: f64,
}

impl Pictures<'_> {
    /// The figures; `None` where there is no light to measure.
    pub fn figures(&self) -> Option<Figures> {
        let mut sums = Sums::default();
        let mut values = Vec::new();
        for (view, rays) in self.rays().enumerate() {
            for light in 0..self.lights.len() {
                // Another light of the same channel.
                let channels = self.lights.len() / 3;
                let other = (light + 3 * (1 + view % (channels - 1).max(1))) % self.lights.len();
                self.add(view, rays.clone(), &[light, other], &mut sums, Some(&mut values));
            }
        }
        let square_error = sums.square_error()?;
        let mean_square = square_error * sums.square / sums.pictures;
        let peak = percentile(&mut values, 0.999);
        let ratio = peak * peak / mean_square;
        Some(Figures {
            rel_rmse: square_error.sqrt(),
            psnr_db: if ratio.is_finite() && ratio > 0.0 { 10.0 * ratio.log10() } else { f64::INFINITY },
            bias: sums.played / sums.truth - 1.0,
        })
    }

    /// Relative mean square error of pictures with one light each, those of `lights`; `None` without light.
    pub fn single(&self, lights: impl IntoIterator<Item = usize>) -> Option<f64> {
        let mut sums = Sums::default();
        for light in lights {
            for (view, rays) in self.rays().enumerate() {
                self.add(view, rays, &[light], &mut sums, None);
            }
        }
        sums.square_error()
    }

    /// The ray numbers of each view.
    fn rays(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        self.views.iter().scan(0, |at, view| {
            let from = *at;
            *at += view.1;
            Some(from..*at)
        })
    }

    fn add(
        &self,
        view: usize,
        rays: std::ops::Range<usize>,
        lights: &[usize],
        sums: &mut Sums,
        mut values: Option<&mut Vec<f64>>,
    ) {
        let count = rays.len() as f64;
        if rays.is_empty() {
            return;
        }
        for ray in rays {
            let (mut played, mut truth) = (0.0, [0.0; 2]);
            for &l in lights {
                // Light travels against `lights`, the camera lies against the rays.
                let phase = self.phase.value(self.lights[l].dot(self.views[view].0));
                let scattered = self.albedo[l % 3] * phase;
                played += scattered * f64::from(self.played[l][ray]);
                (0..2).for_each(|k| truth[k] += scattered * f64::from(self.truth[l][ray][k]));
            }
            sums.square_error += (played - truth[0]) * (played - truth[1]) / count;
            sums.square += truth[0] * truth[1] / count;
            sums.played += played / count;
            let mean = 0.5 * (truth[0] + truth[1]);
            sums.truth += mean / count;
            if let Some(values) = &mut values {
                values.push(mean);
            }
        }
        sums.pictures += 1.0;
    }
}

impl Sums {
    /// Σ(I-R)² / ΣR². Noise may leave less than nothing of a tiny error: that is none.
    fn square_error(&self) -> Option<f64> {
        let ratio = self.square_error / self.square;
        (self.square > 0.0 && self.truth > 0.0 && ratio.is_finite()).then_some(ratio.max(0.0))
    }
}

/// The value below which the part `part` of the values lies; 0 if there are none.
fn percentile(values: &mut [f64], part: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    *values.select_nth_unstable_by((part * last as f64).round() as usize, f64::total_cmp).1
}
