//! Levels of detail: fewer samples of the same object, for where it is small in the picture.
//!
//! Level 0 are all samples; level k > 0 are the first of them, fewer the greater k is, with wider kernels and weights of
//! their own. Everything else of a sample is the same at all levels.

use super::{Asset, Samples};
use crate::harmonics::Harmonics;
use crate::{Error, Result};

/// Levels of an asset at the most, level 0 included.
pub const MAX_LEVELS: usize = 8;

/// A level coarser than all samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Full width at half maximum of its kernels in disk radii.
    pub width_factor: f32,
    /// Partition-of-unity weight of each of its kernels, as many as it has samples, ≥ 0; an f16.
    pub weight: Vec<f32>,
    /// Its error as the bake measured it: root mean square over that of the truth, as [`super::CertifiedError::rel_rmse`] is for
    /// all samples.
    pub error: Option<f32>,
}

/// Checks that each level has fewer samples than the one before it, the first fewer than `samples`.
pub(super) fn validate(levels: &[Level], samples: usize) -> Result<()> {
    let fail = |what: &str| Err(Error::invalid(format!("the asset's levels of detail {what}")));
    if levels.len() >= MAX_LEVELS {
        return fail("are too many");
    }
    let mut finer = samples;
    for level in levels {
        if !(1..finer).contains(&level.weight.len()) {
            return fail("do not have fewer samples one after the other");
        }
        finer = level.weight.len();
        if !(level.width_factor > 0.0 && level.width_factor.is_finite()) {
            return fail("have a width factor out of range");
        }
        if !level.error.is_none_or(|e| e.is_finite() && e >= 0.0) {
            return fail("have errors out of range");
        }
        if !level.weight.iter().all(|w| w.is_finite() && *w >= 0.0) {
            return fail("have weights out of range");
        }
    }
    Ok(())
}

pub(super) fn no_level(level: usize, count: usize) -> Error {
    Error::invalid(format!(
        "the asset has no level {level}; its coarsest is level {}",
        count.saturating_sub(1)
    ))
}

impl Asset {
    /// Number of samples and width factor of each level, level 0 first.
    pub fn level_sizes(&self) -> Vec<(usize, f32)> {
        let coarser = self.levels.iter().map(|l| (l.weight.len(), l.width_factor));
        std::iter::once((self.samples.len(), self.info.width_factor)).chain(coarser).collect()
    }

    /// Measured error of each level, level 0 first: root mean square over that of the truth.
    pub fn level_errors(&self) -> Vec<Option<f64>> {
        let all = self.info.certificate.and_then(|c| c.error).map(|e| e.rel_rmse);
        std::iter::once(all).chain(self.levels.iter().map(|l| l.error.map(f64::from))).collect()
    }

    /// Level `level` alone, as an asset without coarser levels; level 0 are all samples. The certificate is that of
    /// level 0 and stays with it.
    ///
    /// # Errors
    /// No such level, or parts that do not fit together.
    pub fn level(&self, level: usize) -> Result<Self> {
        let mut info = self.info.clone();
        let samples = match level.checked_sub(1) {
            None => self.samples.clone(),
            Some(i) => {
                let own = self.levels.get(i).ok_or_else(|| no_level(level, self.levels.len() + 1))?;
                info.samples = own.weight.len() as u64;
                info.width_factor = own.width_factor;
                info.certificate = None;
                self.samples.first(&own.weight)
            }
        };
        let alone = Self {
            info,
            samples,
            levels: Vec::new(),
            mesh_positions: self.mesh_positions.clone(),
            mesh_triangles: self.mesh_triangles.clone(),
            density: self.density.clone(),
        };
        alone.validate()?;
        Ok(alone)
    }
}

impl Samples {
    /// As many of the first samples as there are weights, which they get.
    fn first(&self, weight: &[f32]) -> Self {
        let n = weight.len();
        let harmonics = |h: &Harmonics| h.picked(0..n.min(h.len()));
        Self {
            position_radius: self.position_radius.iter().take(n).copied().collect(),
            offset: self.offset.iter().take(n).copied().collect(),
            weight: weight.to_vec(),
            depth: harmonics(&self.depth),
            lobe: self.lobe.iter().take(n).copied().collect(),
            boundary: harmonics(&self.boundary),
        }
    }
}
