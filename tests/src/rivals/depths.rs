//! Transmittance of points in every direction, as the bake computes it: by projecting the mesh along each direction.

use super::object::Object;
use diaphane_formats::directions::even_directions;
use diaphane_formats::visibility::{DepthRows, project_with};
use glam::DVec3;
use rayon::prelude::*;

/// Seed of the directions' rotation.
const SEED: u64 = 31;

/// ψ β of a set of points: transmittance at the reference extinction times the boundary's Fresnel transmittance.
pub struct Transmittances {
    /// Unit vectors, even over the sphere.
    pub directions: Vec<DVec3>,
    /// Row-major [point][direction], 0..1.
    pub values: Vec<f32>,
}

/// Computes ψ β of `points` (world space) in `count` directions.
pub fn transmittances(object: &Object<'_>, points: &[DVec3], count: usize) -> Transmittances {
    let directions = even_directions(count, SEED);
    let rows: Vec<DepthRows> = directions
        .par_chunks(2)
        .with_max_len(1)
        .map(|pair| project_with(object.mesh, object.medium, object.sampled.as_ref(), points, pair[0]))
        .collect();
    let kappa = object.medium.reference_extinction() as f32;
    let mut values = vec![0.0; points.len() * directions.len()];
    values.par_chunks_mut(directions.len().max(1)).enumerate().for_each(|(i, out)| {
        for (k, value) in out.iter_mut().enumerate() {
            let (row, side) = (&rows[k / 2], k % 2);
            let lengths = if side == 0 { &row.forward } else { &row.backward };
            let boundary = row.boundary[side].get(i).copied().unwrap_or(1.0);
            *value = (-kappa * lengths[i]).exp() * boundary;
        }
    });
    Transmittances { directions, values }
}
