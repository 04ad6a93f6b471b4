//! What a player makes of the samples along the rays.

use super::views::View;
use crate::Result;
use crate::progress::Stage;
use diaphane_formats::asset::Asset;
use diaphane_formats::harmonics::Coefficients;
use diaphane_formats::hits::{Hit, Hits};
use diaphane_formats::reconstruct::{Along, Cloud, Profile};
use diaphane_formats::sh;
use diaphane_formats::slopes::{Source, Stencil};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Inside pieces of a ray that players draw.
const PIECES: usize = 4;

/// An asset ready to be played.
pub(crate) struct Player<'a> {
    asset: &'a Asset,
    cloud: Cloud,
    stencil: Stencil,
    rays: Vec<PlayedRay>,
}

/// A ray in the asset's coordinates, with the kernels that its line meets.
struct PlayedRay {
    origin: Vec3,
    direction: Vec3,
    pieces: Vec<Piece>,
    kernels: Vec<u32>,
}

struct Piece {
    start: f32,
    end: f32,
    /// What attenuates the piece on its way to the camera, per channel.
    before: Vec3,
    along: Along,
}

impl<'a> Player<'a> {
    /// Prepares the rays of all views.
    pub fn new(asset: &'a Asset, views: &[View]) -> Self {
        let cloud = Cloud::new(&asset.samples, asset.info.width_factor);
        let info = &asset.info;
        let most = info.extinction.into_iter().fold(0.0, f64::max) as f32;
        let density = |x: Vec3| asset.density.as_ref().map_or(info.uniform_density as f32, |g| g.value(x)[0]);
        let stencil = Stencil::new(&asset.samples, |x| (most * density(x)).min(1e30));
        let rays: Vec<_> = views.iter().flat_map(|v| v.rays.iter().map(|r| (v.direction, r))).collect();
        let rays = rays
            .into_par_iter()
            .map(|(direction, ray)| {
                let origin = (ray.origin - DVec3::from(info.centre)).as_vec3();
                let mut played = PlayedRay {
                    origin,
                    direction: direction.as_vec3(),
                    pieces: Vec::new(),
                    kernels: Vec::new(),
                };
                let mut before = Vec3::ONE;
                for piece in ray.pieces.iter().take(PIECES) {
                    before *= piece.boundary[0] as f32;
                    let (start, end) = (piece.start as f32, piece.end as f32);
                    if end > start {
                        let along = along(asset, origin, played.direction, start, end);
                        let through = along.transmittance(start, end);
                        played.pieces.push(Piece { start, end, before, along });
                        before *= through;
                    }
                    before *= piece.boundary[1] as f32;
                }
                if let (Some(first), Some(last)) = (played.pieces.first(), played.pieces.last()) {
                    cloud.for_each_near_ray(origin, played.direction, first.start, last.end, |i| {
                        played.kernels.push(i as u32);
                    });
                }
                played
            })
            .collect();
        Self { asset, cloud, stencil, rays }
    }

    /// Radiance of every ray, albedo and phase function left out, for each of `lights` lights, light l in channel l % 3 alone;
    /// `arriving` gives ψβ of a light at a sample for that channel, `means` its share of the correction for means
    /// ([`diaphane_formats::slopes`]).
    pub fn radiance(
        &self,
        lights: usize,
        arriving: impl Fn(usize, usize) -> f32 + Sync,
        means: Vec3,
        stage: Stage<'_>,
    ) -> Result<Vec<Vec<f32>>> {
        let mut out = Vec::with_capacity(lights);
        for first in (0..lights).step_by(3) {
            let channels = (lights - first).min(3);
            let value = |i: usize| {
                let mut v = Vec3::ZERO;
                for c in 0..channels {
                    v[c] = arriving(i, first + c);
                }
                v
            };
            let values: Vec<Vec3> =
                (0..self.asset.samples.len()).into_par_iter().with_min_len(256).map(value).collect();
            let sources = self.stencil.sources(&values, means);
            let radiance: Vec<Vec3> = self
                .rays
                .par_iter()
                .map_init(Hits::default, |hits, ray| self.ray(ray, &sources, hits))
                .collect();
            out.extend((0..channels).map(|c| radiance.iter().map(|r| r[c]).collect()));
            stage.step(channels)?;
        }
        Ok(out)
    }

    fn ray(&self, ray: &PlayedRay, sources: &[Source], hits: &mut Hits) -> Vec3 {
        hits.clear();
        for i in ray.kernels.iter().map(|i| *i as usize) {
            let (a, weight) = (self.cloud.sharpness[i], self.cloud.weight[i]);
            let to_centre = self.cloud.centre[i] - ray.origin;
            if let Some(hit) = Hit::new(to_centre, ray.direction, a, weight, &sources[i]) {
                hits.push(hit);
            }
        }
        let piece = |p: &Piece| p.before * hits.piece_radiance(p.start, p.end, &p.along).radiance;
        ray.pieces.iter().map(piece).sum()
    }
}

fn along(asset: &Asset, origin: Vec3, direction: Vec3, start: f32, end: f32) -> Along {
    let extinction = DVec3::from(asset.info.extinction).as_vec3();
    match &asset.density {
        None => Along::Uniform(extinction * asset.info.uniform_density as f32),
        Some(grid) => {
            Along::Profile(extinction, Box::new(Profile::march(grid, origin, direction, start, end)))
        }
    }
}

/// The asset's own light at its samples, towards fixed directions.
pub(crate) struct Stored<'a> {
    asset: &'a Asset,
    depth: Coefficients,
    boundary: Coefficients,
    /// κ/κ̄ per channel.
    ratio: Vec3,
    /// Directions, and the harmonics there.
    basis: Vec<(Vec3, Vec<f32>)>,
}

impl<'a> Stored<'a> {
    /// Prepares `directions` (unit vectors towards the lights).
    pub fn new(asset: &'a Asset, directions: &[DVec3]) -> Self {
        let order = asset.info.order.max(asset.info.boundary_order) as usize;
        let basis = directions
            .iter()
            .map(|d| {
                let mut basis = vec![0.0; order * order];
                sh::evaluate_f32(order, d.as_vec3().to_array(), &mut basis);
                (d.as_vec3(), basis)
            })
            .collect();
        let reference = asset.info.reference_extinction.max(f64::MIN_POSITIVE);
        Self {
            asset,
            depth: asset.samples.depth.decoded(),
            boundary: asset.samples.boundary.decoded(),
            ratio: (DVec3::from(asset.info.extinction) / reference).as_vec3(),
            basis,
        }
    }

    /// ψβ of sample `i` towards direction `k` for a channel, 0..1.
    pub fn arriving(&self, i: usize, k: usize, channel: usize) -> f32 {
        let (direction, basis) = &self.basis[k];
        let dot = |values: &[f32]| values.iter().zip(basis).map(|(c, y)| c * y).sum::<f32>();
        let through = if self.boundary.is_empty() { 1.0 } else { dot(self.boundary.of(i)).clamp(0.0, 1.0) };
        let lobe = self.asset.samples.lobe.get(i).map_or(0.0, |a| a.dot(*direction).max(0.0));
        let tau = self.asset.info.encoding.decode(dot(self.depth.of(i)) + lobe);
        if tau == f32::INFINITY { 0.0 } else { (-self.ratio[channel] * tau).exp() * through }
    }
}
