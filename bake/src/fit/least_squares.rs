//! Fits of many functions on one set of directions at once: damped Gauss-Newton on the decoded transmittance, each
//! step solved by conjugate gradients, all sums over directions done as matrix products.
//!
//! For values y = B x (B: directions × coefficients) decoded to ψ̂(y) it minimises Σ_ω (ψ̂ - ψ)². A step solves
//! min |g (B d) - (ψ - ψ̂)|² + λ |d|² with g = dψ̂/dy. B has nearly orthogonal columns and g lies within 0..1, so ten
//! iterations suffice and no normal matrix is ever formed: products of 32 functions with B cost a fifth of that.

use diaphane_formats::encoding::Encoding;
use ndarray::linalg::general_mat_mul;
use ndarray::{Array2, ArrayView2, Axis, Slice, Zip};

/// Functions fitted together: their values stay in the cache.
pub(super) const BATCH: usize = 32;

const INNER: usize = 10;
const DAMPING: f32 = 1e-4;
const MOST_DAMPING: f32 = 1.0;
/// Least |g| where ψ̂ is clamped: small where it is right, larger where a wrong value must be able to move.
const SLOPE_RIGHT: f32 = 0.02;
const SLOPE_WRONG: f32 = 0.15;
/// An improvement smaller than this fraction ends a fit.
const ENOUGH: f32 = 2e-3;

/// What is fitted: rows are functions, columns directions.
pub(super) struct Batch<'a> {
    /// Basis values, directions × coefficients.
    pub basis: ArrayView2<'a, f32>,
    /// One more basis function for each row.
    pub lobe: Option<&'a Array2<f32>>,
}

impl Batch<'_> {
    /// Unknowns of each row.
    pub fn unknowns(&self) -> usize {
        self.basis.ncols() + usize::from(self.lobe.is_some())
    }

    fn forward(&self, x: &Array2<f32>, y: &mut Array2<f32>) {
        let n = self.basis.ncols();
        general_mat_mul(1.0, &x.slice_axis(Axis(1), Slice::from(..n)), &self.basis.t(), 0.0, y);
        if let Some(lobe) = self.lobe {
            for ((mut y, lobe), x) in y.rows_mut().into_iter().zip(lobe.rows()).zip(x.column(n)) {
                y.scaled_add(*x, &lobe);
            }
        }
    }

    fn backward(&self, y: &Array2<f32>, x: &mut Array2<f32>) {
        let n = self.basis.ncols();
        general_mat_mul(1.0, y, &self.basis, 0.0, &mut x.slice_axis_mut(Axis(1), Slice::from(..n)));
        if let Some(lobe) = self.lobe {
            for ((y, lobe), x) in y.rows().into_iter().zip(lobe.rows()).zip(x.column_mut(n)) {
                *x = y.dot(&lobe);
            }
        }
    }

    /// Minimises |weight (B x) - right|² + λ mean(weight²) |x|² for every row.
    pub fn linear(&self, weight: &Array2<f32>, right: &Array2<f32>, damping: &[f32]) -> Array2<f32> {
        let rows = weight.nrows();
        let shape = (rows, self.unknowns());
        let mut x = Array2::<f32>::zeros(shape);
        let mut gradient = Array2::<f32>::zeros(shape);
        let mut curved = Array2::<f32>::zeros(shape);
        let mut values = weight * right;
        self.backward(&values, &mut gradient);
        let mut step = gradient.clone();
        let square = |m: &Array2<f32>, q: usize| m.row(q).dot(&m.row(q));
        let ridge: Vec<f32> =
            (0..rows).map(|q| damping[q] * square(weight, q) / (4.0 * std::f32::consts::PI)).collect();
        let first: Vec<f32> = (0..rows).map(|q| square(&gradient, q)).collect();
        let mut size = first.clone();
        for _ in 0..INNER {
            self.forward(&step, &mut values);
            Zip::from(&mut values).and(weight).for_each(|v, w| *v *= w * w);
            self.backward(&values, &mut curved);
            for q in 0..rows {
                curved.row_mut(q).scaled_add(ridge[q], &step.row(q));
                let curvature = step.row(q).dot(&curved.row(q));
                if !(curvature > 1e-30) || size[q] < 1e-8 * first[q] {
                    continue;
                }
                let length = size[q] / curvature;
                x.row_mut(q).scaled_add(length, &step.row(q));
                gradient.row_mut(q).scaled_add(-length, &curved.row(q));
                let next = square(&gradient, q);
                let turn = next / size[q];
                size[q] = next;
                Zip::from(step.row_mut(q)).and(gradient.row(q)).for_each(|p, g| *p = g + turn * *p);
            }
        }
        x
    }

    /// A start whose weights are the slopes dψ/dy at the exact values.
    pub fn start(&self, encoding: Encoding, psi: &Array2<f32>) -> Array2<f32> {
        let value = psi.mapv(|psi| encoded(encoding, psi));
        let weight = value.mapv(|y| decoded(encoding, y).1.abs() + SLOPE_RIGHT);
        let right = &weight * &value;
        self.linear(&weight, &right, &vec![DAMPING; psi.nrows()])
    }

    /// Takes the rows of `other` that come closer to ψ than those of `x`.
    pub fn take_better(
        &self,
        encoding: Encoding,
        psi: &Array2<f32>,
        other: &Array2<f32>,
        x: &mut Array2<f32>,
    ) {
        let errors = |x: &Array2<f32>| {
            let mut y = Array2::<f32>::zeros(psi.dim());
            self.forward(x, &mut y);
            errors(encoding, psi, &y)
        };
        let (own, theirs) = (errors(x), errors(other));
        for (q, (own, theirs)) in own.into_iter().zip(theirs).enumerate() {
            if theirs < own {
                x.row_mut(q).assign(&other.row(q));
            }
        }
    }

    /// Improves `x` in at most `steps` steps; returns each row's root mean square error of ψ.
    pub fn improve(
        &self,
        encoding: Encoding,
        psi: &Array2<f32>,
        steps: usize,
        x: &mut Array2<f32>,
    ) -> Vec<f32> {
        let (rows, columns) = psi.dim();
        let mut y = Array2::<f32>::zeros(psi.dim());
        let mut moved = y.clone();
        let (mut weight, mut right) = (y.clone(), y.clone());
        self.forward(x, &mut y);
        let mut least = errors(encoding, psi, &y);
        let mut damping = vec![DAMPING; rows];
        let mut done = vec![false; rows];
        for _ in 0..steps {
            if done.iter().all(|d| *d) {
                break;
            }
            Zip::from(&mut weight).and(&mut right).and(&y).and(psi).for_each(|w, r, y, psi| {
                let (value, slope) = decoded(encoding, *y);
                let residual = psi - value;
                let floor = if residual.abs() > 1e-3 { SLOPE_WRONG } else { SLOPE_RIGHT };
                // τ is the one encoding in which ψ falls.
                *w = if encoding == Encoding::Depth { slope.min(-floor) } else { slope.max(floor) };
                *r = residual;
            });
            let step = self.linear(&weight, &right, &damping);
            self.forward(&step, &mut moved);
            for q in 0..rows {
                if done[q] {
                    continue;
                }
                let mut length = 1.0;
                let found = (0..3).any(|_| {
                    let values = y.row(q).into_iter().zip(moved.row(q)).map(|(y, d)| y + length * d);
                    let trial = error(encoding, psi.row(q).iter().copied().zip(values));
                    if trial >= least[q] {
                        length *= 0.4;
                        return false;
                    }
                    done[q] = trial > least[q] * (1.0 - ENOUGH);
                    least[q] = trial;
                    true
                });
                if found {
                    x.row_mut(q).scaled_add(length, &step.row(q));
                    y.row_mut(q).scaled_add(length, &moved.row(q));
                    damping[q] = (damping[q] * 0.3).max(DAMPING);
                } else {
                    done[q] = damping[q] > MOST_DAMPING;
                    damping[q] *= 30.0;
                }
            }
        }
        least.iter().map(|e| (e / columns as f32).sqrt()).collect()
    }
}

/// Squared error of every row.
fn errors(encoding: Encoding, psi: &Array2<f32>, y: &Array2<f32>) -> Vec<f32> {
    let pairs = |q: usize| psi.row(q).into_iter().copied().zip(y.row(q).into_iter().copied());
    (0..psi.nrows()).map(|q| error(encoding, pairs(q))).collect()
}

fn error(encoding: Encoding, pairs: impl Iterator<Item = (f32, f32)>) -> f32 {
    pairs.map(|(psi, y)| (decoded(encoding, y).0 - psi).powi(2)).sum()
}

/// The stored value of ψ; depths beyond sight are all the same.
fn encoded(encoding: Encoding, psi: f32) -> f32 {
    encoding.encode(-f64::from(psi.max(1e-5)).ln()) as f32
}

/// ψ̂ and dψ̂/dy; the slope is 0 where ψ̂ is clamped.
fn decoded(encoding: Encoding, y: f32) -> (f32, f32) {
    match encoding {
        Encoding::Transmittance => (y.clamp(0.0, 1.0), 1.0),
        Encoding::Depth => {
            if y <= 0.0 {
                return (1.0, 0.0);
            }
            let psi = (-y).exp();
            (psi, -psi)
        }
        Encoding::Reciprocal { epsilon } | Encoding::Lobe { epsilon } => {
            if y <= 0.0 {
                return (0.0, 0.0);
            }
            let psi = (epsilon - 1.0 / y).exp();
            if psi >= 1.0 { (1.0, 0.0) } else { (psi, psi / (y * y)) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::directions::even_directions;
    use diaphane_formats::sh::evaluate;

    fn basis(order: usize, count: usize) -> Array2<f32> {
        let directions = even_directions(count, 5);
        let mut out = Array2::zeros((count, order * order));
        let mut row = vec![0.0; order * order];
        for (d, mut out) in directions.iter().zip(out.rows_mut()) {
            evaluate(order, d.to_array(), &mut row);
            out.iter_mut().zip(&row).for_each(|(o, r)| *o = *r as f32);
        }
        out
    }

    #[test]
    fn functions_within_the_basis_are_found() {
        let basis = basis(5, 200);
        let batch = Batch { basis: basis.view(), lobe: None };
        for encoding in [Encoding::RECIPROCAL, Encoding::Depth, Encoding::Transmittance] {
            let truth = Array2::from_shape_fn((7, 25), |(q, k)| {
                let wave = ((q * 31 + k * 17) as f32).sin();
                let mean = if encoding == Encoding::Transmittance { 1.6 } else { 5.0 };
                if k == 0 { mean } else { 0.15 * mean * wave / (1.0 + (k as f32).sqrt()) }
            });
            let mut y = Array2::zeros((7, 200));
            batch.forward(&truth, &mut y);
            let psi = y.mapv(|y| decoded(encoding, y).0);
            let mut x = batch.start(encoding, &psi);
            let errors = batch.improve(encoding, &psi, 12, &mut x);
            assert!(errors.iter().all(|e| *e < 2e-3), "{encoding:?} {errors:?}");
        }
    }

    #[test]
    fn conjugate_gradients_agree_with_the_normal_equations() {
        let basis = basis(3, 60);
        let batch = Batch { basis: basis.view(), lobe: None };
        let weight = Array2::from_shape_fn((1, 60), |(_, d)| 0.5 + 0.4 * (d as f32).sin());
        let right = Array2::from_shape_fn((1, 60), |(_, d)| (3.0 * d as f32).cos());
        let x = batch.linear(&weight, &right, &[0.0]);
        // The gradient of the least squares vanishes at their minimum.
        let mut values = Array2::zeros((1, 60));
        batch.forward(&x, &mut values);
        let residual = &weight * &(&weight * &values - &right);
        let mut gradient = Array2::zeros((1, 9));
        batch.backward(&residual, &mut gradient);
        assert!(gradient.iter().all(|g| g.abs() < 1e-3), "{gradient:?}");
    }
}
