//! The weighted mean of the sources along a ray, kernel by kernel.

use super::light::Lit;
use super::profile::{Along, Part};
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

/// A kernel that a ray meets.
struct Met {
    sample: usize,
    /// Ray parameter of the closest approach to the centre.
    tc: f64,
    /// From there to the centre.
    across: DVec3,
    /// How far off single precision may place it.
    blur: f64,
}

/// What a part of a kernel adds: its weight and its source, with their errors.
struct Term {
    weight: Bounded,
    source: Bounded,
}

impl Twin<'_> {
    /// Samples whose kernels the line from `origin` along `direction` (unit) passes, or nearly: rounding may count a
    /// kernel more.
    pub fn met(&self, origin: DVec3, direction: DVec3) -> Vec<usize> {
        let passes = |i: &usize| {
            let to = self.centre[*i] - origin;
            let across = (to - direction * to.dot(direction)).length();
            self.sharpness[*i] * (across - 8.0 * U * to.length()) < f64::from(CUT_OFF).sqrt()
        };
        (0..self.centre.len()).filter(|i| self.samples.weight[*i] > 0.0).filter(passes).collect()
    }

    /// A ray from `origin` along `direction` (unit) with these inside pieces; `met` are the samples that
    /// [`Twin::met`] names, and `lit` has their sources.
    pub fn ray(&self, lit: &Lit, origin: DVec3, direction: DVec3, pieces: &[Piece], met: &[usize]) -> Seen {
        let met: Vec<Met> = met.iter().map(|i| self.meet(*i, origin, direction)).collect();
        let mut seen = Seen::default();
        let mut depth = Bounded::default();
        for piece in pieces.iter().filter(|p| p.end > p.start) {
            let along = Along::new(self.density.as_ref(), origin, direction, piece.start, piece.end);
            for c in 0..3 {
                let kappa = self.extinction[c];
                if c > 0 && self.is_like_first(lit, &met, c) {
                    seen.radiance[c] = seen.radiance[0];
                    continue;
                }
                let (mean, vague) = self.mean(lit, c, &met, direction, piece, &along);
                seen.vague |= vague;
                let emitted = along.emission(kappa);
                let before = piece.boundary * (-kappa * depth.value).exp();
                let factor = before * emitted.value;
                let rounding = (kappa * depth.error).exp_m1() + 8e-6 + 4.0 * U * (1.0 + kappa * depth.value);
                let most = mean.value + mean.error;
                seen.radiance[c].value += factor * mean.value;
                seen.radiance[c].error += factor * (mean.error + most * rounding)
                    + before * emitted.error * most * (1.0 + rounding);
            }
            let own = along.depth();
            depth.value += own.value;
            depth.error += own.error;
        }
        seen
    }

    /// Whether channel `c` comes out as the first.
    fn is_like_first(&self, lit: &Lit, met: &[Met], c: usize) -> bool {
        let same = |m: &Met| {
            let (value, slope) = lit.of(m.sample);
            value[c] == value[0] && slope[c] == slope[0]
        };
        self.extinction[c] == self.extinction[0] && met.iter().all(same)
    }

    fn meet(&self, sample: usize, origin: DVec3, direction: DVec3) -> Met {
        let to = self.centre[sample] - origin;
        let tc = to.dot(direction);
        let blur = 8.0 * U * (to.length() + 1.0 / self.sharpness[sample]);
        Met { sample, tc, across: to - direction * tc, blur }
    }

    /// The weighted mean of the sources of channel `c`, and whether its weights are too small to say much.
    fn mean(
        &self,
        lit: &Lit,
        c: usize,
        met: &[Met],
        direction: DVec3,
        piece: &Piece,
        along: &Along,
    ) -> (Bounded, bool) {
        let mut terms = Vec::new();
        for kernel in met {
            let (a, tc) = (self.sharpness[kernel.sample], kernel.tc);
            let d2 = kernel.across.length_squared();
            let half = (f64::from(CUT_OFF) / (a * a) - d2).max(0.0).sqrt();
            let (from, to) = (piece.start.max(tc - half), piece.end.min(tc + half));
            // A support that ends before the piece, or begins behind it, by more than its ends may be off has no weight.
            let radius = f64::from(CUT_OFF).sqrt() / a;
            let moved = 2.0 * radius * (kernel.blur + 2.0 * U * radius);
            if from - to > 2.0 * (kernel.blur + moved.sqrt().min(0.5 * moved / half)) {
                continue;
            }
            for part in along.parts(from, (to - from).max(0.0), kernel.blur) {
                terms.push(self.term(lit, c, kernel, &part, half, direction));
            }
        }
        let sum: f64 = terms.iter().map(|t| t.weight.value).sum();
        let sum_error: f64 = terms.iter().map(|t| t.weight.error).sum();
        let most = terms.iter().map(|t| t.source.value + t.source.error).fold(0.0, f64::max);
        let weighted: f64 = terms.iter().map(|t| t.weight.value * t.source.value).sum();
        let value = if sum > 0.0 { weighted / sum } else { 0.0 };
        if sum <= 2.0 * sum_error {
            return (Bounded { value, error: most }, true);
        }
        let moved =
            |t: &Term| t.weight.value * t.source.error + (t.source.value - value).abs() * t.weight.error;
        let rounding = U * (terms.len() as f64 + 8.0);
        let moved: f64 = terms.iter().map(moved).sum();
        let error = (moved / (sum - sum_error) + value * rounding).min(most);
        (Bounded { value, error }, false)
    }

    /// What one part of a kernel's support adds; the whole support reaches `half` to both sides of the closest approach.
    fn term(&self, lit: &Lit, c: usize, kernel: &Met, part: &Part, half: f64, direction: DVec3) -> Term {
        let Met { sample: i, tc, across, blur } = *kernel;
        let Part { from, length, .. } = *part;
        let (a, d2) = (self.sharpness[i], across.length_squared());
        let kappa = self.extinction[c];
        let here = kappa * part.density.value;
        let before = kappa * part.before.value;
        let dim = (-before).exp();
        let of = weigh(a, d2, tc, here, from, length);
        // What two kernels' ends may gain or lose where the support is a rim: the square root of its rounding.
        let rim = if half * a < 0.05 { (8.0 * U * (a * blur + 1.0)).sqrt() / a } else { 0.0 };
        let weight = f64::from(self.samples.weight[i]);
        let scattering = part.scattering;
        let w = weight * scattering.value * of.w * dim;
        let depth_error =
            kappa * (part.before.error + part.density.error * length + 2.0 * self.densest() * blur);
        let of_weight = dim * (OF_WEIGHT / a + 4.0 * blur + rim * 1e-2) + DARKEST / a;
        let w_error = weight * (scattering.value + scattering.error) * of_weight
            + (w + weight * scattering.error * of.w * dim)
                * (depth_error.exp_m1().min(1e30) + U * (60.0 + 4.0 * before))
            + weight * scattering.error * of.w * dim;
        let (value, slope) = lit.of(i);
        let (h, h_error) = slope[c];
        let along = h.dot(direction);
        let variance = (0.5 / (a * a)).min(length * length / 12.0);
        let mean = (of.mean + part.shift.value).clamp(from - tc, from - tc + length);
        let exponent = -h.dot(across) + along * mean + 0.5 * along * along * variance;
        let limit = f64::from(MOST_EXPONENT);
        let exponent = exponent.clamp(-limit, limit);
        // Of the mean: terms of size 1/2a² (e/F) and κ/2a², F = ∫f the bare weight.
        let bare = of.bare * dim;
        let mean_error = if bare > 1e-28 {
            let e = dim / (a * bare);
            let gauss = (-a * a * d2).exp();
            (1e-6 * e + 0.5 * e * e * OF_WEIGHT * gauss + 2.0 * U * here / a) / a
        } else {
            length
        };
        let denser = 0.25 * kappa * part.density.error * length * length;
        let mean_error = (mean_error + denser + part.shift.error).min(length);
        let off = (h.length() + h_error) * (mean_error + 2.0 * blur)
            + h_error * (across.length() + mean.abs() + along.abs() * variance)
            + 1e-6
            + 8.0 * U * (h.length() * (across.length() + mean.abs()) + along * along * variance);
        let grown = off.min(2.0 * limit).exp();
        let (value, error) = (value[c].value, value[c].error);
        let source = Bounded {
            value: value * exponent.exp(),
            error: value * exponent.exp() * (grown - 1.0) + error * exponent.exp() * grown,
        };
        Term { weight: Bounded { value: w, error: w_error }, source }
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
