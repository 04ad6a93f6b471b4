//! The error certificate: an asset measured on rays and lights that no fit has seen.
//!
//! Each pair of a view and lights is a small picture. The share of interpolation comes from playing some of the lights
//! without harmonics: the exact mean of the transmittance over each sample's cell takes their place.

mod goal;
mod pool;

pub(crate) use goal::Goal;

use crate::field::Shape;
use crate::measure::play::{Player, Stored};
use crate::measure::truth::{Nodes, Radiance};
use crate::measure::views;
use crate::progress::Stage;
use crate::{Prepared, Result};
use diaphane_formats::asset::{self, Asset, Certificate, CertifiedError};
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::medium::Medium;
use diaphane_formats::slopes::means_share;
use glam::{DVec3, Vec3};
use pool::Pictures;
use serde::{Deserialize, Serialize};

/// Directions of view.
const VIEWS: usize = 32;
/// Held-out directions of light, a multiple of the channels.
const LIGHTS: usize = 18;
/// Held-out lights that are played with exact light too: two for each channel, on both sides of the sphere.
const EXACT: [usize; 6] = [0, 4, 8, 9, 13, 17];

fn stream(seed: u64) -> u64 {
    hash(seed, 71)
}

fn lights(seed: u64) -> Vec<DVec3> {
    even_directions(LIGHTS, hash(stream(seed), 2))
}

/// The lights whose exact means over cells are played too: unit vector towards each, and its channel.
pub(crate) fn exact_lights(seed: u64) -> Vec<(DVec3, usize)> {
    let lights = lights(seed);
    EXACT.iter().map(|l| (lights[*l], l % 3)).collect()
}

/// Radiance along the rays, before albedo and phase function, on which neither truth nor player depend otherwise.
#[derive(Serialize, Deserialize)]
pub(crate) struct Measured {
    seed: u64,
    /// Direction and number of rays of each view.
    views: Vec<(DVec3, usize)>,
    truth: Vec<Radiance>,
    played: Vec<Vec<f32>>,
    /// Under the exact lights.
    with_exact_light: Vec<Vec<f32>>,
    /// Of each coarser level under the same lights, which it stores: one level after the other.
    coarser: Vec<Vec<f32>>,
}

/// Plays `packed` with views, rays and lights drawn from `seed`; `exact` holds for each of [`exact_lights`] what arrives
/// at the samples.
pub(crate) fn measure(
    shape: &Shape<'_>,
    medium: &Prepared<'_>,
    exact: &[Vec<f32>],
    packed: &Asset,
    seed: u64,
    stage: Stage<'_>,
) -> Result<Measured> {
    stage.announce(VIEWS + 2 * LIGHTS + EXACT.len() * (1 + packed.levels.len()));
    // As a reader gets it, after all rounding.
    let asset = asset::parse(&asset::encode(packed)?)?;
    stage.step(0)?;
    let views = views::views(shape, medium.medium.ior(), VIEWS, hash(stream(seed), 1), stage)?;
    let lights = lights(seed);
    let nodes = Nodes::new(&views, medium, hash(stream(seed), 3));
    stage.step(0)?;
    let player = Player::new(&asset, &views);
    let truth = nodes.radiance(shape, medium, &lights, stage)?;
    let stored = Stored::new(&asset, &lights);
    let means = means_share(asset.info.ratio());
    let few = EXACT.map(|l| lights[l]);
    let coarser = (1..=asset.levels.len()).map(|k| {
        let level = asset.level(k)?;
        let stored = Stored::new(&level, &few);
        Player::new(&level, &views).radiance(EXACT.len(), |i, l| stored.arriving(i, l, l % 3), means, stage)
    });
    let coarser = coarser.collect::<Result<Vec<_>>>()?.concat();
    Ok(Measured {
        seed,
        views: views.iter().map(|v| (v.direction, v.rays.len())).collect(),
        truth,
        played: player.radiance(LIGHTS, |i, l| stored.arriving(i, l, l % 3), means, stage)?,
        with_exact_light: player.radiance(EXACT.len(), |i, l| exact[l][i], Vec3::ONE, stage)?,
        coarser,
    })
}

impl Measured {
    /// Whether one read from a cache can be that of any bake.
    pub fn fits(&self, seed: u64) -> bool {
        let rays = self.views.iter().try_fold(0usize, |sum, view| sum.checked_add(view.1));
        let whole = |light: &Vec<f32>| Some(light.len()) == rays && light.iter().all(|v| v.is_finite());
        let truth =
            |light: &Radiance| Some(light.len()) == rays && light.iter().flatten().all(|v| v.is_finite());
        self.seed == seed
            && self.views.iter().all(|view| view.0.is_finite())
            && self.truth.len() == LIGHTS
            && self.truth.iter().all(truth)
            && self.played.len() == LIGHTS
            && self.with_exact_light.len() == EXACT.len()
            && self.coarser.len().is_multiple_of(EXACT.len())
            && self.played.iter().chain(&self.with_exact_light).chain(&self.coarser).all(whole)
    }

    /// The certificate for the albedo and phase function of `medium`, and the errors of the coarser levels: they are measured
    /// under fewer lights, and scaled by what all samples show under these.
    pub fn certificate(&self, medium: &Medium) -> (Certificate, Vec<Option<f32>>) {
        let lights = lights(self.seed);
        let pictures = Pictures {
            views: &self.views,
            lights: &lights,
            albedo: medium.albedo(),
            phase: medium.phase(),
            truth: &self.truth,
            played: &self.played,
        };
        let exact_lights = EXACT.map(|l| lights[l]);
        let exact_truth = EXACT.map(|l| self.truth[l].clone());
        let near = Pictures {
            lights: &exact_lights,
            truth: &exact_truth,
            played: &self.with_exact_light,
            ..pictures
        };
        let figures = pictures.figures();
        let with_stored_light = pictures.single(EXACT);
        let coarser = |played: &[Vec<f32>]| {
            let own = Pictures { played, ..near }.single(0..EXACT.len())?;
            let all = with_stored_light.filter(|all| *all > 0.0)?;
            Some((figures.as_ref()?.rel_rmse * (own / all).sqrt()) as f32)
        };
        let levels = self.coarser.chunks(EXACT.len()).map(coarser).collect();
        let error = figures.as_ref().map(|figures| {
            let with_exact_light = near.single(0..EXACT.len());
            let share = match (with_exact_light, with_stored_light) {
                (Some(exact), Some(stored)) if stored > 0.0 => (exact / stored).min(1.0),
                _ => 1.0,
            };
            CertifiedError {
                rel_rmse: figures.rel_rmse,
                psnr_db: figures.psnr_db,
                bias: figures.bias,
                interpolation: figures.rel_rmse * share.sqrt(),
                representation: figures.rel_rmse * (1.0 - share).sqrt(),
            }
        });
        let rays = self.views.iter().map(|v| v.1 as u32).sum();
        let certificate =
            Certificate { error, rays, views: VIEWS as u32, lights: LIGHTS as u32, seed: self.seed };
        (certificate, levels)
    }
}
