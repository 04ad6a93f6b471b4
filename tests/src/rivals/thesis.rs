//! The published recipe (Bernabei's thesis, chapter 3) at the positions and radii of an asset's samples; a sweep gives it
//! samples on layers a constant offset apart, as section 3.2.1 places them.
//!
//!   L = scale · Σ_i v_i ψ_i(view) ∫_{-∞}^{∞} γ_i dt,   v_i = κs(b_i) Σ_l p(cos_l) E_l(b_i) ψ_i(ω_l)
//!
//! ψ_i is stored itself, as a plain least-squares projection onto 25 harmonics in f32; attenuation towards the camera
//! comes from the sample's own harmonics; all kernels weigh the same; a = 2√ln2/(f r) (section 3.3.2); the kernel is
//! integrated over the whole line, √π/a e^{-a²d²}, neither clipped nor normalised, and cut where it falls to 1e-6
//! (section 3.4.2).
//!
//! More is granted than was published: the best width f of a list and the best single scale for each picture, both
//! found by comparing with the reference; the inverse square law, the actual phase function, ψ^{κ_c/κ̄} for coloured
//! extinction, and values of ψ that ring out of 0..1 are clamped.

use super::depths::transmittances;
use super::fit::project;
use super::object::Object;
use super::rays::draw;
use super::tiles;
use diaphane_formats::asset::Asset;
use diaphane_formats::kernel::sharpness;
use diaphane_formats::picture::Picture;
use diaphane_formats::sh::evaluate_f32;
use diaphane_runtime::frame::Frame;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Bands of the thesis: 25 coefficients.
pub const ORDER: usize = 5;

/// Where a kernel is cut.
const CUT_OFF: f32 = 1e-6;

/// Bytes of a sample: position and radius, 25 coefficients, all f32.
pub const BYTES: usize = 4 * 4 + 25 * 4;

/// Width factors that are tried.
pub const FACTORS: [f32; 9] = [0.6, 0.75, 0.9, 1.1, 1.3, 1.55, 1.8, 2.1, 2.5];

/// An asset's samples with what the thesis stores at each.
pub struct Thesis<'a> {
    object: &'a Object<'a>,
    centre: Vec<Vec3>,
    radius: Vec<f32>,
    /// Row-major [sample][coefficient].
    psi: Vec<f32>,
    /// Scattering part of the density at the samples.
    scattering: Vec<f32>,
    /// Seconds that the projection took.
    pub seconds: f64,
}

/// A drawn frame.
pub struct Drawn {
    /// Radiance, before the scale.
    pub picture: Picture,
    /// Kernels that contributed, over all rays that meet the object.
    pub splats_per_ray: f64,
}

/// Working memory of a tile.
struct Candidates {
    /// Centre relative to the camera, and a.
    kernels: Vec<(Vec3, f32)>,
    source: Vec<Vec3>,
}

impl<'a> Thesis<'a> {
    /// Projects ψ of the asset's samples.
    pub fn new(object: &'a Object<'a>, asset: &Asset, directions: usize) -> Self {
        let begun = Instant::now();
        let n = asset.samples.len();
        let centre: Vec<Vec3> = (0..n).map(|i| asset.samples.position(i)).collect();
        let places: Vec<DVec3> = centre.iter().map(|c| object.world(*c)).collect();
        let psi = transmittances(object, &places, directions);
        Self {
            object,
            radius: asset.samples.position_radius.iter().map(|p| p[3]).collect(),
            psi: project(ORDER, &psi.directions, &psi.values),
            scattering: places.iter().map(|p| object.medium.density_and_scattering(*p).1 as f32).collect(),
            centre,
            seconds: begun.elapsed().as_secs_f64(),
        }
    }

    fn psi(&self, i: usize, towards: Vec3) -> f32 {
        let mut basis = [0.0; ORDER * ORDER];
        evaluate_f32(ORDER, towards.to_array(), &mut basis);
        let c = &self.psi[i * ORDER * ORDER..(i + 1) * ORDER * ORDER];
        c.iter().zip(&basis).map(|(c, y)| c * y).sum::<f32>().clamp(0.0, 1.0)
    }

    /// v_i ψ_i(view) of every sample.
    pub fn sources(&self, frame: &Frame) -> Vec<Vec3> {
        let medium = self.object.medium;
        let ratio = self.object.channel_ratio();
        let scattering = (medium.extinction() * medium.albedo()).as_vec3();
        let channels = |psi: f32| Vec3::from(ratio.to_array().map(|r| psi.powf(r)));
        (0..self.centre.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let place = self.centre[i];
                let view = (frame.view.origin - place).normalize_or_zero();
                let mut sum = Vec3::ZERO;
                for light in &frame.lights {
                    let (to, _, irradiance) = light.at(place, frame.least_distance);
                    if irradiance != Vec3::ZERO {
                        let phase = medium.phase().value(f64::from(-to.dot(view))) as f32;
                        sum += irradiance * phase * channels(self.psi(i, to));
                    }
                }
                sum * scattering * self.scattering[i] * channels(self.psi(i, view))
            })
            .collect()
    }

    /// Adds up the kernels of width factor `factor`.
    pub fn splat(&self, frame: &Frame, sources: &[Vec3], factor: f32) -> Drawn {
        let reach = (-CUT_OFF.ln()).sqrt();
        let sharp: Vec<f32> = self.radius.iter().map(|r| sharpness(*r, factor)).collect();
        let balls: Vec<(Vec3, f32)> = self
            .centre
            .iter()
            .zip(&sharp)
            .map(|(c, a)| (*c - frame.view.origin, 1.001 * reach / a))
            .collect();
        let [splats, rays] = [AtomicU64::new(0), AtomicU64::new(0)];
        let open = |tile| {
            let mut chosen = Vec::new();
            tiles::select(frame, tile, &balls, &mut chosen);
            let kernels = chosen.iter().map(|&i| (balls[i as usize].0, sharp[i as usize])).collect();
            Candidates { kernels, source: chosen.iter().map(|&i| sources[i as usize]).collect() }
        };
        let picture = draw(self.object, frame, open, |ray, candidates: &mut Candidates| {
            let mut sum = Vec3::ZERO;
            let mut count = 0;
            for ((centre, a), source) in candidates.kernels.iter().zip(&candidates.source) {
                let across = *centre - ray.direction * centre.dot(ray.direction);
                let x = a * a * across.length_squared();
                if x < reach * reach {
                    sum += *source * line_integral(*a, x);
                    count += 1;
                }
            }
            splats.fetch_add(count, Ordering::Relaxed);
            rays.fetch_add(1, Ordering::Relaxed);
            sum
        });
        let rays = rays.into_inner().max(1);
        Drawn { picture, splats_per_ray: splats.into_inner() as f64 / rays as f64 }
    }
}

/// ∫ e^{-a²(d² + t²)} dt over the whole line, with x = a²d².
fn line_integral(a: f32, x: f32) -> f32 {
    std::f32::consts::PI.sqrt() / a * (-x).exp()
}

/// The scale s ≥ 0 that makes Σ (s I - R)² least over the fully covered pixels; 0 for a black picture.
pub fn best_scale(image: &Picture, reference: &Picture, coverage: &[f32]) -> f64 {
    let (mut cross, mut square) = (0.0, 0.0);
    for ((i, r), _) in
        image.pixels.iter().zip(&reference.pixels).zip(coverage).filter(|(_, c)| f64::from(**c) >= 1.0 - 1e-9)
    {
        for (a, b) in i.iter().zip(r) {
            cross += f64::from(*a) * f64::from(*b);
            square += f64::from(*a) * f64::from(*a);
        }
    }
    if square > 0.0 { (cross / square).max(0.0) } else { 0.0 }
}

/// Every value times `scale`.
pub fn scaled(mut picture: Picture, scale: f64) -> Picture {
    picture.pixels.iter_mut().flatten().for_each(|v| *v = (f64::from(*v) * scale) as f32);
    picture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_integral_is_the_gaussians() {
        for (a, d) in [(0.7f64, 0.0f64), (2.0, 0.4), (11.0, 0.1)] {
            // Midpoint rule over ±8 widths; the trapezoid-like sum of a Gaussian converges faster than any power.
            let h = 16.0 / a / 4000.0;
            let at = |i: u32| (-a * a * (d * d + (h * (f64::from(i) + 0.5) - 8.0 / a).powi(2))).exp();
            let sum: f64 = (0..4000).map(at).sum::<f64>() * h;
            let got = f64::from(line_integral(a as f32, (a * a * d * d) as f32));
            assert!((got / sum - 1.0).abs() < 1e-6, "{a} {d}: {got} {sum}");
        }
    }

    #[test]
    fn the_scale_is_the_best_one() {
        let grey =
            |values: [f32; 3]| Picture { pixels: values.map(|v| [v; 3]).to_vec(), ..Picture::new(3, 1) };
        let (image, reference) = (grey([1.0, 2.0, 50.0]), grey([2.0, 5.0, 0.0]));
        // (1·2 + 2·5) / (1 + 4); the third pixel is at the edge.
        let scale = best_scale(&image, &reference, &[1.0, 1.0, 0.5]);
        assert!((scale - 2.4).abs() < 1e-12);
        assert_eq!(scaled(image, 2.0).pixels[1], [4.0; 3]);
        assert_eq!(best_scale(&grey([0.0; 3]), &reference, &[1.0; 3]), 0.0);
    }
}
