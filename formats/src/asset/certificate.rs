//! How far an asset is from the truth, measured by the bake on rays and lights that it did not fit.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// What the bake measured of its own asset, and with what.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// The errors; `None` where nothing could be measured because no light leaves the object.
    pub error: Option<CertifiedError>,
    /// Rays through the object.
    pub rays: u32,
    /// Directions of view among which the rays are spread.
    pub views: u32,
    /// Directions of light, none of which was used to fit the samples.
    pub lights: u32,
    /// Seed of views, rays and lights.
    pub seed: u64,
}

/// Errors of played radiance, over all views and lights. Fractions, not percent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CertifiedError {
    /// Root mean square error over the root mean square of the truth: what a picture is expected to show.
    pub rel_rmse: f64,
    /// 10 log10(peak² / mean square error) in dB, the peak being the 99.9th percentile of the truth.
    pub psnr_db: f64,
    /// Mean of the played radiance over the mean of the truth, minus 1.
    pub bias: f64,
    /// The part of `rel_rmse` that remains when the samples hold exact light; more samples reduce it.
    pub interpolation: f64,
    /// The rest in squares, `rel_rmse`² = `interpolation`² + `representation`²: what the spherical harmonics lose;
    /// more bands reduce it.
    pub representation: f64,
}

impl Certificate {
    pub(super) fn validate(&self) -> Result<()> {
        let Some(e) = self.error else { return Ok(()) };
        let sizes = [e.rel_rmse, e.interpolation, e.representation];
        if sizes.iter().all(|v| v.is_finite() && *v >= 0.0) && !e.psnr_db.is_nan() && e.bias.is_finite() {
            Ok(())
        } else {
            Err(Error::invalid("the asset's certificate is out of range"))
        }
    }
}
