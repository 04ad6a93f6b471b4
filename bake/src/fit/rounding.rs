//! Codes of the coefficients by what light sees of their error.
//!
//! Rounding every coefficient by itself spreads its error evenly over all directions, though ψ does not feel it where it
//! is near 0 or 1. Here the codes minimise Σ_ω s (B (q - x))², s being the sensitivity of ψ̂, x being the fit: one coefficient after the other,
//! highest band first, is set to the code nearest to what is best given all others; those not yet rounded make up for the
//! error of those that are (the error feedback of Hassibi and Stork 1993, by coordinate descent instead of an inverse).
//! Measured at equal bytes on the bird at extinction 64 per diagonal, lit from behind: error 0.190 before, 0.173 so.

use super::decoded::{LANES, narrow, sensitivities, sum};
use super::least_squares::Basis;
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

/// Sums and differences over opposite directions.
struct Pairs {
    /// Sensitivities.
    sum: Vec<f32>,
    difference: Vec<f32>,
    /// Sensitivity times error: the sum, which even bands see, and the difference, which odd ones see.
    seen: [Vec<f32>; 2],
}

impl Rounding {
    pub fn new(basis: &Basis, order: usize, encoding: Encoding) -> Self {
        let bands = (0..order).flat_map(|l| std::iter::repeat_n(l, 2 * l + 1)).collect();
        Self { columns: basis.columns(order), bands, encoding }
    }

    fn column(&self, k: usize) -> &[f32] {
        self.columns.row(k).to_slice().unwrap_or(&[])
    }

    /// Changes `codes` for the better (not those of a fit that is not finite); `lobe` (0 or positive) is what the sample has beside its harmonics, in all
    /// directions: the first half, then their opposites.
    pub fn choose(&self, x: &[f32], lobe: impl Fn(usize) -> f32, book: &CodeBook<'_>, codes: &mut [i32]) {
        if x.iter().any(|x| !x.is_finite()) {
            return;
        }
        let y: Vec<f32> = (0..2 * self.columns.ncols()).map(lobe).collect();
        narrow().dispatch(
            #[inline(always)]
            || {
                let mut pairs = self.pairs(x, y);
                self.descend(x, &mut pairs, book, codes);
            },
        );
    }

    /// Sensitivities around the fit `x`, without errors yet; `y` is what lies beside it.
    #[inline(always)]
    fn pairs(&self, x: &[f32], mut y: Vec<f32>) -> Pairs {
        let half = self.columns.ncols();
        let (left, right) = y.split_at_mut(half);
        for (k, x) in x.iter().enumerate() {
            let opposite = if self.bands[k].is_multiple_of(2) { *x } else { -*x };
            for ((left, right), b) in left.iter_mut().zip(&mut *right).zip(self.column(k)) {
                *left += x * b;
                *right += opposite * b;
            }
        }
        sensitivities(self.encoding, left);
        sensitivities(self.encoding, right);
        let both = || left.iter().zip(&*right);
        Pairs {
            sum: both().map(|(a, b)| a + b).collect(),
            difference: both().map(|(a, b)| a - b).collect(),
            seen: [vec![0.0; half], vec![0.0; half]],
        }
    }

    #[inline(always)]
    fn descend(&self, x: &[f32], pairs: &mut Pairs, book: &CodeBook<'_>, codes: &mut [i32]) {
        let Pairs { sum, difference, seen: [even, odd] } = pairs;
        let (sum, difference) = (&sum[..], &difference[..]);
        let mut now = x.to_vec();
        let curvature = |k: usize| {
            let b = self.column(k);
            sum!(|b, sum| b * b * sum)
        };
        let curvatures: Vec<f32> = (0..x.len()).map(curvature).collect();
        for _ in 0..SWEEPS {
            let mut changed = false;
            for k in (0..x.len()).rev() {
                let (band, b) = (self.bands[k], self.column(k));
                let is_even = band.is_multiple_of(2);
                let (own, other) = if is_even { (&mut *even, &mut *odd) } else { (&mut *odd, &mut *even) };
                let (own, other) = (&mut own[..], &mut other[..]);
                let gradient = sum!(|b, own| b * own);
                let curvature = curvatures[k];
                if !(curvature > 0.0) {
                    continue;
                }
                let code = book.nearest(band, now[k] - gradient / curvature);
                let value = book.value(band, code);
                let step = value - now[k];
                if step == 0.0 {
                    continue;
                }
                changed |= code != codes[k];
                (codes[k], now[k]) = (code, value);
                let weights = sum.iter().zip(difference);
                for ((b, (own, other)), (sum, difference)) in
                    b.iter().zip(own.iter_mut().zip(other)).zip(weights)
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
        let choose = |i: usize, book: &CodeBook<'_>, q: &mut [i32]| {
            rounding.choose(exact.of(i), |_| 0.0, book, q);
            Ok::<(), std::convert::Infallible>(())
        };
        let chosen = exact.quantised_by(choose).unwrap().decoded();
        let value = |c: &[f32], d: usize| -> f32 {
            let opposite = |k: usize| if d >= half && rounding.bands[k] % 2 == 1 { -1.0 } else { 1.0 };
            c.iter().enumerate().map(|(k, c)| c * opposite(k) * rounding.columns[[k, d % half]]).sum()
        };
        let seen = |read: &Coefficients, i: usize| -> f32 {
            let one = |d: usize| {
                let y = value(exact.of(i), d);
                let mut seen = [y];
                sensitivities(encoding, &mut seen);
                seen[0] * (value(read.of(i), d) - y).powi(2)
            };
            (0..2 * half).map(one).sum()
        };
        let sum = |read: &Coefficients| (0..exact.len()).map(|i| seen(read, i)).sum::<f32>();
        let better = (0..exact.len()).filter(|i| seen(&chosen, *i) < seen(&plain, *i)).count();
        assert!(better >= 18, "{better} of 20");
        assert!(sum(&chosen) < 0.8 * sum(&plain), "{} {}", sum(&chosen), sum(&plain));
    }
}
