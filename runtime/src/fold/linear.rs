//! The samples' side of folding: their transmittance as a sum of spherical harmonics.

use diaphane_formats::sh;
use glam::Vec3;
use half::f16;
use rayon::prelude::*;

/// Most bands: what an environment is reduced to.
pub const BANDS: usize = 10;

/// Circles of directions that the transmittance is projected in, with twice as many directions each: exact for products of two
/// functions within [`BANDS`], and half as much again.
const CIRCLES: usize = 14;

/// Samples of one task.
const TASK: usize = 64;
/// Every so manieth sample tells the error.
const CHECKED: usize = 16;

/// Coefficients of ψβ, as exact as f16, in which a GPU holds them.
#[derive(Clone, Debug)]
pub struct Linear {
    /// Bands of every sample.
    pub bands: usize,
    /// 1 where all channels attenuate alike, else 3.
    pub channels: usize,
    /// [sample][channel][coefficient].
    pub values: Vec<f32>,
    /// Root mean square over samples and directions.
    pub error: f32,
}

impl Linear {
    /// Projects the transmittance of `samples` samples: `through(i, to, basis)` is what sample `i` lets through from the
    /// unit direction `to`, whose first `order` bands of harmonics are `basis`.
    pub fn new(
        samples: usize,
        bands: usize,
        channels: usize,
        order: usize,
        through: impl Fn(usize, Vec3, &[f32]) -> Vec3 + Sync,
    ) -> Self {
        let (directions, solid_angles): (Vec<Vec3>, Vec<f32>) = quadrature(CIRCLES).into_iter().unzip();
        let (count, wide) = (bands * bands, order.max(bands).pow(2));
        let mut basis = vec![0.0; wide * directions.len()];
        for (row, d) in basis.chunks_exact_mut(wide).zip(&directions) {
            sh::evaluate_f32(order.max(bands), d.to_array(), row);
        }
        let rows = || directions.iter().zip(basis.chunks_exact(wide)).zip(&solid_angles);
        let one = |i: usize, sums: &mut [f32], psi: &mut [Vec3]| {
            sums.fill(0.0);
            for (((to, y), solid_angle), psi) in rows().zip(psi.iter_mut()) {
                *psi = through(i, *to, &y[..order * order]);
                for (c, sums) in sums.chunks_exact_mut(count).enumerate() {
                    let here = psi[c] * solid_angle;
                    sums.iter_mut().zip(y).for_each(|(sum, y)| *sum += here * y);
                }
            }
        };
        // Squared error of a sample, mean over all directions and channels.
        let error = |sums: &[f32], psi: &[Vec3]| -> f64 {
            let each = rows().zip(psi).map(|(((_, y), solid_angle), psi)| {
                let off = |(c, sums): (usize, &[f32])| {
                    f64::from(sums.iter().zip(y).map(|(s, y)| s * y).sum::<f32>().max(0.0) - psi[c]).powi(2)
                };
                sums.chunks_exact(count).enumerate().map(off).sum::<f64>() * f64::from(*solid_angle)
            });
            each.sum::<f64>() / (4.0 * std::f64::consts::PI * channels as f64)
        };
        let width = channels * count;
        let mut values = vec![0.0f32; samples * width];
        let errors: Vec<f64> = values
            .par_chunks_mut(TASK * width)
            .enumerate()
            .map(|(task, values)| {
                let (mut sums, mut psi) = (vec![0.0; width], vec![Vec3::ZERO; directions.len()]);
                let mut squares = 0.0;
                for (k, values) in values.chunks_exact_mut(width).enumerate() {
                    let i = task * TASK + k;
                    one(i, &mut sums, &mut psi);
                    values.iter_mut().zip(&sums).for_each(|(v, s)| *v = f16::from_f32(*s).to_f32());
                    squares += if i.is_multiple_of(CHECKED) { error(&sums, &psi) } else { 0.0 };
                }
                squares
            })
            .collect();
        let checked = samples.div_ceil(CHECKED).max(1) as f64;
        Self { bands, channels, values, error: (errors.iter().sum::<f64>() / checked).sqrt() as f32 }
    }

    /// Most bands, at most [`BANDS`] and even, whose coefficients stay below `bytes`; `None` where not even two do.
    pub fn fitting(samples: usize, channels: usize, bytes: u64) -> Option<usize> {
        let size = |bands: usize| (2 * samples * channels * bands * bands) as u64;
        (2..=BANDS).rev().step_by(2).find(|bands| size(*bands) <= bytes)
    }

    /// Coefficients of sample `i`, `channels` × bands².
    pub fn of(&self, i: usize) -> &[f32] {
        let width = self.channels * self.bands * self.bands;
        &self.values[i * width..(i + 1) * width]
    }
}

/// Directions on `circles` circles around z and the solid angle of each: Gauss and Legendre's nodes along z, by Newton's
/// iteration (Numerical Recipes 4.6.1), twice as many even steps around.
fn quadrature(circles: usize) -> Vec<(Vec3, f32)> {
    use std::f64::consts::{PI, TAU};
    let n = circles as f64;
    let circle = |i: usize| {
        let mut z = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut before, mut value) = (0.0, 1.0);
            for k in 1..=circles {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * z * value - (k - 1.0) * before) / k);
            }
            slope = n * (z * value - before) / (z * z - 1.0);
            z -= value / slope;
        }
        (z, 2.0 / ((1.0 - z * z) * slope * slope))
    };
    let around = 2 * circles;
    let each = |(z, weight): (f64, f64)| {
        (0..around).map(move |k| {
            let (sine, phi) = ((1.0 - z * z).sqrt(), TAU * (k as f64 + 0.5) / around as f64);
            let direction = glam::DVec3::new(sine * phi.cos(), sine * phi.sin(), z);
            (direction.as_vec3(), (weight * TAU / around as f64) as f32)
        })
    };
    (0..circles).map(circle).flat_map(each).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::directions::even_directions;

    #[test]
    fn functions_within_the_bands_are_found() {
        let function = |i: usize, to: Vec3, basis: &[f32]| {
            Vec3::new(0.5 + 0.3 * to.x, 0.4 + 0.2 * basis[6], 0.6 + 0.1 * i as f32 + to.y * to.z)
        };
        let linear = Linear::new(3, 4, 3, 3, function);
        let mut basis = [0.0; 16];
        for d in even_directions(50, 3) {
            sh::evaluate_f32(4, d.as_vec3().to_array(), &mut basis);
            for i in 0..3 {
                let exact = function(i, d.as_vec3(), &basis);
                let of = linear.of(i);
                for c in 0..3 {
                    let got: f32 = of[c * 16..][..16].iter().zip(&basis).map(|(a, b)| a * b).sum();
                    assert!((got - exact[c]).abs() < 1e-3, "{got} {exact}");
                }
            }
        }
        assert!(linear.error < 1e-3, "{}", linear.error);
    }

    #[test]
    fn bands_follow_the_room() {
        assert_eq!(Linear::fitting(1000, 1, 1 << 30), Some(10));
        assert_eq!(Linear::fitting(1000, 1, 128_000), Some(8));
        assert_eq!(Linear::fitting(1000, 3, 128_000), Some(4));
        assert_eq!(Linear::fitting(1000, 3, 1000), None);
    }
}
