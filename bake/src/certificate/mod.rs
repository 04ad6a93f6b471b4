//! The error certificate: an asset measured on rays and lights that no fit has seen.
//!
//! Each pair of a view and lights is a small picture. The share of interpolation comes from playing some of the lights
//! without harmonics: the exact mean of the transmittance over each sample's cell takes their place.

mod goal;
mod pool;

pub(crate) use goal::Goal;

use crate::field::Shape;
use crate::fit::Cells;
use crate::measure::play::{Player, Stored};
use crate::measure::truth::Nodes;
use crate::measure::{exact, views};
use crate::progress::Stage;
use crate::{Prepared, Result};
use diaphane_formats::asset::{self, Asset, Certificate, CertifiedError};
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::slopes::means_share;
use glam::Vec3;
use pool::Pictures;

/// Directions of view.
const VIEWS: usize = 32;
/// Held-out directions of light, a multiple of the channels.
const LIGHTS: usize = 18;
/// Held-out lights that are played with exact light too: two for each channel, on both sides of the sphere.
const EXACT: [usize; 6] = [0, 4, 8, 9, 13, 17];

/// Measures `packed` with views, rays and lights drawn from `seed`.
pub(crate) fn measure(
    shape: &Shape<'_>,
    medium: &Prepared<'_>,
    cells: &Cells,
    packed: &Asset,
    seed: u64,
    stage: Stage<'_>,
) -> Result<Certificate> {
    stage.announce(VIEWS + 2 * (LIGHTS + EXACT.len()));
    // As a reader gets it, after all rounding.
    let asset = asset::parse(&asset::encode(packed)?)?;
    let stream = hash(seed, 71);
    let views = views::views(shape, medium.medium.ior(), VIEWS, hash(stream, 1), stage)?;
    let rays = views.iter().map(|v| v.rays.len() as u32).sum();
    let lights = even_directions(LIGHTS, hash(stream, 2));
    let nodes = Nodes::new(&views, medium, hash(stream, 3));
    let player = Player::new(&asset, &views);

    let truth = nodes.radiance(shape, medium, &lights, stage)?;
    let means = means_share(asset.info.ratio());
    let stored = Stored::new(&asset, &lights);
    let played = player.radiance(LIGHTS, |i, l| stored.arriving(i, l, l % 3), means, stage)?;
    let pictures =
        Pictures { views: &views, lights: &lights, phase: asset.info.phase, truth: &truth, played: &played };

    let exact = exact::means(shape, medium, cells, &EXACT.map(|l| (lights[l], l % 3)), stage)?;
    let played = player.radiance(EXACT.len(), |i, l| exact[l][i], Vec3::ONE, stage)?;
    let exact_lights = EXACT.map(|l| lights[l]);
    let exact_truth = EXACT.map(|l| truth[l].clone());
    let near = Pictures { lights: &exact_lights, truth: &exact_truth, played: &played, ..pictures };

    let error = pictures.figures().map(|figures| {
        let with_exact_light = near.single(0..EXACT.len());
        let with_stored_light = pictures.single(EXACT);
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
    Ok(Certificate { error, rays, views: VIEWS as u32, lights: LIGHTS as u32, seed })
}
