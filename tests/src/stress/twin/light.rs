//! v of every sample at its centroid: the head of the player's lighting in double precision.

use super::phase::phase;
use super::{Bounded, Twin, U};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::sh::{self, MAX_ORDER};
use diaphane_runtime::fold::{Plan, linear};
use diaphane_runtime::frame::{Frame, FrameLight, LightKind, MOST_IRRADIANCE};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Circles of directions in which folded transmittance is projected, twice as many directions each.
const CIRCLES: usize = 14;

/// v of samples at their centroids, per channel.
pub(super) type Values = HashMap<usize, [Bounded; 3]>;

/// v at a kernel's centre, per channel, and ∇ ln v with its largest deviation.
pub(super) type Source = ([Bounded; 3], [(DVec3, f64); 3]);

/// Sources of samples.
pub struct Lit(pub(super) HashMap<usize, Source>);

impl Lit {
    /// Of a sample that was asked for.
    pub(super) fn of(&self, sample: usize) -> &Source {
        &self.0[&sample]
    }
}

/// Transmittance of one sample as harmonics, [channel][coefficient].
type Projected = Box<[Vec<f64>; 3]>;

/// Transmittance of the samples as harmonics, each projected when it is first asked for.
pub struct Folded {
    samples: Vec<OnceLock<Projected>>,
    /// Directions, their solid angles and harmonics.
    rule: OnceLock<Vec<(DVec3, f64, Vec<f64>)>>,
}

impl Folded {
    /// Of `count` samples, none of which is projected yet.
    pub fn new(count: usize) -> Self {
        Self { samples: (0..count).map(|_| OnceLock::new()).collect(), rule: OnceLock::new() }
    }
}

const WIDE: usize = MAX_ORDER * MAX_ORDER;

impl Twin<'_> {
    /// v of the samples `needed` at their centroids.
    pub(super) fn values(&self, frame: &Frame, needed: &[usize]) -> Vec<[Bounded; 3]> {
        let plan = Plan::new(frame, &self.asset.info, None);
        let origin = frame.view.origin.as_dvec3();
        let ambient = (!plan.folded.is_empty()).then(|| self.ambient(frame, &plan.folded));
        let most = f64::from(frame.most_source());
        needed
            .par_iter()
            .map(|&i| {
                let mut sum = [Bounded::default(); 3];
                for light in plan.single.iter().map(|l| &frame.lights[*l]) {
                    let one = self.light_of(i, light, origin, f64::from(frame.least_distance));
                    (0..3).for_each(|c| {
                        sum[c].value += one[c].value;
                        sum[c].error += one[c].error;
                    });
                }
                // Sums of positive terms; folded ones are added afterwards.
                let count = plan.single.len() as f64;
                sum.iter_mut().for_each(|s| s.error += s.value * U * count);
                if let Some(ambient) = &ambient {
                    self.add_folded(i, ambient, origin, &mut sum);
                }
                let albedo = self.asset.info.albedo;
                std::array::from_fn(|c| {
                    let value = (sum[c].value * albedo[c]).min(most);
                    Bounded { value, error: sum[c].error * albedo[c] + 3.0 * U * value }
                })
            })
            .collect()
    }

    fn light_of(&self, i: usize, light: &FrameLight, origin: DVec3, least: f64) -> [Bounded; 3] {
        let place = self.place[i];
        let blur = 2.0 * U * (self.centre[i].length() + place.length());
        let (to, off, fall, fall_error) = if light.kind == LightKind::Directional {
            (-light.direction.as_dvec3(), 0.0, 1.0, 0.0)
        } else {
            let d = light.position.as_dvec3() - place;
            let distance = d.length();
            let error = blur + U * (light.position.as_dvec3().length() + place.length());
            let to = if distance > 0.0 { d / distance } else { DVec3::Y };
            let off = if distance > 0.0 { (error / distance + 3.0 * U).min(2.0) } else { 0.0 };
            let clamped = distance.max(least);
            let relative = 2.0 * error / (clamped - error).max(error) + 6.0 * U;
            let mut fall = 1.0 / (clamped * clamped);
            let mut fall_error = fall * relative;
            if light.kind == LightKind::Spot {
                let (outer, inner) = (f64::from(light.cos_outer), f64::from(light.cos_inner));
                let cosine = -to.dot(light.direction.as_dvec3());
                let t = ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0);
                let slope = 1.5 * (off + 4.0 * U) / (inner - outer);
                fall_error = fall_error * t * t * (3.0 - 2.0 * t) + fall * slope.min(1.0);
                fall *= t * t * (3.0 - 2.0 * t);
            }
            (to, off, fall, fall_error)
        };
        let away = origin - place;
        let towards = away.normalize_or_zero();
        let distance = away.length();
        let turn = if distance > 0.0 {
            ((blur + U * (origin.length() + place.length())) / distance + 3.0 * U).min(2.0)
        } else {
            0.0
        };
        let g = limited(self.asset.info.phase.mean_cosine(), light);
        let p = phase(g, -to, towards, off + turn);
        let psi = self.arriving(i, to, off);
        let colour = light.colour.as_dvec3();
        std::array::from_fn(|c| {
            let most = f64::from(MOST_IRRADIANCE);
            let irradiance = (colour[c] * fall).clamp(-most, most);
            let share = if fall > 0.0 { fall_error / fall } else { 0.0 };
            let value = irradiance * psi[c].value * p.value;
            let error = irradiance.abs() * (psi[c].error * p.value + (psi[c].value + psi[c].error) * p.error);
            let unlit = if fall > 0.0 { 0.0 } else { (colour[c] * fall_error).abs() * p.value };
            Bounded { value, error: error + value.abs() * (share + 4.0 * U) + unlit }
        })
    }

    /// ψβ of sample `i` in direction `to`, which is known up to `off`.
    fn arriving(&self, i: usize, to: DVec3, off: f64) -> [Bounded; 3] {
        let order = usize::from(self.depth.order[i]);
        let border = self.boundary.order.get(i).map_or(0, |k| usize::from(*k));
        let mut basis = [0.0; WIDE];
        sh::evaluate(order.max(border), to.to_array(), &mut basis);
        let through = if self.boundary.is_empty() {
            Bounded { value: 1.0, error: 0.0 }
        } else {
            let b = series(self.boundary.of(i), &basis, off);
            Bounded { value: b.value.clamp(0.0, 1.0), error: b.error }
        };
        let info = &self.asset.info;
        let mut stored = series(self.depth.of(i), &basis, off);
        if let Some(lobe) = self.samples.lobe.get(i).map(|a| a.as_dvec3()) {
            stored.value += lobe.dot(to).max(0.0);
            stored.error += lobe.length() * (off + 4.0 * U);
        }
        stored.error += 2.0 * U * stored.value.abs();
        std::array::from_fn(|c| {
            if info.reference_extinction <= 0.0 {
                return through;
            }
            let ratio = info.extinction[c] / info.reference_extinction;
            let psi = |s: f64| {
                let tau = decode(info.encoding, s);
                if tau == f64::INFINITY { 0.0 } else { (-ratio * tau).exp() }
            };
            let value = psi(stored.value);
            // ψ grows with what is stored, or falls: the ends of the range bound it either way.
            let ends = [psi(stored.value + stored.error), psi(stored.value - stored.error)];
            let range = ends.iter().map(|e| (e - value).abs()).fold(0.0, f64::max);
            let tau = decode(info.encoding, stored.value).min(1e3 / ratio.max(1e-30));
            // ε and the reciprocal round before their difference is taken.
            let rounding =
                value * U * (4.0 + ratio * (3.0 * tau + 3.0 * reciprocal_size(info.encoding, tau)));
            let error = range + rounding;
            Bounded {
                value: value * through.value,
                error: error * through.value + (value + error) * through.error + 2.0 * U * value,
            }
        })
    }

    /// F and its changes, as [`diaphane_runtime::fold::ambient`] says, in double precision, and Σ|F|-like sums that
    /// bound their rounding.
    fn ambient(&self, frame: &Frame, folded: &[usize]) -> Ambient {
        let g = self.asset.info.phase.mean_cosine();
        let towards = frame.view.origin.as_dvec3().normalize_or_zero();
        let count = linear::BANDS * linear::BANDS;
        let mut ambient = Ambient { values: vec![[[0.0; 3]; 4]; count], sizes: vec![[[0.0; 3]; 4]; count] };
        let mut basis = [0.0; WIDE];
        for light in folded.iter().map(|l| &frame.lights[*l]) {
            let to = -light.direction.as_dvec3();
            sh::evaluate(linear::BANDS, to.to_array(), &mut basis);
            let g = limited(g, light);
            let p = phase(g, -to, towards, 0.0).value;
            let base = (1.0 - g).powi(2) + 2.0 * g * (1.0 + to.dot(towards));
            let slope = 3.0 * g * p / base;
            let factors = [p, -slope * to.x, -slope * to.y, -slope * to.z];
            for (k, y) in basis[..count].iter().enumerate() {
                for (v, factor) in factors.iter().enumerate() {
                    for c in 0..3 {
                        let term = f64::from(light.colour[c]) * factor * y;
                        ambient.values[k][v][c] += term;
                        ambient.sizes[k][v][c] += term.abs();
                    }
                }
            }
        }
        ambient
    }

    fn add_folded(&self, i: usize, ambient: &Ambient, origin: DVec3, sum: &mut [Bounded; 3]) {
        let folded = self.folded.samples[i].get_or_init(|| self.fold(i));
        let g = self.asset.info.phase.mean_cosine();
        let deviation = (origin - self.place[i]).normalize_or_zero() - origin.normalize_or_zero();
        let factors =
            if g == 0.0 { [1.0, 0.0, 0.0, 0.0] } else { [1.0, deviation.x, deviation.y, deviation.z] };
        for (c, sum) in sum.iter_mut().enumerate() {
            let (mut value, mut error) = (0.0, 0.0);
            for (k, t) in folded[c].iter().enumerate() {
                let f: f64 = (0..4).map(|v| factors[v] * ambient.values[k][v][c]).sum();
                let size: f64 = (0..4).map(|v| factors[v].abs() * ambient.sizes[k][v][c]).sum();
                value += t * f;
                // Coefficients are rounded to f16 (half a unit of 2^-10, 2^-24 at the least); p as the phase's head.
                let rounded = t.abs() * 2f64.powi(-11) + 2f64.powi(-24);
                let of_f = size * U * (16.0 + 16.0 * g.abs() / (1.0 - g.abs()).powi(2));
                error += rounded * f.abs()
                    + (t.abs() + rounded) * of_f
                    + PROJECTED * f.abs()
                    + U * 200.0 * t.abs() * f.abs();
            }
            sum.value += value.max(0.0);
            sum.error += error;
        }
    }

    /// The projection of [`diaphane_runtime::fold::linear`] of sample `i`.
    fn fold(&self, i: usize) -> Projected {
        let mut sums = Box::new(std::array::from_fn(|_| vec![0.0; linear::BANDS * linear::BANDS]));
        for (to, solid_angle, basis) in self.folded.rule.get_or_init(rule) {
            let psi = self.arriving(i, *to, 0.0);
            for (sum, psi) in sums.iter_mut().zip(&psi) {
                let add = |(s, y): (&mut f64, &f64)| *s += psi.value * solid_angle * y;
                sum.iter_mut().zip(basis).for_each(add);
            }
        }
        sums
    }
}

/// Gauss-Legendre nodes along z, even steps around: directions, their solid angles and harmonics.
fn rule() -> Vec<(DVec3, f64, Vec<f64>)> {
    let mut directions = Vec::new();
    for (z, weight) in super::kernels::gauss(CIRCLES) {
        for k in 0..2 * CIRCLES {
            let phi = std::f64::consts::TAU * (k as f64 + 0.5) / (2 * CIRCLES) as f64;
            let r = (1.0 - z * z).sqrt();
            let to = DVec3::new(r * phi.cos(), r * phi.sin(), z).as_vec3().as_dvec3();
            let mut basis = vec![0.0; linear::BANDS * linear::BANDS];
            sh::evaluate(linear::BANDS, to.to_array(), &mut basis);
            directions.push((to, weight * std::f64::consts::TAU / (2 * CIRCLES) as f64, basis));
        }
    }
    directions
}

/// Rounding of a projected coefficient: ∫|Y| ≤ 3.6 times the mean rounding of ψ and of a sum of 392 terms.
const PROJECTED: f64 = 3.6 * 400.0 * U;

/// The phase function's mean cosine for a light.
fn limited(g: f64, light: &FrameLight) -> f64 {
    let most = f64::from(light.most_cosine);
    g.clamp(-most, most)
}

/// F of the folded lights: [coefficient][itself, changes along x, y, z][channel].
struct Ambient {
    values: Vec<[[f64; 3]; 4]>,
    sizes: Vec<[[f64; 3]; 4]>,
}

/// Σ c Y with the error of single precision: each Y_l carries 4 + 3l roundings of its scale √((2l+1)/4π), and turns
/// with the direction by at most l times that scale.
fn series(coefficients: &[f32], basis: &[f64], off: f64) -> Bounded {
    let mut sum = Bounded::default();
    for (k, c) in coefficients.iter().map(|c| f64::from(*c)).enumerate() {
        let l = (k as f64).sqrt().floor();
        let scale = ((2.0 * l + 1.0) / (4.0 * std::f64::consts::PI)).sqrt();
        sum.value += c * basis[k];
        sum.error += c.abs() * scale * ((4.0 + 3.0 * l) * U + l * off + 0.25 * coefficients.len() as f64 * U);
    }
    sum
}

fn decode(encoding: Encoding, value: f64) -> f64 {
    match encoding {
        Encoding::Depth => value.max(0.0),
        Encoding::Transmittance if value > 0.0 => (-value.ln()).max(0.0),
        Encoding::Reciprocal { epsilon } | Encoding::Lobe { epsilon } if value > 0.0 => {
            (1.0 / value - f64::from(epsilon)).max(0.0)
        }
        _ => f64::INFINITY,
    }
}

/// Size of the terms of which τ is the difference.
fn reciprocal_size(encoding: Encoding, tau: f64) -> f64 {
    match encoding {
        Encoding::Reciprocal { epsilon } | Encoding::Lobe { epsilon } => tau + f64::from(epsilon),
        _ => tau,
    }
}
