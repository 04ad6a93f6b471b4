//! Slopes of ln v and the values at the kernels' centres: the head of `formats`' `slopes` in double precision.

use super::light::{Lit, Source, Values};
use super::{Bounded, Twin, U};
use diaphane_formats::slopes::{CELL_RADIUS, MOST_EXPONENT, MOST_RATIO};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

impl Twin<'_> {
    /// Sources of the samples `wanted` from the values at their centroids and their neighbours'.
    pub(super) fn sources(&self, values: &Values, wanted: &[usize]) -> Lit {
        Lit(wanted.par_iter().map(|i| (*i, self.source(values, *i))).collect())
    }

    fn source(&self, values: &Values, i: usize) -> Source {
        let gradients = self.gradients(i);
        let info = &self.asset.info;
        let to_centre = self.centre[i] - self.place[i];
        let blur = 4.0 * U * self.centre[i].length();
        let radius = f64::from(self.samples.position_radius[i][3]);
        let variance = (f64::from(CELL_RADIUS) * radius).powi(2) / 5.0;
        let (most, limit) = (f64::from(MOST_RATIO), f64::from(self.stencil.limit[i]));
        let exponents = f64::from(MOST_EXPONENT);
        let mut out = ([Bounded::default(); 3], [(DVec3::ZERO, 0.0); 3]);
        for (c, own) in values[&i].iter().copied().enumerate() {
            if own.value <= 0.0 {
                out.0[c] = own;
                continue;
            }
            let (mut h, mut error) = (DVec3::ZERO, 0.0);
            for (j, gradient, relative) in &gradients {
                let other = values[j][c];
                let log = (other.value / own.value).ln().clamp(-most, most);
                // Each end of the ratio's range, with the limits applied.
                let up = (other.value + other.error) / (own.value - own.error).max(0.0);
                let down = (other.value - other.error).max(0.0) / (own.value + own.error);
                let off = (up.ln().clamp(-most, most) - log).max(log - down.ln().clamp(-most, most));
                h += *gradient * log;
                error += gradient.length() * (off + log.abs() * (relative + 4.0 * U) + 2.0 * U);
            }
            let length = h.length();
            if length > limit {
                h *= limit / length;
            }
            let error = error.min(2.0 * limit) + 4.0 * U * limit;
            let along = h.dot(to_centre);
            let r = info.extinction[c] / info.reference_extinction.max(f64::MIN_POSITIVE);
            let share = if info.reference_extinction > 0.0 { 1.0 / r.max(1.0) } else { 1.0 };
            let spread = (variance * h.length_squared() - along * along).max(0.0);
            let exponent = (along - 0.5 * share * spread).clamp(-exponents, exponents);
            let reach = to_centre.length() + blur;
            let off = error * (reach + share * (variance * h.length() + along.abs() * reach))
                + h.length() * blur * (1.0 + share * along.abs())
                + 0.5 * share * error * error * variance
                + 6.0 * U * (1.0 + variance * h.length_squared() + along * along);
            let value = own.value * exponent.exp();
            let grown = off.min(2.0 * exponents).exp();
            let error_of_value = value * (grown - 1.0) + own.error * exponent.exp() * grown;
            out.0[c] = Bounded { value, error: error_of_value };
            out.1[c] = (h, error);
        }
        out
    }

    /// Neighbours, the vectors that their ln ratios are multiplied with, and those vectors' relative error.
    fn gradients(&self, i: usize) -> Vec<(usize, DVec3, f64)> {
        let found: Vec<usize> = self.neighbours(i).collect();
        let offsets: Vec<DVec3> = found.iter().map(|j| self.place[*j] - self.place[i]).collect();
        let reach = offsets.iter().map(|d| d.length()).fold(0.0, f64::max);
        if reach <= 0.0 {
            return Vec::new();
        }
        let weight = |d: DVec3| (-2.0 * d.length_squared()).exp();
        let mut m = DMat3::ZERO;
        for d in offsets.iter().map(|d| *d / reach) {
            m += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * weight(d);
        }
        let trace = m.x_axis.x + m.y_axis.y + m.z_axis.z;
        m += DMat3::from_diagonal(DVec3::splat(1e-3 * trace + 1e-12));
        let inverse = m.inverse();
        let size = inverse.x_axis.length() + inverse.y_axis.length() + inverse.z_axis.length();
        // A product with an explicit inverse is off by the matrix' condition times the error of its entries, which hold
        // differences of places, relative to |M⁻¹| |w d| (Higham, section 14.1).
        let place =
            offsets.iter().map(|d| self.place[i].length() / d.length().max(1e-30)).fold(0.0, f64::max);
        let condition = trace * size;
        let relative = condition * U * (20.0 + 4.0 * place.min(1e6));
        let each = |(j, d): (&usize, &DVec3)| {
            let d = *d / reach;
            let gradient = inverse * d * (weight(d) / reach);
            let most = size * d.length() * weight(d) / reach;
            let own = gradient.length().max(f64::MIN_POSITIVE);
            (*j, gradient, relative * most / own)
        };
        found.iter().zip(&offsets).map(each).collect()
    }
}
