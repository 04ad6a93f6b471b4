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
//! gives ψ = exp(-κ m) and β instead, a correction on its way is added to ψβ. Lights that do not reach the sample (outside a
//! spot's cone) or bring next to nothing beside those before them are skipped; many directional lights are folded into
//! one vector ([`crate::fold`]).

use crate::exact::{ExactDepths, Known};
use crate::fold::{Ambient, LightCounts, Linear, PORTION, Plan, linear};
use crate::frame::{Frame, FrameLight, LightKind};
use diaphane_formats::asset::{Info, Samples};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::harmonics::Coefficients;
use diaphane_formats::phase::henyey_greenstein_f32;
use diaphane_formats::sh::{self, MAX_ORDER, coefficient_count};
use glam::{DVec3, Vec3};
use half::f16;
use rayon::prelude::*;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

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
    known: Option<&'a Known>,
    /// Whether its baked light is evaluated here and not folded.
    baked: bool,
}

/// The lights that every sample evaluates.
struct Single<'a> {
    lights: Vec<Prepared<'a>>,
    /// How many of them, in front, stand for an environment.
    environment: usize,
    /// [`Plan::negligible`].
    negligible: f32,
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

    /// v of every sample at its centroid, in the samples' order, under the lights of `plan`; parallel over samples. And the
    /// share of samples times lights that brought next to nothing and was skipped.
    pub fn values(
        &self,
        samples: &Samples,
        frame: &Frame,
        exact: Option<&ExactDepths>,
        plan: &Plan,
    ) -> (Vec<Vec3>, f32) {
        let prepare = |l: &usize| {
            let light = frame.lights.get(*l)?;
            Some(self.prepare(light, exact.and_then(|e| e.known(*l)), samples, !plan.is_folded(*l)))
        };
        let lights: Vec<Prepared> = plan.order.iter().filter_map(prepare).collect();
        let single = Single { lights, environment: plan.environment, negligible: plan.negligible };
        let skipped = AtomicU64::new(0);
        let folded = (!plan.folded.is_empty()).then(|| {
            let lights = plan.folded.iter().filter_map(|l| frame.lights.get(*l));
            let linear = self.linear(linear::BANDS);
            (linear, Ambient::new(lights, self.g, frame.view.origin, linear.bands))
        });
        let most = Vec3::splat(frame.most_source());
        let values = (0..samples.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let (mut value, left_out) = self.source(samples, i, frame, &single);
                if left_out > 0 {
                    skipped.fetch_add(left_out, Ordering::Relaxed);
                }
                if let Some((linear, ambient)) = &folded {
                    value += self.albedo * from_folded(linear, ambient, i, frame.view.origin, samples);
                    // Corrections of folded lights may be negative.
                    value = value.max(Vec3::ZERO);
                }
                value.min(most)
            })
            .collect();
        let all = (samples.len() * single.lights.len()).max(1) as f32;
        (values, skipped.into_inner() as f32 / all)
    }

    /// Numbers of a plan.
    pub fn counts(&self, plan: &Plan, negligible_share: f32) -> LightCounts {
        plan.counts(self.linear.get().map_or(0.0, |l| l.error), Some(negligible_share))
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
        light: &'a FrameLight,
        known: Option<&'a Known>,
        samples: &Samples,
        baked: bool,
    ) -> Prepared<'a> {
        let fits = |known: &&Known| match known {
            Known::Exact(depths) => depths.values().len() == samples.len(),
            Known::Corrected { by, .. } => by.values().len() == samples.len(),
        };
        let basis = (light.kind == LightKind::Directional).then(|| {
            let mut basis = vec![0.0; coefficient_count(self.order)];
            sh::evaluate_f32(self.order, (-light.direction).to_array(), &mut basis);
            basis
        });
        Prepared { light, basis, known: known.filter(fits), baked }
    }

    /// v of sample `i`, and how many lights were skipped.
    fn source(&self, samples: &Samples, i: usize, frame: &Frame, single: &Single) -> (Vec3, u64) {
        let place = samples.centroid(i);
        let towards_camera = (frame.view.origin - place).normalize_or_zero();
        let mut scratch = [0.0; MAX_ORDER * MAX_ORDER];
        let mut sum = Vec3::ZERO;
        // Lights skipped, and the most that those of this portion can bring.
        let (mut skipped, mut left_out) = (0, 0.0);
        for (k, prepared) in single.lights.iter().enumerate() {
            if k.is_multiple_of(PORTION) {
                left_out = 0.0;
            }
            let (to, _, irradiance) = prepared.light.at(place, frame.least_distance);
            if irradiance == Vec3::ZERO {
                continue;
            }
            let g = self.g.clamp(-prepared.light.most_cosine, prepared.light.most_cosine);
            let phase = henyey_greenstein_f32(g, -to, towards_camera).0;
            if single.negligible > 0.0 && k >= single.environment && prepared.known.is_none() {
                let with_this = left_out + irradiance.max_element() * phase;
                if with_this <= single.negligible * sum.max_element() {
                    (left_out, skipped) = (with_this, skipped + 1);
                    continue;
                }
            }
            let arriving = match prepared.known {
                Some(Known::Exact(depths)) => self.through(depths.values()[i]),
                known => {
                    let baked = match &prepared.basis {
                        _ if !prepared.baked => Vec3::ZERO,
                        Some(basis) => self.arriving(i, to, basis),
                        None => self.arriving_by(i, to, &mut scratch),
                    };
                    match known {
                        Some(Known::Corrected { by, share }) => {
                            let [r, g, b, _] = by.values()[i].map(f16::to_f32);
                            let corrected = baked + *share * Vec3::new(r, g, b);
                            if prepared.baked { corrected.clamp(Vec3::ZERO, Vec3::ONE) } else { corrected }
                        }
                        _ => baked,
                    }
                }
            };
            sum += irradiance * arriving * phase;
        }
        (sum * self.albedo, skipped)
    }

    /// ψ β from an exact depth [m, β], per channel, 0..1.
    pub(crate) fn through(&self, [length, boundary]: [f32; 2]) -> Vec3 {
        (-self.extinction * length).exp() * boundary
    }

    /// The baked ψ β of sample `i` in the unit direction `to`, per channel, 0..1.
    pub(crate) fn arriving_from(&self, i: usize, to: Vec3) -> Vec3 {
        self.arriving_by(i, to, &mut [0.0; MAX_ORDER * MAX_ORDER])
    }

    /// The same, with room for the harmonics: only the bands that this sample has are evaluated.
    fn arriving_by(&self, i: usize, to: Vec3, scratch: &mut [f32; MAX_ORDER * MAX_ORDER]) -> Vec3 {
        let boundary_order = self.boundary.order.get(i).copied().unwrap_or(0);
        let order = usize::from(self.depth.order[i].max(boundary_order));
        sh::evaluate_f32(order, to.to_array(), scratch);
        self.arriving(i, to, scratch)
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
