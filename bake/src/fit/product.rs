//! Products of small matrices whose second factor stays in the first cache as it is: nothing is packed. (Packing took a
//! quarter of a fit's time.)

use ndarray::{ArrayView2, ArrayViewMut2};
use pulp::{Arch, Simd, WithSimd};

/// Rows of the result that are summed together: with two vectors of each as many sums as keep two multipliers busy.
const ROWS: usize = 4;

/// `out` = `left` `right`. The rows of all three lie in memory as they are.
///
/// # Panics
/// If the shapes do not fit.
pub(super) fn multiply(
    left: &ArrayView2<'_, f32>,
    right: &ArrayView2<'_, f32>,
    mut out: ArrayViewMut2<'_, f32>,
) {
    let ((rows, inner), columns) = (left.dim(), right.ncols());
    assert_eq!((inner, (rows, columns)), (right.nrows(), out.dim()), "shapes of a product");
    let left = left.rows().into_iter().map(|row| row.to_slice().unwrap_or(&[])).collect();
    let right = right.rows().into_iter().map(|row| row.to_slice().unwrap_or(&[])).collect();
    let out = out.rows_mut().into_iter().map(|row| row.into_slice().unwrap_or(&mut [])).collect();
    Arch::new().dispatch(Product { left, right, out });
}

struct Product<'a> {
    left: Vec<&'a [f32]>,
    right: Vec<&'a [f32]>,
    out: Vec<&'a mut [f32]>,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { left, right, mut out } = self;
        let (left, out) = (left.as_chunks::<ROWS>(), out.as_chunks_mut::<ROWS>());
        for (left, out) in left.0.iter().zip(out.0) {
            rows(simd, left, &right, out);
        }
        for (left, out) in left.1.chunks(1).zip(out.1.chunks_mut(1)) {
            if let (Ok(left), Ok(out)) = (left.try_into(), out.try_into()) {
                rows::<S, 1>(simd, left, &right, out);
            }
        }
    }
}

/// A few rows of the result.
#[inline(always)]
fn rows<S: Simd, const R: usize>(simd: S, left: &[&[f32]; R], right: &[&[f32]], out: &mut [&mut [f32]; R]) {
    let (columns, lanes) = (out[0].len(), S::F32_LANES);
    let left = left.map(|row| &row[..right.len()]);
    if columns < lanes {
        let mut sums = [simd.splat_f32s(0.0); R];
        for (k, right) in right.iter().enumerate() {
            let right = simd.partial_load_f32s(right);
            for (sum, left) in sums.iter_mut().zip(left) {
                *sum = simd.mul_add_e_f32s(simd.splat_f32s(left[k]), right, *sum);
            }
        }
        out.iter_mut().zip(sums).for_each(|(out, sum)| simd.partial_store_f32s(out, sum));
        return;
    }
    // The last vector ends where the columns do and overlaps the one before.
    let at = |from: usize| from.min(columns - lanes);
    for from in (0..columns).step_by(2 * lanes) {
        if from + lanes < columns {
            block(simd, &left, right, out, [at(from), at(from + lanes)]);
        } else {
            block(simd, &left, right, out, [at(from)]);
        }
    }
}

/// Vectors of a few rows of the result, which begin at the columns `from`.
#[inline(always)]
fn block<S: Simd, const R: usize, const V: usize>(
    simd: S,
    left: &[&[f32]; R],
    right: &[&[f32]],
    out: &mut [&mut [f32]; R],
    from: [usize; V],
) {
    let mut sums = [[simd.splat_f32s(0.0); V]; R];
    for (k, right) in right.iter().enumerate() {
        let right = from.map(|from| S::as_simd_f32s(&right[from..from + S::F32_LANES]).0[0]);
        for (sums, left) in sums.iter_mut().zip(left) {
            let left = simd.splat_f32s(left[k]);
            for (sum, right) in sums.iter_mut().zip(right) {
                *sum = simd.mul_add_e_f32s(left, right, *sum);
            }
        }
    }
    for (out, sums) in out.iter_mut().zip(sums) {
        for (from, sum) in from.into_iter().zip(sums) {
            S::as_mut_simd_f32s(&mut out[from..from + S::F32_LANES]).0[0] = sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Axis, Slice};

    #[test]
    fn all_shapes_and_parts_of_larger_matrices() {
        let matrix = |rows, columns, seed: usize| {
            Array2::from_shape_fn((rows, columns), |(i, j)| ((i * 31 + j * 7 + seed) as f32).sin())
        };
        for (m, k, n) in [(1, 1, 1), (4, 3, 32), (5, 7, 33), (9, 16, 50), (32, 28, 43), (7, 0, 20)] {
            let (a, b, mut c) =
                (matrix(m, k + 5, 1), matrix(k, n + 3, 2), Array2::from_elem((m, n + 4), 9.0));
            let within = |from: usize, to: usize| Slice::from(from..to);
            let (a, b) = (a.slice_axis(Axis(1), within(2, 2 + k)), b.slice_axis(Axis(1), within(3, 3 + n)));
            multiply(&a, &b, c.slice_axis_mut(Axis(1), within(1, 1 + n)));
            for ((i, j), c) in c.indexed_iter() {
                let inside = (1..=n).contains(&j);
                let exact = if inside { (0..k).map(|q| a[[i, q]] * b[[q, j - 1]]).sum() } else { 9.0f32 };
                assert!((c - exact).abs() < 1e-4, "{m} {k} {n} at {i} {j}: {c} {exact}");
            }
        }
    }
}
