//! Spherical harmonics of the encoded optical depth, fitted to the transmittance itself, each sample with as few bands
//! as it needs.
//!
//! The stored function y(ω) = Σ c_k Y_k(ω) is decoded to ψ̂ = exp(-τ(y)) at run time, so the coefficients minimise
//! Σ_ω (ψ̂ - ψ)² (see [`super::least_squares`]); a plain projection minimises the error of y instead, which matters
//! most where no light comes from. How bands are found: [`super::ladder`]. What is kept is quantised ([`diaphane_formats::harmonics`]).

use super::boundary::{BOUNDARY_ORDER, boundary};
use super::depths::{Lit, directions};
use super::ladder::{FirstFits, all_bands, suits};
use super::levels::Levels;
use super::rounding::Rounding;
use crate::params::Params;
use crate::progress::Stage;
use crate::{Error, Result};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::harmonics::{Coefficients, Harmonics};
use diaphane_formats::lobe;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// The light of all samples.
#[derive(Serialize, Deserialize)]
pub(crate) struct Light {
    pub encoding: Encoding,
    pub depth: Harmonics,
    pub lobe: Vec<Vec3>,
    pub boundary: Harmonics,
}

impl Light {
    /// Whether one read from a cache can be that of so many samples.
    pub fn fits(&self, samples: usize, matched: bool, params: &Params) -> bool {
        let boundary = if matched { (0, 0) } else { (samples, params.order.min(BOUNDARY_ORDER)) };
        suits(self.encoding, params)
            && self.lobe.len() == if self.encoding.has_lobe() { samples } else { 0 }
            && self.lobe.iter().all(|v| v.is_finite())
            && self.depth.validate(samples, params.peak_order(), "depth").is_ok()
            && self.boundary.validate(boundary.0, boundary.1, "boundary").is_ok()
            && self.boundary.order.iter().all(|k| usize::from(*k) == boundary.1)
    }

    /// No light at all for `count` samples, and this many bands of the boundary's transmittance (0: index matched).
    pub fn none(count: usize, boundary_order: usize) -> Self {
        let dark = |order: usize| Coefficients::zeros(vec![order as u8; count]).quantised();
        let boundary = if boundary_order == 0 { Harmonics::default() } else { dark(boundary_order) };
        Self { encoding: Encoding::RECIPROCAL, depth: dark(1), lobe: Vec::new(), boundary }
    }

    /// That of these samples, in this order.
    pub fn picked(&self, numbers: &[u32]) -> Self {
        let numbers = || numbers.iter().map(|i| *i as usize);
        Self {
            encoding: self.encoding,
            depth: self.depth.picked(numbers()),
            lobe: numbers().filter_map(|i| self.lobe.get(i).copied()).collect(),
            boundary: self.boundary.picked(numbers()),
        }
    }
}

/// The fits of some samples, in their order.
#[derive(Serialize, Deserialize)]
pub(crate) struct Fits {
    /// What is fitted: one choice for all samples of an asset.
    pub encoding: Encoding,
    order: Vec<u8>,
    /// `order`² coefficients of each sample.
    values: Vec<f32>,
    lobe: Vec<Vec3>,
    /// Coefficients of the boundary's transmittance, as many for each sample; empty when index matched.
    boundary: Vec<f32>,
}

impl Fits {
    /// Whether one read from a cache can be that of so many samples that receive light.
    pub fn fits(&self, samples: usize, matched: bool, params: &Params) -> bool {
        let count: usize = self.order.iter().map(|k| usize::from(*k).pow(2)).sum();
        let boundary = if matched { 0 } else { params.order.min(BOUNDARY_ORDER).pow(2) };
        suits(self.encoding, params)
            && self.order.len() == samples
            && self.order.iter().all(|k| usize::from(*k) <= params.peak_order())
            && self.values.len() == count
            && self.lobe.len() == samples
            && self.boundary.len() == samples * boundary
            && self.values.iter().chain(&self.boundary).all(|v| v.is_finite())
            && self.lobe.iter().all(|v| v.is_finite())
    }

    /// Those of more samples behind these.
    pub fn append(&mut self, more: Self) {
        self.order.extend(more.order);
        self.values.extend(more.values);
        self.lobe.extend(more.lobe);
        self.boundary.extend(more.boundary);
    }
}

/// Fits the samples of a block, from what [`first_fits`](super::ladder::first_fits) found.
pub(crate) fn fits(lit: &Lit, first: FirstFits, params: &Params, stage: Stage<'_>) -> Result<Fits> {
    let directions = directions(params);
    let levels = Levels::new(&directions, params.peak_order().max(BOUNDARY_ORDER));
    let encoding = first.encoding;
    let fitted = all_bands(lit, first, &levels, params, stage)?;
    Ok(Fits {
        encoding,
        order: fitted.iter().map(|f| f.order as u8).collect(),
        values: fitted.iter().flat_map(|f| &f.coefficients).copied().collect(),
        lobe: fitted.iter().map(|f| f.lobe).collect(),
        boundary: boundary(lit, &levels.all.basis, params, directions.len()),
    })
}

/// The fits of all samples in few bytes.
pub(crate) fn quantised(fits: Fits, params: &Params, stage: Stage<'_>) -> Result<Light> {
    let Fits { encoding, order, values, lobe, boundary } = fits;
    let directions = directions(params);
    let stored = |vector: &Vec3| lobe::vector(lobe::code(*vector));
    let lobe: Vec<Vec3> = if encoding.has_lobe() { lobe.iter().map(stored).collect() } else { Vec::new() };
    let boundary = match boundary.len() / order.len().max(1) {
        0 => Harmonics::default(),
        each => {
            Coefficients { values: boundary, ..Coefficients::zeros(vec![each.isqrt() as u8; order.len()]) }
                .quantised()
        }
    };
    let exact = Coefficients { values, ..Coefficients::zeros(order) };
    let levels = Levels::new(&directions, params.peak_order());
    // A part of the directions tells as much where it is enough.
    let rounders =
        levels.each().map(|level| (level, Rounding::new(&level.basis, params.peak_order(), encoding)));
    stage.announce(exact.len());
    let depth = exact.quantised_by::<Error>(|i, book, codes| {
        stage.step(1)?;
        let lobe = lobe.get(i).copied().unwrap_or(Vec3::ZERO);
        let x = exact.of(i);
        let (level, rounding) = &rounders[levels.for_rounding(x.len())];
        rounding.choose(x, |d| lobe.dot(level.directions[d]).max(0.0), book, codes);
        Ok(())
    })?;
    Ok(Light { encoding, depth, lobe, boundary })
}
