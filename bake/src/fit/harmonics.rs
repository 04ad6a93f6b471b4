//! Spherical harmonics of the encoded optical depth, fitted to the transmittance itself, each sample with as few bands
//! as it needs.
//!
//! The stored function y(ω) = Σ c_k Y_k(ω) is decoded to ψ̂ = exp(-τ(y)) at run time, so the coefficients minimise
//! Σ_ω (ψ̂ - ψ)² (see [`super::least_squares`]); a plain projection minimises the error of y instead, which matters
//! most where no light comes from. Orders are tried upwards in steps of two until the error of ψ meets the target; each
//! starts from the coefficients of the one before or from a linear fit, whichever is nearer. What is kept is quantised ([`diaphane_formats::harmonics`]).

use super::depths::Lit;
use super::least_squares::{BATCH, Basis, Batch, coefficient_places};
use crate::Result;
use crate::params::Params;
use crate::progress::Stage;
use diaphane_formats::encoding::Encoding;
use diaphane_formats::harmonics::{Coefficients, Harmonics};
use glam::{DVec3, Vec3};
use half::f16;
use ndarray::Array2;
use rayon::prelude::*;

/// The light of all samples.
pub(crate) struct Light {
    pub depth: Harmonics,
    pub lobe: Vec<[f16; 3]>,
    pub boundary: Harmonics,
}

/// Gauss-Newton steps of an order that may turn out too low, and of the last.
const STEPS: [usize; 2] = [3, 8];
/// Lowest order that is tried.
const LEAST_ORDER: usize = 2;
/// Bands of the boundary's transmittance, which varies little where light gets through.
const BOUNDARY_ORDER: usize = 6;
/// Samples of one task.
const TASK: usize = 4 * BATCH;

/// Samples whose error exceeds the target by this factor go to the highest order at once.
const HOPELESS: f64 = 4.0;

/// One fitted sample.
#[derive(Default)]
struct Fitted {
    order: usize,
    coefficients: Vec<f32>,
    lobe: Vec3,
    /// Root mean square over directions.
    error: f32,
}

/// Bands of the boundary's transmittance at most `order`; 0 when index matched.
pub(crate) fn boundary_order(ior: f64, order: usize) -> usize {
    if ior == 1.0 { 0 } else { order.min(BOUNDARY_ORDER) }
}

pub(crate) fn harmonics(lit: &Lit, params: &Params, stage: Stage<'_>) -> Result<Light> {
    let n = lit.samples.len();
    let columns = lit.directions.len();
    stage.announce(n);
    let basis = Basis::new(&lit.directions, params.order.max(BOUNDARY_ORDER));
    let tasks: Vec<Vec<Fitted>> = lit
        .transmittance
        .par_chunks(TASK * columns)
        .map(|psi| {
            let fitted = fit(psi, lit, &basis, params);
            stage.step(fitted.len())?;
            Ok(fitted)
        })
        .collect::<Result<_>>()?;
    let mut depth = Coefficients::zeros(tasks.iter().flatten().map(|f| f.order as u8).collect());
    for (i, f) in tasks.iter().flatten().enumerate() {
        depth.of_mut(i).copy_from_slice(&f.coefficients);
    }
    let half = |v: Vec3| v.to_array().map(f16::from_f32);
    let lobe = if params.encoding.has_lobe() {
        tasks.iter().flatten().map(|f| half(f.lobe)).collect()
    } else {
        Vec::new()
    };
    Ok(Light { depth: depth.quantised(), lobe, boundary: boundary(lit, &basis, params) })
}

/// Orders that are tried, upwards.
fn ladder(highest: usize) -> Vec<usize> {
    let mut orders: Vec<usize> = (LEAST_ORDER..=highest).rev().step_by(2).collect();
    orders.reverse();
    if orders.is_empty() { vec![highest] } else { orders }
}

/// Fits the samples of one task; `psi` holds their transmittances, row-major [sample][direction].
fn fit(psi: &[f32], lit: &Lit, basis: &Basis, params: &Params) -> Vec<Fitted> {
    let columns = lit.directions.len();
    let mut out: Vec<Fitted> = (0..psi.len() / columns).map(|_| Fitted::default()).collect();
    let mut open: Vec<usize> = (0..out.len()).collect();
    let mut hopeless: Vec<usize> = Vec::new();
    let orders = ladder(params.order);
    for (k, order) in orders.iter().enumerate() {
        let last = k + 1 == orders.len();
        if last {
            open.append(&mut hopeless);
        }
        let mut still = Vec::new();
        for group in open.chunks(BATCH) {
            let rows = Array2::from_shape_fn((group.len(), columns), |(q, d)| psi[group[q] * columns + d]);
            let batch = Batch { basis: basis.bands(*order), lobe: None };
            let before: Vec<&Fitted> = group.iter().map(|i| &out[*i]).collect();
            let steps = STEPS[usize::from(last)];
            let fitted = fit_batch(&rows, &before, batch, &lit.directions, params.encoding, steps);
            for (i, fitted) in group.iter().zip(fitted) {
                let error = f64::from(fitted.error);
                if error > HOPELESS * params.light_error && !last {
                    hopeless.push(*i);
                } else if error > params.light_error {
                    still.push(*i);
                }
                out[*i] = fitted;
            }
        }
        open = still;
    }
    out
}

/// Fits one batch at the order of `batch`, from the coefficients of a lower one where there are any. A lobe that would
/// take light away is left out.
fn fit_batch(
    psi: &Array2<f32>,
    before: &[&Fitted],
    batch: Batch<'_>,
    directions: &[DVec3],
    encoding: Encoding,
    steps: usize,
) -> Vec<Fitted> {
    let n = batch.unknowns();
    let order = n.isqrt();
    let places = coefficient_places(order);
    let axes: Vec<Vec3> = if encoding.has_lobe() {
        (0..before.len()).map(|q| brightest(psi.row(q).iter(), directions)).collect()
    } else {
        Vec::new()
    };
    let lobe = Array2::from_shape_fn(if axes.is_empty() { (0, 0) } else { psi.dim() }, |(q, d)| {
        axes[q].dot(directions[d].as_vec3()).max(0.0)
    });
    let run = |batch: &Batch<'_>| {
        let mut x = batch.start(encoding, psi);
        if before.iter().any(|b| !b.coefficients.is_empty()) {
            let warm = Array2::from_shape_fn(x.dim(), |(q, k)| match k {
                k if k == n => before[q].lobe.length(),
                k => before[q].coefficients.get(places[k]).copied().unwrap_or(0.0),
            });
            batch.take_better(encoding, psi, &warm, &mut x);
        }
        let errors = batch.improve(encoding, psi, steps, &mut x);
        (x, errors)
    };
    let taken = |x: &Array2<f32>, errors: &[f32], q: usize, lobe: Vec3| Fitted {
        order,
        coefficients: in_order(&places, x.row(q).iter()),
        lobe,
        error: errors[q],
    };
    if axes.is_empty() {
        let (x, errors) = run(&batch);
        return (0..before.len()).map(|q| taken(&x, &errors, q, Vec3::ZERO)).collect();
    }
    let (with, errors) = run(&Batch { basis: batch.basis, lobe: Some(&lobe) });
    let plain = with.column(n).iter().any(|a| *a <= 0.0).then(|| run(&batch));
    (0..before.len())
        .map(|q| match &plain {
            Some((x, errors)) if with[[q, n]] <= 0.0 => taken(x, errors, q, Vec3::ZERO),
            _ => taken(&with, &errors, q, axes[q] * with[[q, n]]),
        })
        .collect()
}

/// Coefficients from unknowns whose places `places` tells; what follows them is left out.
fn in_order<'a>(places: &[usize], unknowns: impl Iterator<Item = &'a f32>) -> Vec<f32> {
    let mut out = vec![0.0; places.len()];
    places.iter().zip(unknowns).for_each(|(at, x)| out[*at] = *x);
    out
}

/// The direction of the first moment of ψ: towards the nearest surface, where that is near.
fn brightest<'a>(psi: impl Iterator<Item = &'a f32>, directions: &[DVec3]) -> Vec3 {
    psi.zip(directions).map(|(psi, d)| f64::from(*psi) * *d).sum::<DVec3>().normalize_or_zero().as_vec3()
}

/// Linear fit weighted by the transmittance of the medium: the boundary matters where light arrives.
fn boundary(lit: &Lit, basis: &Basis, params: &Params) -> Harmonics {
    if lit.boundary.is_empty() {
        return Harmonics::default();
    }
    let order = params.order.min(BOUNDARY_ORDER);
    let columns = lit.directions.len();
    let batch = Batch { basis: basis.bands(order), lobe: None };
    let places = coefficient_places(order);
    let rows: Vec<Vec<f32>> = lit
        .boundary
        .par_chunks(BATCH * columns)
        .zip(lit.transmittance.par_chunks(BATCH * columns))
        .map(|(through, psi)| {
            let shape = (through.len() / columns, columns);
            let weight = Array2::from_shape_fn(shape, |(q, d)| psi[q * columns + d] + 0.02);
            let right = Array2::from_shape_fn(shape, |(q, d)| through[q * columns + d] * weight[[q, d]]);
            let x = batch.linear(&weight, &right, &vec![1e-4; shape.0]);
            x.rows().into_iter().flat_map(|x| in_order(&places, x.iter())).collect()
        })
        .collect();
    let mut out = Coefficients::zeros(vec![order as u8; lit.samples.len()]);
    out.values = rows.concat();
    out.quantised()
}

#[cfg(test)]
mod tests {
    use super::ladder;

    #[test]
    fn orders_end_at_the_highest() {
        assert_eq!(ladder(1), [1]);
        assert_eq!(ladder(2), [2]);
        assert_eq!(ladder(7), [3, 5, 7]);
        assert_eq!(ladder(10), [2, 4, 6, 8, 10]);
    }
}
