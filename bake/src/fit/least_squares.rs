//! Fits of many functions on one set of directions at once: damped Gauss-Newton on the decoded transmittance, each
//! step solved by conjugate gradients, all sums over directions done as matrix products.
//!
//! For values y = B x (B: directions × coefficients) decoded to ψ̂(y) it minimises Σ_ω c (ψ̂ - ψ)², c being the importance
//! of the step before (iteratively reweighted least squares). A step solves
//! min |g (B d) - (ψ - ψ̂)|² + λ |d|² with g = dψ̂/dy. B has nearly orthogonal columns and g lies within 0..1, so four
//! iterations suffice and no normal matrix is ever formed.
//!
//! Directions come in opposite pairs, all first ones before all second ones, and Y_lm(-ω) = (-1)^l Y_lm(ω): with E and O
//! the parts of even and odd bands in the first half, y = E + O there and E - O opposite. Both products therefore take
//! half the multiplications. Unknowns are kept in that order: even bands, then odd ones.

use super::decoded::{Linear, SLOPE_RIGHT, butterfly, error, error_along, linearise, slopes, times_square};
use super::product::multiply;
use diaphane_formats::encoding::Encoding;
use diaphane_formats::sh::{coefficient_count, evaluate};
use glam::DVec3;
use ndarray::{Array2, ArrayView1, ArrayView2, ArrayViewMut1, Axis, Slice, Zip};

/// Functions fitted together: their values stay in the cache.
pub(super) const BATCH: usize = 32;

/// Iterations of a step, and of a linear problem that is solved once.
pub(super) const INNER: usize = 4;
pub(super) const ALONE: usize = 12;
const DAMPING: f32 = 1e-4;
const MOST_DAMPING: f32 = 1.0;
/// An improvement smaller than this fraction ends a fit.
const ENOUGH: f32 = 1e-2;

/// Harmonics in the first half of the directions, of even and of odd bands.
pub(super) struct Basis {
    /// Directions × coefficients.
    rows: [Array2<f32>; 2],
    /// Coefficients × directions.
    columns: [Array2<f32>; 2],
}

/// The first bands of a [`Basis`], laid out as there.
pub(super) struct Bands<'a> {
    rows: [ArrayView2<'a, f32>; 2],
    columns: [ArrayView2<'a, f32>; 2],
}

impl Basis {
    /// The basis of `order` bands in `directions`: opposite pairs, all first ones before all second ones.
    pub fn new(directions: &[DVec3], order: usize) -> Self {
        let half = directions.len() / 2;
        let mut rows = [0, 1].map(|parity| Array2::zeros((half, places(order, parity).count())));
        let mut row = vec![0.0; coefficient_count(order)];
        for (k, direction) in directions.iter().take(half).enumerate() {
            evaluate(order, direction.to_array(), &mut row);
            for (parity, out) in rows.iter_mut().enumerate() {
                out.row_mut(k).iter_mut().zip(places(order, parity)).for_each(|(o, at)| *o = row[at] as f32);
            }
        }
        let columns = rows.each_ref().map(|rows| rows.t().as_standard_layout().into_owned());
        Self { rows, columns }
    }

    /// Coefficients × directions of the first `order` bands, in the coefficients' order.
    pub fn columns(&self, order: usize) -> Array2<f32> {
        let mut out = Array2::zeros((coefficient_count(order), self.rows[0].nrows()));
        for (parity, basis) in self.columns.iter().enumerate() {
            places(order, parity).zip(basis.rows()).for_each(|(at, column)| out.row_mut(at).assign(&column));
        }
        out
    }

    /// The first `order` bands of it.
    pub fn bands(&self, order: usize) -> Bands<'_> {
        let first = |parity| Slice::from(..places(order, parity).count());
        Bands {
            rows: [0, 1].map(|p| self.rows[p].slice_axis(Axis(1), first(p))),
            columns: [0, 1].map(|p| self.columns[p].slice_axis(Axis(0), first(p))),
        }
    }
}

impl Bands<'_> {
    fn view(&self) -> Bands<'_> {
        Bands {
            rows: self.rows.each_ref().map(|part| part.view()),
            columns: self.columns.each_ref().map(|part| part.view()),
        }
    }
}

/// Indices of the coefficients of even (`parity` 0) or odd bands below `order`.
fn places(order: usize, parity: usize) -> impl Iterator<Item = usize> {
    (parity..order).step_by(2).flat_map(|l| l * l..(l + 1) * (l + 1))
}

/// Place of every unknown of `order` bands among the coefficients.
pub(super) fn coefficient_places(order: usize) -> Vec<usize> {
    places(order, 0).chain(places(order, 1)).collect()
}

/// Coefficients from unknowns whose places `places` tells; what follows them is left out.
pub(super) fn in_order<'a>(places: &[usize], unknowns: impl Iterator<Item = &'a f32>) -> Vec<f32> {
    let mut out = vec![0.0; places.len()];
    places.iter().zip(unknowns).for_each(|(at, x)| out[*at] = *x);
    out
}

/// What is fitted: rows are functions, columns directions.
pub(super) struct Batch<'a> {
    pub basis: Bands<'a>,
    /// One more basis function for each row.
    pub lobe: Option<&'a Array2<f32>>,
}

impl Batch<'_> {
    /// Coefficients of each row.
    fn harmonics(&self) -> usize {
        self.basis.rows.iter().map(ArrayView2::ncols).sum()
    }

    /// Unknowns of each row.
    pub fn unknowns(&self) -> usize {
        self.harmonics() + usize::from(self.lobe.is_some())
    }

    fn forward(&self, x: &Array2<f32>, y: &mut Array2<f32>) {
        let [even, odd] = &self.basis.columns;
        let n = self.harmonics();
        let (left, right) = y.view_mut().split_at(Axis(1), even.ncols());
        let part = |from: usize, to: usize| x.slice_axis(Axis(1), Slice::from(from..to));
        multiply(&part(0, even.nrows()), even, left);
        multiply(&part(even.nrows(), n), odd, right);
        y.rows_mut().into_iter().for_each(|row| butterfly(slice_mut(row)));
        if let Some(lobe) = self.lobe {
            for ((mut y, lobe), x) in y.rows_mut().into_iter().zip(lobe.rows()).zip(x.column(n)) {
                y.scaled_add(*x, &lobe);
            }
        }
    }

    /// The products of `y` with all basis functions; `y` is used up.
    fn backward(&self, y: &mut Array2<f32>, x: &mut Array2<f32>) {
        let [even, odd] = &self.basis.rows;
        let n = self.harmonics();
        if let Some(lobe) = self.lobe {
            for ((y, lobe), x) in y.rows().into_iter().zip(lobe.rows()).zip(x.column_mut(n)) {
                *x = y.dot(&lobe);
            }
        }
        y.rows_mut().into_iter().for_each(|row| butterfly(slice_mut(row)));
        let (left, right) = y.view().split_at(Axis(1), even.nrows());
        let mut part = |from: usize, to: usize, y: &ArrayView2<'_, f32>, basis: &ArrayView2<'_, f32>| {
            multiply(y, basis, x.slice_axis_mut(Axis(1), Slice::from(from..to)));
        };
        part(0, even.ncols(), &left, even);
        part(even.ncols(), n, &right, odd);
    }

    /// Minimises |weight (B x) - right|² + λ mean(weight²) |x|² for every row.
    pub fn linear(
        &self,
        weight: &Array2<f32>,
        right: &Array2<f32>,
        damping: &[f32],
        iterations: usize,
    ) -> Array2<f32> {
        let rows = weight.nrows();
        let shape = (rows, self.unknowns());
        let mut x = Array2::<f32>::zeros(shape);
        let mut gradient = Array2::<f32>::zeros(shape);
        let mut curved = Array2::<f32>::zeros(shape);
        let mut values = weight * right;
        self.backward(&mut values, &mut gradient);
        let mut step = gradient.clone();
        let square = |m: &Array2<f32>, q: usize| m.row(q).dot(&m.row(q));
        let ridge: Vec<f32> =
            (0..rows).map(|q| damping[q] * square(weight, q) / (4.0 * std::f32::consts::PI)).collect();
        let first: Vec<f32> = (0..rows).map(|q| square(&gradient, q)).collect();
        let mut size = first.clone();
        for _ in 0..iterations {
            self.forward(&step, &mut values);
            for (values, weight) in values.rows_mut().into_iter().zip(weight.rows()) {
                times_square(slice_mut(values), slice(weight));
            }
            self.backward(&mut values, &mut curved);
            let mut open = false;
            for q in 0..rows {
                curved.row_mut(q).scaled_add(ridge[q], &step.row(q));
                let curvature = step.row(q).dot(&curved.row(q));
                if !(curvature > 1e-30) || size[q] < 1e-6 * first[q] {
                    continue;
                }
                open = true;
                let length = size[q] / curvature;
                x.row_mut(q).scaled_add(length, &step.row(q));
                gradient.row_mut(q).scaled_add(-length, &curved.row(q));
                let next = square(&gradient, q);
                let turn = next / size[q];
                size[q] = next;
                Zip::from(step.row_mut(q)).and(gradient.row(q)).for_each(|p, g| *p = g + turn * *p);
            }
            if !open {
                break;
            }
        }
        x
    }

    /// A start whose weights are the slopes dψ/dy at the exact values.
    pub fn start(&self, encoding: Encoding, psi: &Array2<f32>) -> Array2<f32> {
        let value = psi.mapv(|psi| encoded(encoding, psi));
        let mut weight = value.clone();
        for mut row in weight.rows_mut() {
            row.as_slice_mut().into_iter().for_each(|y| slopes(encoding, y));
        }
        weight += SLOPE_RIGHT;
        let right = &weight * &value;
        self.linear(&weight, &right, &vec![DAMPING; psi.nrows()], INNER)
    }

    /// Improves `x` in at most `steps` steps; returns each row's root mean square error of ψ, weighted by the
    /// importance. Rows that are done make room for others, so that the products stay full.
    pub fn improve(
        &self,
        encoding: Encoding,
        psi: &Array2<f32>,
        steps: usize,
        x: &mut Array2<f32>,
    ) -> Vec<f32> {
        let (rows, columns) = psi.dim();
        let mut y = Array2::<f32>::zeros(psi.dim());
        self.forward(x, &mut y);
        let mut damping = vec![DAMPING; rows];
        let mut left = vec![steps; rows];
        let mut waiting = 0..rows;
        let mut open: Vec<usize> = Vec::new();
        loop {
            open.retain(|q| left[*q] > 0);
            open.extend(waiting.by_ref().take(BATCH - open.len()).filter(|_| steps > 0));
            if open.is_empty() {
                break;
            }
            let mut weight = Array2::<f32>::zeros((open.len(), columns));
            let (mut right, mut counts, mut moved) = (weight.clone(), weight.clone(), weight.clone());
            for (k, &q) in open.iter().enumerate() {
                let out = Linear {
                    weight: slice_mut(weight.row_mut(k)),
                    right: slice_mut(right.row_mut(k)),
                    counts: slice_mut(counts.row_mut(k)),
                };
                linearise(encoding, slice(y.row(q)), slice(psi.row(q)), out);
            }
            let lobe = self.lobe.map(|lobe| lobe.select(Axis(0), &open));
            let part = Batch { basis: self.basis.view(), lobe: lobe.as_ref() };
            let damped: Vec<f32> = open.iter().map(|q| damping[*q]).collect();
            let step = part.linear(&weight, &right, &damped, INNER);
            part.forward(&step, &mut moved);
            for (k, &q) in open.iter().enumerate() {
                let now = right.row(k).dot(&right.row(k));
                let rows = [slice(y.row(q)), slice(moved.row(k))];
                let along = |length: f32| {
                    error_along(encoding, rows, length, slice(psi.row(q)), slice(counts.row(k)))
                };
                let found = [1.0, 0.4, 0.16].into_iter().map(|l| (l, along(l))).find(|(_, e)| *e < now);
                let done = if let Some((length, error)) = found {
                    x.row_mut(q).scaled_add(length, &step.row(k));
                    y.row_mut(q).scaled_add(length, &moved.row(k));
                    damping[q] = (damping[q] * 0.3).max(DAMPING);
                    error > now * (1.0 - ENOUGH)
                } else {
                    damping[q] *= 30.0;
                    damping[q] > 30.0 * MOST_DAMPING
                };
                left[q] = if done { 0 } else { left[q] - 1 };
            }
        }
        let error = |q: usize| error(encoding, slice(y.row(q)), slice(psi.row(q)));
        (0..rows).map(|q| (error(q) / columns as f32).sqrt()).collect()
    }
}

/// A row of a matrix in standard layout.
fn slice<'a>(row: ArrayView1<'a, f32>) -> &'a [f32] {
    row.to_slice().unwrap_or(&[])
}

/// As above, to be written.
fn slice_mut<'a>(row: ArrayViewMut1<'a, f32>) -> &'a mut [f32] {
    row.into_slice().unwrap_or(&mut [])
}

/// The stored value of ψ; depths beyond sight are all the same.
fn encoded(encoding: Encoding, psi: f32) -> f32 {
    encoding.encode(-f64::from(psi.max(1e-5)).ln()) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::directions::even_directions;

    fn directions(count: usize) -> Vec<DVec3> {
        let pairs = even_directions(count, 5);
        pairs.iter().step_by(2).chain(pairs.iter().skip(1).step_by(2)).copied().collect()
    }

    #[test]
    fn products_by_parity_are_the_plain_ones() {
        let directions = directions(40);
        let basis = Basis::new(&directions, 7);
        for order in [1, 2, 5, 6] {
            let batch = Batch { basis: basis.bands(order), lobe: None };
            let x = Array2::from_shape_fn((3, order * order), |(q, k)| ((7 * q + 3 * k) as f32).sin());
            let mut y = Array2::zeros((3, 40));
            batch.forward(&x, &mut y);
            let places = coefficient_places(order);
            let mut row = vec![0.0; order * order];
            let mut back = Array2::<f64>::zeros(x.dim());
            for (d, direction) in directions.iter().enumerate() {
                evaluate(order, direction.to_array(), &mut row);
                for q in 0..3 {
                    let plain: f64 =
                        places.iter().zip(x.row(q)).map(|(at, x)| row[*at] * f64::from(*x)).sum();
                    assert!((f64::from(y[[q, d]]) - plain).abs() < 1e-5);
                    places.iter().enumerate().for_each(|(k, at)| back[[q, k]] += row[*at] * plain);
                }
            }
            let mut x = x;
            batch.backward(&mut y, &mut x);
            assert!(x.iter().zip(&back).all(|(a, b)| (f64::from(*a) - b).abs() < 1e-4), "{order}");
        }
    }

    #[test]
    fn functions_within_the_basis_are_found() {
        let basis = Basis::new(&directions(200), 5);
        let batch = Batch { basis: basis.bands(5), lobe: None };
        for encoding in [Encoding::RECIPROCAL, Encoding::Depth, Encoding::Transmittance] {
            let truth = Array2::from_shape_fn((7, 25), |(q, k)| {
                let wave = ((q * 31 + k * 17) as f32).sin();
                let mean = if encoding == Encoding::Transmittance { 1.6 } else { 5.0 };
                if k == 0 { mean } else { 0.15 * mean * wave / (1.0 + (k as f32).sqrt()) }
            });
            let mut y = Array2::zeros((7, 200));
            batch.forward(&truth, &mut y);
            let psi = y.mapv(|y| (-encoding.decode(y)).exp());
            let mut x = batch.start(encoding, &psi);
            let errors = batch.improve(encoding, &psi, 12, &mut x);
            assert!(errors.iter().all(|e| *e < 2e-3), "{encoding:?} {errors:?}");
        }
    }

    #[test]
    fn conjugate_gradients_agree_with_the_normal_equations() {
        let basis = Basis::new(&directions(60), 2);
        let batch = Batch { basis: basis.bands(2), lobe: None };
        let weight = Array2::from_shape_fn((1, 60), |(_, d)| 0.5 + 0.4 * (d as f32).sin());
        let right = Array2::from_shape_fn((1, 60), |(_, d)| (3.0 * d as f32).cos());
        let x = batch.linear(&weight, &right, &[0.0], INNER);
        // Four unknowns, fewer than iterations: the gradient of the least squares vanishes at their minimum.
        let mut values = Array2::zeros((1, 60));
        batch.forward(&x, &mut values);
        let mut residual = &weight * &(&weight * &values - &right);
        let mut gradient = Array2::zeros((1, 4));
        batch.backward(&mut residual, &mut gradient);
        assert!(gradient.iter().all(|g| g.abs() < 1e-3), "{gradient:?}");
    }
}
