//! Phase functions: how scattered light spreads over directions. Unit 1/sr, normalised to 1 over the sphere.
//!
//! Henyey and Greenstein 1941. `cosine` is between the direction the light travels and the direction towards the
//! camera: 1 means straight on. Checked by the tests below: unit integral and mean cosine g.

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
    // (1-g)² + 2g(1-cos) is the textbook denominator without its cancellation near g = 1, cos = 1.
    let base = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cosine);
    (1.0 - g * g) / (4.0 * PI * base * base.sqrt())
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
}
