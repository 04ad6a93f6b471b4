//! What the spherical-harmonics coefficients of a sample mean.
//!
//! One scalar function of direction serves all channels, because τ_c = `extinction`_c · m. It is stored for the
//! reference extinction κ̄ (the mean of the channels) as one of
//!
//! - ψ = exp(-κ̄m): the thesis' choice (section 3.3.1), the documented baseline;
//! - τ = κ̄m;
//! - 1/(κ̄m + ε): near a flat boundary this is a clamped cosine, which few bands capture, where ψ is almost a step;
//! - the same, from which samples near a flat surface have a lobe max(a·ω, 0) taken out: the cosine of that surface.
//!
//! Values outside the range that makes sense stand for its ends, so that a fit to ψ is free there. Zero coefficients
//! mean darkness in all but τ.

use serde::{Deserialize, Serialize};

/// The function of optical depth that is expanded in spherical harmonics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Encoding {
    /// ψ = exp(-τ).
    Transmittance,
    /// τ.
    Depth,
    /// 1/(τ + ε).
    Reciprocal {
        /// ε > 0 bounds the function where light enters at once.
        epsilon: f32,
    },
    /// 1/(τ + ε), for some samples less a lobe.
    Lobe {
        /// As above.
        epsilon: f32,
    },
}

impl Encoding {
    /// The reciprocal with ε = 0.1.
    pub const RECIPROCAL: Self = Self::Reciprocal { epsilon: 0.1 };
    /// The lobe with the same ε.
    pub const LOBE: Self = Self::Lobe { epsilon: 0.1 };

    /// Whether a lobe is stored beside the harmonics.
    pub fn has_lobe(self) -> bool {
        matches!(self, Self::Lobe { .. })
    }

    /// The stored function's value (lobe included) for optical depth `tau` ≥ 0 at the reference extinction.
    pub fn encode(self, tau: f64) -> f64 {
        match self {
            Self::Transmittance => (-tau).exp(),
            Self::Depth => tau,
            Self::Reciprocal { epsilon } | Self::Lobe { epsilon } => 1.0 / (tau + f64::from(epsilon)),
        }
    }

    /// Optical depth at the reference extinction from a (possibly ringing) reconstructed value: in 0..=∞, never
    /// NaN for finite input, so that the transmittance stays within 0..1.
    pub fn decode(self, value: f32) -> f32 {
        match self {
            Self::Transmittance => {
                if value <= 0.0 {
                    f32::INFINITY
                } else {
                    (-value.ln()).max(0.0)
                }
            }
            Self::Depth => value.max(0.0),
            Self::Reciprocal { epsilon } | Self::Lobe { epsilon } => {
                if value <= 0.0 {
                    f32::INFINITY
                } else {
                    (1.0 / value - epsilon).max(0.0)
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Encoding;

    #[test]
    fn round_trip_and_clamps() {
        assert_eq!(Encoding::Depth.decode(-3.0), 0.0);
        assert_eq!(Encoding::Depth.decode(Encoding::Depth.encode(2.5) as f32), 2.5);
        for encoding in [Encoding::Transmittance, Encoding::RECIPROCAL, Encoding::LOBE] {
            for tau in [0.0, 1e-3, 0.5, 4.0, 12.0] {
                let back = encoding.decode(encoding.encode(tau) as f32);
                assert!((f64::from(back) - tau).abs() < 1e-4 * (1.0 + tau), "{encoding:?} {tau} {back}");
            }
            assert_eq!(encoding.decode(0.0), f32::INFINITY);
            assert_eq!(encoding.decode(-3.0), f32::INFINITY);
            assert_eq!(encoding.decode(1e9), 0.0);
        }
    }
}
