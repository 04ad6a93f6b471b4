//! Offset layers: isosurfaces of the depth under the boundary (thesis section 3.2.2).
//!
//! The first lies practically at the surface; spacing grows with depth, because light varies fastest near the
//! boundary; layers stop where nothing is left inside. Layers where no light arrives are dropped by the density stage.

mod isosurface;

use crate::Result;
use crate::field::{DistanceGrid, Shape};
use crate::params::Placement;
use crate::progress::Stage;
use diaphane_formats::medium::Medium;
use glam::DVec3;
use rayon::prelude::*;

/// One offset surface and the slab beneath it.
pub(crate) struct Layer {
    /// Depth of the surface below the boundary.
    pub offset: f64,
    /// Thickness of the slab down to the next layer.
    pub thickness: f64,
    pub positions: Vec<DVec3>,
    /// Unit vectors pointing deeper.
    pub inward: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// Each slab is this much thicker than the one above it.
const GROWTH: f64 = 1.25;
/// The thesis' constant offset in mean spacings of samples.
const THESIS_OFFSET: f64 = 0.5;

pub(crate) fn build(
    shape: &Shape<'_>,
    grid: &DistanceGrid,
    medium: &Medium,
    placement: Placement,
    stage: Stage<'_>,
) -> Result<Vec<Layer>> {
    let deepest = grid.depth.iter().copied().fold(0.0, f32::max) as f64;
    // Slabs no thicker than the samples' spacing or half a mean free path near the surface.
    let kappa = medium.reference_extinction().max(1e-9 / shape.diagonal);
    let first = (0.7 * shape.spacing).min(0.5 / kappa).max(shape.spacing * 0.2).max(deepest / 40.0);
    let (mut offsets, mut step, growth) = match placement {
        Placement::Boundary => (vec![0.02 * shape.spacing.min(grid.cell)], first, GROWTH),
        Placement::Layers => (vec![THESIS_OFFSET * shape.spacing], THESIS_OFFSET * shape.spacing, 1.0),
    };
    while let Some(next) = offsets.last().map(|o| o + step).filter(|n| *n < deepest) {
        offsets.push(next);
        step = (step * growth).min(4.0 * shape.spacing.max(first));
    }
    stage.announce(offsets.len());
    let layers = offsets
        .par_iter()
        .enumerate()
        .map(|(i, &offset)| {
            let next = offsets.get(i + 1).copied().unwrap_or(deepest.max(offset + step));
            let mut layer = isosurface::extract(grid, offset as f32);
            layer.offset = offset;
            layer.thickness = next - offset;
            stage.step(1)?;
            Ok(layer)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(layers.into_iter().filter(|l| !l.triangles.is_empty()).collect())
}
