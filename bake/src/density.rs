//! Sample density on the layers from the divergence of the first moment (thesis section 3.2.3).
//!
//! With T(x) = ∫ψ ω dω and ω·∇τ = -κt the divergence needs no differences: ∇·T = κt Φ (the identity is tested against
//! finite differences). Every layer vertex is evaluated twice, at the top and at the bottom of the slab beneath it, so
//! that any point between can be interpolated.

use crate::field::Shape;
use crate::layers::Layer;
use crate::params::{DENSITY_DIRECTIONS, Params};
use crate::progress::Stage;
use crate::{Prepared, Result, visibility};
use diaphane_formats::directions::{even_directions, hash};
use glam::DVec3;
use rayon::prelude::*;

/// Fluence over 4π at the vertices of each layer: top and bottom of the slab.
pub(crate) struct LayerFluence {
    pub top: Vec<Vec<f32>>,
    pub bottom: Vec<Vec<f32>>,
}

pub(crate) fn evaluate(
    shape: &Shape<'_>,
    layers: &[Layer],
    medium: &Prepared<'_>,
    params: &Params,
    stage: Stage<'_>,
) -> Result<LayerFluence> {
    let mut points = Vec::new();
    for layer in layers {
        for (p, n) in layer.positions.iter().zip(&layer.inward) {
            points.push(*p);
            points.push(*p + *n * layer.thickness);
        }
    }
    let values = fluence(shape, medium, &points, params, hash(params.seed, 11), stage)?;
    let mut next = values.chunks_exact(2);
    let (mut top, mut bottom) = (Vec::new(), Vec::new());
    for layer in layers {
        let pairs: Vec<&[f32]> = next.by_ref().take(layer.positions.len()).collect();
        top.push(pairs.iter().map(|v| v[0]).collect());
        bottom.push(pairs.iter().map(|v| v[1]).collect());
    }
    Ok(LayerFluence { top, bottom })
}

/// Φ/4π at `points` at the reference extinction. Points outside see the depth of
/// what lies in front of them, which is what a sample near them would see.
fn fluence(
    shape: &Shape<'_>,
    medium: &Prepared<'_>,
    points: &[DVec3],
    params: &Params,
    seed: u64,
    stage: Stage<'_>,
) -> Result<Vec<f32>> {
    let kappa = medium.medium.reference_extinction() as f32;
    let count = DENSITY_DIRECTIONS.min(params.directions).next_multiple_of(2);
    let axes: Vec<DVec3> = even_directions(count, seed).into_iter().step_by(2).collect();
    stage.announce(axes.len());
    let mut sum = vec![0.0f32; points.len()];
    // A few directions at a time keep memory small; the order of the sums is fixed.
    for group in axes.chunks(8) {
        let rows: Vec<_> = group
            .par_iter()
            .map(|axis| {
                let rows = visibility::depths(shape, medium, shape.visibility, points, *axis);
                stage.step(1)?;
                Ok(rows)
            })
            .collect::<Result<_>>()?;
        sum.par_iter_mut().enumerate().for_each(|(i, s)| {
            for row in &rows {
                let through = |side: usize| row.boundary[side].get(i).copied().unwrap_or(1.0);
                *s += (-kappa * row.forward[i]).exp() * through(0)
                    + (-kappa * row.backward[i]).exp() * through(1);
            }
        });
    }
    for s in &mut sum {
        *s /= (2 * axes.len()) as f32;
    }
    Ok(sum)
}
