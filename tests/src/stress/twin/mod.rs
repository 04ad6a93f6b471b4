//! The player's sum in double precision, with a running error bound of what single precision may make of it.
//!
//! The same asset, the same rays and inside pieces, the same definitions (heads of `formats`' `reconstruct`, `slopes`
//! and `encoding`, and of the player's lighting), but plain: every kernel is visited, its integral is quadrature, and
//! nothing is shared with the code under test beyond the spherical harmonics in f64 and which samples are neighbours.
//!
//! Every quantity carries a bound of its error in single precision (Higham, "Accuracy and Stability of Numerical
//! Algorithms", 2nd ed., section 3.3: running error analysis), u = 2^-24 throughout. It is small where the sum is well
//! conditioned, and grows only where a ray meets nothing but the rims of kernels, a camera is so far away that single
//! precision cannot say where a kernel is, or light comes from where a sample is. It never exceeds the largest source
//! on the ray: a weighted mean lies among its parts whatever the weights.

mod kernels;
mod light;
mod phase;
mod slopes;

pub use kernels::{Medium, Piece, Seen};
pub use light::Lit;

use diaphane_formats::asset::{Asset, Samples};
use diaphane_formats::harmonics::Coefficients;
use diaphane_formats::slopes::Stencil;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::usable::{largest_extinction, usable_samples};
use glam::DVec3;
use std::sync::OnceLock;

/// Unit roundoff of single precision.
pub const U: f64 = 5.960_464_477_539_063e-8;

/// A number and how far single precision may be from it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounded {
    /// In double precision.
    pub value: f64,
    /// Largest deviation.
    pub error: f64,
}

/// An asset in double precision.
pub struct Twin<'a> {
    asset: &'a Asset,
    samples: Samples,
    depth: Coefficients,
    boundary: Coefficients,
    stencil: Stencil,
    place: Vec<DVec3>,
    centre: Vec<DVec3>,
    sharpness: Vec<f64>,
    folded: OnceLock<light::Folded>,
}

impl<'a> Twin<'a> {
    /// Of an asset.
    pub fn new(asset: &'a Asset) -> Self {
        let samples = usable_samples(asset);
        let place = (0..samples.len())
            .map(|i| {
                let [x, y, z, radius] = samples.position_radius[i].map(f64::from);
                let [ox, oy, oz, _] = samples.offset[i].map(f64::from);
                DVec3::new(x, y, z) + DVec3::new(ox, oy, oz) * (radius / 127.0)
            })
            .collect();
        let fwhm = f64::from(asset.info.width_factor);
        Self {
            depth: samples.depth.decoded(),
            boundary: samples.boundary.decoded(),
            stencil: Stencil::new(&samples, largest_extinction(&asset.info, asset.density.as_ref())),
            centre: (0..samples.len()).map(|i| samples.position(i).as_dvec3()).collect(),
            sharpness: samples
                .position_radius
                .iter()
                .map(|p| 2.0 * std::f64::consts::LN_2.sqrt() / (fwhm * f64::from(p[3])))
                .collect(),
            place,
            asset,
            samples,
            folded: OnceLock::new(),
        }
    }

    /// Sources under the lights of a frame.
    pub fn lit(&self, frame: &Frame) -> Lit {
        let values = self.values(frame);
        self.sources(&values)
    }
}
