//! Spherical harmonics of the boundary's Fresnel transmittance, where the boundary is not index matched.

use super::depths::{Lit, ONE};
use super::least_squares::{ALONE, BATCH, Basis, Batch, coefficient_places, in_order};
use crate::params::Params;
use ndarray::Array2;
use rayon::prelude::*;

/// Bands of the boundary's transmittance, which varies little where light gets through.
pub(super) const BOUNDARY_ORDER: usize = 6;

/// Bands of the boundary's transmittance at most `order`; 0 when index matched.
pub(crate) fn boundary_order(ior: f64, order: usize) -> usize {
    if ior == 1.0 { 0 } else { order.min(BOUNDARY_ORDER) }
}

/// Coefficients of a block's samples by a linear fit, weighted by the transmittance of the medium: the boundary matters
/// where light arrives. All samples have [`boundary_order`] bands.
pub(super) fn boundary(lit: &Lit, basis: &Basis, params: &Params, columns: usize) -> Vec<f32> {
    if lit.boundary.is_empty() {
        return Vec::new();
    }
    let order = params.order.min(BOUNDARY_ORDER);
    let batch = Batch { basis: basis.bands(order), lobe: None };
    let places = coefficient_places(order);
    let value = |v: u16| f32::from(v) / ONE;
    let rows: Vec<Vec<f32>> = lit
        .boundary
        .par_chunks(BATCH * columns)
        .zip(lit.transmittance.par_chunks(BATCH * columns))
        .map(|(through, psi)| {
            let shape = (through.len() / columns, columns);
            let weight = Array2::from_shape_fn(shape, |(q, d)| value(psi[q * columns + d]) + 0.02);
            let right =
                Array2::from_shape_fn(shape, |(q, d)| value(through[q * columns + d]) * weight[[q, d]]);
            let x = batch.linear(&weight, &right, &vec![1e-4; shape.0], ALONE);
            x.rows().into_iter().flat_map(|x| in_order(&places, x.iter())).collect()
        })
        .collect();
    rows.concat()
}
