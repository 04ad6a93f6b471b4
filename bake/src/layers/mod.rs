//! Offset layers: isosurfaces of the depth under the boundary (thesis section 3.2.2).
//!
//! The first lies practically at the surface; spacing grows with depth, because light varies fastest near the
//! boundary; layers stop where nothing is left inside. Layers where no light arrives are dropped by the density stage.

mod isosurface;

use crate::Result;
use crate::field::{DistanceGrid, Shape};
use crate::params::{DARK, Placement};
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

/// Layers from the boundary inwards, and how many more there would be where no light arrives.
pub(crate) fn build(
    shape: &Shape<'_>,
    grid: &DistanceGrid,
    medium: &Medium,
    placement: Placement,
    stage: Stage<'_>,
) -> Result<(Vec<Layer>, usize)> {
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
    // From any point light passes its depth at least; the isosurface is good to a cell of the grid.
    let lit = -DARK.ln() / (kappa * medium.least_density()) + grid.cell;
    let count = offsets.iter().take_while(|offset| **offset <= lit).count();
    stage.announce(count);
    let layers = offsets[..count]
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
    let layers = layers.into_iter().filter(|l| !l.triangles.is_empty()).collect();
    Ok((layers, offsets.len() - count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Params;
    use crate::progress::{Silent, Timed};
    use crate::{Prepared, density};
    use diaphane_assets::shapes::icosphere;
    use diaphane_formats::medium::Density;
    use diaphane_formats::mesh::{Mesh, MeshReport};
    use diaphane_formats::phase::Phase;

    #[test]
    fn layers_that_are_left_out_are_dark() {
        let raw = icosphere(1.0, 4);
        let mesh = Mesh::from_triangles(raw.positions, raw.triangles).unwrap().0;
        let params = Params { samples: 3_000, ..Params::default() };
        let shape = Shape::new(&mesh, &MeshReport::default(), &params);
        let timed = Timed::new(&Silent);
        let grid = timed.stage("grid", |p| DistanceGrid::new(&shape, 40.0, p)).unwrap();
        let medium = |kappa: f64| {
            let even = Density::Uniform(2.0);
            Medium::new(DVec3::splat(kappa), DVec3::ONE, Phase::Isotropic, 1.0, even).unwrap()
        };
        let built = |m: &Medium| timed.stage("layers", |p| build(&shape, &grid, m, Placement::Boundary, p));
        assert_eq!(built(&medium(1.0)).unwrap().1, 0);
        let dense = medium(8.0);
        let (layers, left_out) = built(&dense).unwrap();
        assert!(layers.len() > 2 && left_out > 0, "{} {left_out}", layers.len());
        // One just below them is dark everywhere, one a little above is not.
        let last = &layers[layers.len() - 1];
        let mut below = isosurface::extract(&grid, (last.offset + last.thickness) as f32);
        below.thickness = 0.01;
        let prepared = Prepared::new(&dense, &mesh);
        let light =
            timed.stage("density", |p| density::evaluate(&shape, &[below], &prepared, &params, p)).unwrap();
        assert!(!light.top[0].is_empty() && light.top[0].iter().all(|f| f64::from(*f) < DARK));
        let all =
            timed.stage("density", |p| density::evaluate(&shape, &layers, &prepared, &params, p)).unwrap();
        assert!(all.top[layers.len() - 3].iter().any(|f| f64::from(*f) > DARK));
    }
}
