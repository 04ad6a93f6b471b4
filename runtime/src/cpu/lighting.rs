//! Light that each sample scatters towards the camera.
//!
//! Per channel, with E_l the irradiance and ω_l the direction of light l at the sample's centroid b, Ω the albedo:
//!
//!   v(b) = Ω Σ_l p(cos_l) E_l(b) ψ(b, ω_l) β(b, ω_l),   cos_l = dot(-ω_l, normalize(camera - b))
//!
//! v is in-scattered radiance per unit of κt dt, albedo included; with its slopes ([`diaphane_formats::slopes`]) it is
//! the source of [`diaphane_formats::reconstruct`].
//! ψ = exp(-κ/κ̄ · τ̄) with τ̄ decoded from the sample's spherical harmonics and lobe (κ̄ = 0: ψ = 1); bands that a sample
//! does not have cost nothing. β is the boundary's
//! Fresnel transmittance from its own coefficients, clamped to 0..1 (index matched: 1). A table of exact depths m
//! gives ψ = exp(-κ m) and β instead. Lights that do not reach the sample (outside a spot's cone) are skipped; many
//! directional lights are folded into one vector ([`crate::fold`]).

use crate::exact::ExactDepths;
use crate::fold::{Ambient, LightCounts, Linear, Plan, linear};
use crate::frame::{Frame, FrameLight, LightKind};
use diaphane_formats::asset::{Info, Samples};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::harmonics::Coefficients;
use diaphane_formats::phase::henyey_greenstein_f32;
use diaphane_formats::sh::{self, MAX_ORDER, coefficient_count};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::OnceLock;

/// What the lighting pass needs of an asset beside the samples themselves.
#[derive(Clone, Debug)]
pub struct Lighting {
    /// κ at density 1, per channel.
    extinction: Vec3,
    /// κ/κ̄ per channel; `None` when κ̄ is 0.
    ratio: Option<Vec3>,
    albedo: Vec3,
    /// Mean cosine of the phase function.
    g: f32,
    encoding: Encoding,
    /// Highest order of any sample.
    order: usize,
    depth: Coefficients,
    /// Empty unless the encoding has lobes.
    lobe: Vec<Vec3>,
    /// Empty when index matched.
    boundary: Coefficients,
    /// Transmittance for folded lights, once it was asked for.
    linear: OnceLock<Linear>,
}

/// A light with the basis of its direction, where that is the same for all samples.
struct Prepared<'a> {
    light: &'a FrameLight,
    basis: Option<Vec<f32>>,
    exact: Option<&'a [[f32; 2]]>,
}

impl Lighting {
    /// Parameters and samples of an asset.
    pub fn new(info: &Info, samples: &Samples) -> Self {
        let mut lighting = Self {
            extinction: Vec3::ZERO,
            ratio: None,
            albedo: Vec3::ZERO,
            g: info.phase.mean_cosine() as f32,
            encoding: info.encoding,
            order: info.order.max(info.boundary_order) as usize,
            depth: samples.depth.decoded(),
            lobe: samples.lobe.clone(),
            boundary: samples.boundary.decoded(),
            linear: OnceLock::new(),
        };
        lighting.set_material(info);
        lighting
    }

    /// Takes extinction and albedo from an edited asset's parameters.
    pub fn set_material(&mut self, info: &Info) {
        self.extinction = DVec3::from(info.extinction).as_vec3();
        let ratio = (info.reference_extinction > 0.0).then(|| info.ratio());
        if ratio != self.ratio {
            self.linear = OnceLock::new();
        }
        self.ratio = ratio;
        self.albedo = DVec3::from(info.albedo).as_vec3();
    }

    /// v of every sample at its centroid, in the samples' order, under the lights of `plan`; parallel over samples.
    pub fn values(
        &self,
        samples: &Samples,
        frame: &Frame,
        exact: Option<&ExactDepths>,
        plan: &Plan,
    ) -> Vec<Vec3> {
        let lights: Vec<Prepared> = plan
            .single
            .iter()
            .filter_map(|l| frame.lights.get(*l).map(|light| self.prepare(*l, light, samples, exact)))
            .collect();
        let folded = (!plan.folded.is_empty()).then(|| {
            let lights = plan.folded.iter().filter_map(|l| frame.lights.get(*l));
            let linear = self.linear(linear::BANDS);
            (linear, Ambient::new(lights, self.g, frame.view.origin, linear.bands))
        });
        let most = Vec3::splat(frame.most_source());
        (0..samples.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let mut value = self.source(samples, i, frame, &lights);
                if let Some((linear, ambient)) = &folded {
                    value += self.albedo * from_folded(linear, ambient, i, frame.view.origin, samples);
                }
                value.min(most)
            })
            .collect()
    }

    /// Numbers of a plan.
    pub fn counts(&self, plan: &Plan) -> LightCounts {
        plan.counts(self.linear.get().map_or(0.0, |l| l.error))
    }

    /// Highest order of any sample.
    pub fn order(&self) -> usize {
        self.order
    }

    /// 1 where the transmittance of all channels is the same, else 3.
    pub fn channels(&self) -> usize {
        if self.ratio.is_none_or(|r| r.x == r.y && r.y == r.z) { 1 } else { 3 }
    }

    /// The transmittance of all samples as harmonics of `bands` bands; made when first asked for.
    pub fn linear(&self, bands: usize) -> &Linear {
        self.linear.get_or_init(|| {
            let channels = self.channels();
            Linear::new(self.depth.len(), bands, channels, self.order, |i, to, basis| {
                self.arriving(i, to, basis)
            })
        })
    }

    fn prepare<'a>(
        &self,
        index: usize,
        light: &'a FrameLight,
        samples: &Samples,
        exact: Option<&'a ExactDepths>,
    ) -> Prepared<'a> {
        let table = exact.and_then(|e| e.light(index)).filter(|t| t.len() == samples.len());
        let basis = (light.kind == LightKind::Directional).then(|| {
            let mut basis = vec![0.0; coefficient_count(self.order)];
            sh::evaluate_f32(self.order, (-light.direction).to_array(), &mut basis);
            basis
        });
        Prepared { light, basis, exact: table }
    }

    fn source(&self, samples: &Samples, i: usize, frame: &Frame, lights: &[Prepared]) -> Vec3 {
        let place = samples.centroid(i);
        let towards_camera = (frame.view.origin - place).normalize_or_zero();
        // Only the bands that this sample has.
        let boundary_order = self.boundary.order.get(i).copied().unwrap_or(0);
        let order = usize::from(self.depth.order[i].max(boundary_order));
        let mut scratch = [0.0; MAX_ORDER * MAX_ORDER];
        let mut sum = Vec3::ZERO;
        for prepared in lights {
            let (to, _, irradiance) = prepared.light.at(place, frame.least_distance);
            if irradiance == Vec3::ZERO {
                continue;
            }
            let arriving = match prepared.exact {
                Some(table) => {
                    let [length, boundary] = table[i];
                    (-self.extinction * length).exp() * boundary
                }
                None => {
                    let basis: &[f32] = match &prepared.basis {
                        Some(basis) => basis,
                        None => {
                            sh::evaluate_f32(order, to.to_array(), &mut scratch);
                            &scratch
                        }
                    };
                    self.arriving(i, to, basis)
                }
            };
            let g = self.g.clamp(-prepared.light.most_cosine, prepared.light.most_cosine);
            sum += irradiance * arriving * henyey_greenstein_f32(g, -to, towards_camera).0;
        }
        sum * self.albedo
    }

    /// ψ β of sample `i` in direction `to`, per channel, 0..1.
    pub(crate) fn arriving(&self, i: usize, to: Vec3, basis: &[f32]) -> Vec3 {
        let through =
            if self.boundary.is_empty() { 1.0 } else { dot(self.boundary.of(i), basis).clamp(0.0, 1.0) };
        let Some(ratio) = self.ratio else {
            return Vec3::splat(through);
        };
        let lobe = self.lobe.get(i).map_or(0.0, |a| a.dot(to).max(0.0));
        let tau = self.encoding.decode(dot(self.depth.of(i), basis) + lobe);
        if tau == f32::INFINITY || through == 0.0 {
            return Vec3::ZERO;
        }
        if ratio == Vec3::ONE { Vec3::splat((-tau).exp() * through) } else { (-ratio * tau).exp() * through }
    }
}

/// What all folded lights together send from sample `i` towards the camera at `origin`, for albedo 1.
fn from_folded(linear: &Linear, ambient: &Ambient, i: usize, origin: Vec3, samples: &Samples) -> Vec3 {
    let deviation = ambient.deviation(origin, samples.centroid(i));
    let of = linear.of(i);
    let mut sum = Vec3::ZERO;
    for k in 0..ambient.count {
        let through = match linear.channels {
            1 => Vec3::splat(of[k]),
            _ => Vec3::new(of[k], of[ambient.count + k], of[2 * ambient.count + k]),
        };
        sum += through * ambient.at(deviation, k);
    }
    sum.max(Vec3::ZERO)
}

/// Over the length of `a`; four running sums keep the additions independent of each other.
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let b = &b[..a.len()];
    let mut sums = [0.0f32; 4];
    let ((head_a, tail_a), (head_b, tail_b)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    for (x, y) in head_a.iter().zip(head_b) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    let tail: f32 = tail_a.iter().zip(tail_b).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}
