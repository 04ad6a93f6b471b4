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
mod profile;
mod slopes;

pub use kernels::{Piece, Seen};
pub use light::Lit;

use diaphane_formats::asset::{Asset, Samples};
use diaphane_formats::harmonics::Coefficients;
use diaphane_formats::slopes::Stencil;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::usable::{largest_extinction, usable_samples};
use glam::DVec3;
use std::collections::BTreeSet;

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
    /// κ per channel: of the homogeneous medium, or at density 1.
    extinction: DVec3,
    density: Option<profile::Density<'a>>,
    folded: light::Folded,
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
            extinction: DVec3::from(asset.info.extinction)
                * if asset.density.is_some() { 1.0 } else { asset.info.uniform_density },
            density: asset.density.as_ref().map(profile::Density::new),
            folded: light::Folded::new(samples.len()),
            asset,
            samples,
        }
    }

    /// Sources of the samples `wanted` (each once) under the lights of a frame.
    pub fn lit(&self, frame: &Frame, wanted: &[usize]) -> Lit {
        let around = wanted.iter().flat_map(|i| self.neighbours(*i)).chain(wanted.iter().copied());
        let needed: Vec<usize> = around.collect::<BTreeSet<_>>().into_iter().collect();
        let values = needed.iter().copied().zip(self.values(frame, &needed)).collect();
        self.sources(&values, wanted)
    }

    /// The samples whose values give the slope at sample `i`.
    fn neighbours(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.stencil.spokes[i].iter().map(|s| s.neighbour as usize).filter(move |j| *j != i)
    }

    /// Largest density on a ray.
    fn densest(&self) -> f64 {
        self.density.as_ref().map_or(1.0, |d| d.most)
    }
}
