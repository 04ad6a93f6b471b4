//! Phase functions: how scattered light spreads over directions. Unit 1/sr, normalised to 1 over the sphere.
//!
//! Henyey and Greenstein 1941. `cosine` is between the direction the light travels and the direction towards the
//! camera: 1 means straight on. Checked by the tests below: unit integral and mean cosine g.
//!
//! The textbook's denominator 1 + g² - 2g cos is a difference of nearly equal numbers at the peak, which lies at cos = 1
//! or, for g < 0, at cos = -1. With s the sign of g and D = s ω_in - ω_out, |D|² = 2 (1 - s cos), it is
//! (1 - |g|)² + |g| |D|²: a sum of positive terms, each as exact as its directions.

use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A phase function.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// 1 / 4π in every direction.
    Isotropic,
    /// Henyey-Greenstein with mean cosine `g`, |g| < 1.
    HenyeyGreenstein {
        /// Mean cosine.
        g: f64,
    },
}

impl Phase {
    /// The mean cosine g; 0 for isotropic scattering.
    pub fn mean_cosine(self) -> f64 {
        match self {
            Self::Isotropic => 0.0,
            Self::HenyeyGreenstein { g } => g,
        }
    }

    /// Value at `cosine` in -1..1.
    pub fn value(self, cosine: f64) -> f64 {
        henyey_greenstein(self.mean_cosine(), cosine)
    }
}

/// Henyey-Greenstein's function; g = 0 is isotropic.
pub fn henyey_greenstein(g: f64, cosine: f64) -> f64 {
    let size = g.abs();
    let base = (1.0 - size) * (1.0 - size) + 2.0 * size * (1.0 - g.signum() * cosine);
    (1.0 - g * g) / (4.0 * PI * base * base.sqrt())
}

/// The same in single precision for light that travels along `travels` and leaves along `towards` (unit vectors), and
/// the denominator 1 + g² - 2g cos.
pub fn henyey_greenstein_f32(g: f32, travels: Vec3, towards: Vec3) -> (f32, f32) {
    let size = g.abs();
    let d2 = (travels * g.signum() - towards).length_squared();
    let base = ((1.0 - size) * (1.0 - size) + size * d2).max(1e-12);
    ((1.0 - size) * (1.0 + size) / (4.0 * std::f32::consts::PI * base * base.sqrt()), base)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalised_with_mean_cosine_g() {
        for g in [-0.9, -0.5, 0.0, 0.3, 0.9] {
            // Midpoint rule in the cosine, fine enough for the peak at |g| = 0.9.
            let n = 200_000;
            let (mut sum, mut mean) = (0.0, 0.0);
            for i in 0..n {
                let c = -1.0 + 2.0 * (i as f64 + 0.5) / n as f64;
                let p = henyey_greenstein(g, c) * 2.0 * PI * 2.0 / n as f64;
                sum += p;
                mean += p * c;
            }
            assert!((sum - 1.0).abs() < 1e-6, "g {g}: {sum}");
            assert!((mean - g).abs() < 1e-6, "g {g}: {mean}");
        }
    }

    /// Directions of unit length up to 2^-24 and g rounded to f32 move the peak by a few roundings of 1 - |g| and of the
    /// angle over the peak's width: 40 of them here.
    #[test]
    fn single_precision_holds_at_both_peaks() {
        for g in [-0.99f32, -0.9, -0.3, 0.0, 0.3, 0.9, 0.99] {
            for i in 0..2000 {
                // Angles from the peak, 1e-4 to π.
                let angle = 10f64.powf(-4.0 + 4.497 * f64::from(i) / 2000.0);
                let to = glam::DVec3::new(0.36, 0.48, 0.8);
                let across = to.any_orthonormal_vector();
                let travels = (to * angle.cos() + across * angle.sin()) * f64::from(g.signum());
                let exact = henyey_greenstein(f64::from(g), travels.dot(to));
                let (got, _) = henyey_greenstein_f32(g, travels.as_vec3(), to.as_vec3());
                let bound = 40.0 * 2f64.powi(-24) / (1.0 - f64::from(g.abs()));
                assert!((f64::from(got) / exact - 1.0).abs() < bound, "g {g} angle {angle}: {got} {exact}");
            }
        }
    }
}
