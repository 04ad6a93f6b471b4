//! Codes of the coefficients by what light sees of their error.
//!
//! Rounding every coefficient by itself spreads its error evenly over all directions, though ψ does not feel it where it
//! is near 0 or 1. Here the codes minimise Σ_ω s (B (q - x))², s being [`sensitivity`], x being the fit: one coefficient after the other,
//! highest band first, is set to the code nearest to what is best given all others; those not yet rounded make up for the
//! error of those that are (the error feedback of Hassibi and Stork 1993, by coordinate descent instead of an inverse).
//! Measured at equal bytes on the bird at extinction 64 per diagonal, lit from behind: error 0.190 before, 0.173 so.

use super::least_squares::{Basis, sensitivity};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::harmonics::CodeBook;
use ndarray::Array2;

/// Times that all coefficients are gone through.
const SWEEPS: usize = 3;

/// The basis by columns: row k of `columns` is coefficient k in the first half of the directions.
pub(super) struct Rounding {
    columns: Array2<f32>,
    bands: Vec<usize>,
    encoding: Encoding,
}

impl Rounding {
    pub fn new(basis: &Basis, order: usize, encoding: Encoding) -> Self {
        let bands = (0..order).flat_map(|l| std::iter::repeat_n(l, 2 * l + 1)).collect();
        Self { columns: basis.columns(order), bands, encoding }
    }

    /// Changes `codes` for the better; `lobe` (0 or positive) is what the sample has beside its harmonics, in all
    /// directions: the first half, then their opposites.
    pub fn choose(&self, x: &[f32], lobe: impl Fn(usize) -> f32, book: &CodeBook<'_>, codes: &mut [i32]) {
        let half = self.columns.ncols();
        let column = |k: usize| self.columns.row(k).to_slice().unwrap_or(&[]);
        let mut y: Vec<f32> = (0..2 * half).map(lobe).collect();
        let (left, right) = y.split_at_mut(half);
        for (k, x) in x.iter().enumerate() {
            let opposite = if self.bands[k].is_multiple_of(2) { *x } else { -*x };
            left.iter_mut().zip(column(k)).for_each(|(y, b)| *y += x * b);
            right.iter_mut().zip(column(k)).for_each(|(y, b)| *y += opposite * b);
        }
        let weight = |y: f32| sensitivity(self.encoding, y);
        // Sums and differences over opposite directions: of the weights, and of weight times error.
        let pairs = || left.iter().zip(&*right);
        let sum: Vec<f32> = pairs().map(|(a, b)| weight(*a) + weight(*b)).collect();
        let difference: Vec<f32> = pairs().map(|(a, b)| weight(*a) - weight(*b)).collect();
        let mut even = vec![0.0f32; half];
        let mut odd = vec![0.0f32; half];
        let mut now = x.to_vec();
        for _ in 0..SWEEPS {
            let mut changed = false;
            for k in (0..x.len()).rev() {
                let (band, b) = (self.bands[k], column(k));
                let (own, other) = if band.is_multiple_of(2) { (&mut even, &mut odd) } else { (&mut odd, &mut even) };
                let mut gradient = 0.0;
                let mut curvature = 0.0;
                for ((b, own), sum) in b.iter().zip(&*own).zip(&sum) {
                    gradient += b * own;
                    curvature += b * b * sum;
                }
                if !(curvature > 0.0) {
                    continue;
                }
                let code = book.nearest(band, now[k] - gradient / curvature);
                let value = book.value(band, code);
                let step = value - now[k];
                changed |= code != codes[k];
                (codes[k], now[k]) = (code, value);
                for ((((b, own), other), sum), difference) in
                    b.iter().zip(own).zip(other).zip(&sum).zip(&difference)
                {
                    *own += step * b * sum;
                    *other += step * b * difference;
                }
            }
            if !changed {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::directions::even_directions;
    use diaphane_formats::harmonics::Coefficients;

    #[test]
    fn light_sees_less_of_the_error_than_of_nearest_codes() {
        let encoding = Encoding::Reciprocal { epsilon: 0.2 };
        let (order, half) = (6, 150);
        let pairs = even_directions(2 * half, 5);
        let directions: Vec<_> =
            pairs.iter().step_by(2).chain(pairs.iter().skip(1).step_by(2)).copied().collect();
        let rounding = Rounding::new(&Basis::new(&directions, order), order, encoding);
        let mut exact = Coefficients::zeros(vec![order as u8; 20]);
        for i in 0..exact.len() {
            for (k, v) in exact.of_mut(i).iter_mut().enumerate() {
                let falling = 1.0 / (1.0 + k.isqrt() as f32);
                *v = if k == 0 { 4.0 } else { 2.0 * falling * ((i * 37 + k * 11) as f32).sin() };
            }
        }
        let plain = exact.quantised().decoded();
        let chosen =
            exact.quantised_by(|i, book, q| rounding.choose(exact.of(i), |_| 0.0, book, q)).decoded();
        let value = |c: &[f32], d: usize| -> f32 {
            let opposite = |k: usize| if d >= half && rounding.bands[k] % 2 == 1 { -1.0 } else { 1.0 };
            c.iter().enumerate().map(|(k, c)| c * opposite(k) * rounding.columns[[k, d % half]]).sum()
        };
        let seen = |read: &Coefficients, i: usize| -> f32 {
            let one = |d: usize| {
                let y = value(exact.of(i), d);
                sensitivity(encoding, y) * (value(read.of(i), d) - y).powi(2)
            };
            (0..2 * half).map(one).sum()
        };
        let sum = |read: &Coefficients| (0..exact.len()).map(|i| seen(read, i)).sum::<f32>();
        let better = (0..exact.len()).filter(|i| seen(&chosen, *i) < seen(&plain, *i)).count();
        assert!(better >= 18, "{better} of 20");
        assert!(sum(&chosen) < 0.8 * sum(&plain), "{} {}", sum(&chosen), sum(&plain));
    }
}
