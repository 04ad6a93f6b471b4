//! The weighted mean of the sources along a ray, kernel by kernel.

use super::light::Lit;
use super::{Bounded, Twin, U};
use diaphane_formats::kernel::{CUT_OFF, CUT_OFF_VALUE};
use diaphane_formats::slopes::MOST_EXPONENT;
use glam::DVec3;

/// Share of a whole kernel's weight that single precision may miss: √π/2 times the errors of up to four terms of at
/// most 1, each with 1e-6 from the exponential and the error function.
const OF_WEIGHT: f64 = 4e-6;

/// The smallest number that the exponential gives.
const DARKEST: f64 = 2e-38;

/// An inside piece of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Where it starts.
    pub start: f64,
    /// Where it ends.
    pub end: f64,
    /// Fresnel transmittance in front of it.
    pub boundary: f64,
}

/// A homogeneous medium, per channel.
#[derive(Clone, Copy, Debug)]
pub struct Medium {
    /// κ.
    pub extinction: DVec3,
}

/// What a ray sees.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Radiance per channel.
    pub radiance: [Bounded; 3],
    /// Whether a weight is so small that its error may change the mean to anything among the sources.
    pub vague: bool,
}

/// W and the mean of t - tc under the bare attenuated Gaussian.
struct Weight {
    w: f64,
    bare: f64,
    mean: f64,
}

impl Twin<'_> {
    /// A ray from `origin` along `direction` (unit) with these inside pieces.
    pub fn ray(&self, lit: &Lit, origin: DVec3, direction: DVec3, pieces: &[Piece], medium: Medium) -> Seen {
        let hits: Vec<usize> = (0..self.centre.len())
            .filter(|i| self.samples.weight[*i] > 0.0 && self.may_meet(*i, origin, direction))
            .collect();
        let mut seen = Seen::default();
        let mut depth = DVec3::ZERO;
        for piece in pieces.iter().filter(|p| p.end > p.start) {
            for c in 0..3 {
                let grey = c > 0 && medium.extinction[c] == medium.extinction[0];
                let same = grey
                    && (0..lit.value.len())
                        .all(|i| lit.value[i][c] == lit.value[i][0] && lit.slope[i][c] == lit.slope[i][0]);
                if same {
                    continue;
                }
                let kappa = medium.extinction[c];
                let (mean, vague) = self.mean(lit, c, &hits, [origin, direction], piece, kappa);
                seen.vague |= vague;
                let y = kappa * (piece.end - piece.start);
                let emitted = -(-y).exp_m1();
                let factor = piece.boundary * (-depth[c]).exp() * emitted;
                let rounding = 8e-6 + 4.0 * U * (1.0 + depth[c]);
                seen.radiance[c].value += factor * mean.value;
                seen.radiance[c].error += factor * (mean.error + (mean.value + mean.error) * rounding);
            }
            depth += medium.extinction * (piece.end - piece.start);
        }
        for c in 1..3 {
            if seen.radiance[c] == Bounded::default() && medium.extinction[c] == medium.extinction[0] {
                seen.radiance[c] = seen.radiance[0];
            }
        }
        seen
    }

    /// Whether the ray's line passes the support, or nearly: rounding may count a kernel more.
    fn may_meet(&self, i: usize, origin: DVec3, direction: DVec3) -> bool {
        let to = self.centre[i] - origin;
        let across = (to - direction * to.dot(direction)).length();
        let a = self.sharpness[i];
        a * (across - 8.0 * U * to.length()) < f64::from(CUT_OFF).sqrt()
    }

    fn mean(
        &self,
        lit: &Lit,
        c: usize,
        hits: &[usize],
        [origin, direction]: [DVec3; 2],
        piece: &Piece,
        kappa: f64,
    ) -> (Bounded, bool) {
        let mut parts = Vec::new();
        for &i in hits {
            let a = self.sharpness[i];
            let to = self.centre[i] - origin;
            let tc = to.dot(direction);
            let across = to - direction * tc;
            let d2 = across.length_squared();
            let blur = 8.0 * U * (to.length() + 1.0 / a);
            let half = (f64::from(CUT_OFF) / (a * a) - d2).max(0.0).sqrt();
            let (from, to_end) = (piece.start.max(tc - half), piece.end.min(tc + half));
            let length = (to_end - from).max(0.0);
            let weight = f64::from(self.samples.weight[i]);
            let before = kappa * (from - piece.start).max(0.0);
            let dim = (-before).exp();
            let of = weigh(a, d2, tc, kappa, from, length);
            // What two kernels' ends may gain or lose where the support is a rim: the square root of its rounding.
            let rim = if half * a < 0.05 { (8.0 * U * (a * blur + 1.0)).sqrt() / a } else { 0.0 };
            let w = weight * of.w * dim;
            let w_error = weight * (dim * (OF_WEIGHT / a + 4.0 * blur + rim * 1e-2) + DARKEST / a)
                + w * (2.0 * kappa * blur + U * (60.0 + 4.0 * before));
            let (h, h_error) = lit.slope[i][c];
            let along = h.dot(direction);
            let variance = (0.5 / (a * a)).min(length * length / 12.0);
            let exponent = -h.dot(across) + along * of.mean + 0.5 * along * along * variance;
            let limit = f64::from(MOST_EXPONENT);
            let exponent = exponent.clamp(-limit, limit);
            // Of the mean: terms of size 1/2a² (e/F) and κ/2a², F = ∫f the bare weight.
            let bare = of.bare * dim;
            let mean_error = if bare > 1e-28 {
                let e = dim / (a * bare);
                ((1e-6 * e + 0.5 * e * e * OF_WEIGHT * (-a * a * d2).exp() + 2.0 * U * kappa / a) / a)
                    .min(length)
            } else {
                length
            };
            let off = (h.length() + h_error) * (mean_error + 2.0 * blur)
                + h_error * (across.length() + of.mean.abs() + along.abs() * variance)
                + 1e-6
                + 8.0 * U * (h.length() * (across.length() + of.mean.abs()) + along * along * variance);
            let grown = off.min(2.0 * limit).exp();
            let v = lit.value[i][c];
            let value = v.value * exponent.exp();
            let error = value * (grown - 1.0) + v.error * exponent.exp() * grown;
            parts.push((w, w_error, value, error));
        }
        let sum: f64 = parts.iter().map(|p| p.0).sum();
        let sum_error: f64 = parts.iter().map(|p| p.1).sum();
        let most = parts.iter().map(|p| p.2 + p.3).fold(0.0, f64::max);
        if sum <= 2.0 * sum_error {
            let value = if sum > 0.0 { parts.iter().map(|p| p.0 * p.2).sum::<f64>() / sum } else { 0.0 };
            return (Bounded { value, error: most }, true);
        }
        let value = parts.iter().map(|p| p.0 * p.2).sum::<f64>() / sum;
        let moved: f64 = parts.iter().map(|p| p.0 * p.3 + (p.2 - value).abs() * p.1).sum();
        let rounding = U * (parts.len() as f64 + 8.0);
        let error = (moved / (sum - sum_error) + value * rounding).min(most);
        (Bounded { value, error }, false)
    }
}

/// ∫ e^{-κ(t-from)} (e^{-a²(d²+(t-tc)²)} - e^{-C}) dt over `from..from + length` by Gauss-Legendre panels that resolve
/// both factors, and the mean of t - tc under the first part.
fn weigh(a: f64, d2: f64, tc: f64, kappa: f64, from: f64, length: f64) -> Weight {
    // Beyond 45 mean free paths nothing is left in double precision.
    let seen = if kappa > 0.0 { length.min(45.0 / kappa) } else { length };
    let panels = (0.5 * seen * (a + kappa)).ceil().max(1.0);
    let h = seen / panels;
    let (mut w, mut bare, mut first) = (0.0, 0.0, 0.0);
    for panel in 0..panels as usize {
        for (x, weight) in RULE {
            let s = (panel as f64 + 0.5 + 0.5 * x) * h;
            let t = from - tc + s;
            let decay = (-kappa * s).exp() * weight * 0.5 * h;
            let gauss = (-a * a * (d2 + t * t)).exp();
            w += decay * (gauss - f64::from(CUT_OFF_VALUE)).max(0.0);
            bare += decay * gauss;
            first += decay * gauss * t;
        }
    }
    let mean = if bare > 0.0 { first / bare } else { from - tc };
    Weight { w, bare, mean }
}

/// Gauss-Legendre rule of eight points on -1..1 (Abramowitz and Stegun, table 25.4).
const RULE: [(f64, f64); 8] = [
    (-0.960_289_856_497_536_2, 0.101_228_536_290_376_3),
    (-0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (-0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (-0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_3),
];

/// Nodes and weights of the Gauss-Legendre rule of `n` points on -1..1, by Newton's iteration.
pub(super) fn gauss(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..50 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 0..n {
                let k = k as f64;
                (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
            }
            slope = n as f64 * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}
