//! One asset on the bench: what its drawings share is made when the first of them needs it.

use super::run::Wanted;
use anyhow::Context;
use diaphane_formats::scene::Scene;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::{Backend, Player};
use validation::rivals::grid::Grid;
use validation::rivals::march::March;
use validation::rivals::object::Object;
use validation::rivals::shadows::Shadows;
use validation::rivals::thesis::{self, Thesis};
use validation::sweep::case::Case;
use validation::sweep::measure::{self, Made, Shot};
use validation::sweep::plan::Baked;
use validation::sweep::record::{Method, Outcome};
use validation::sweep::references::Known;

/// An asset, the object it was baked from, and what rivals store in its place.
pub struct Bench<'a> {
    case: &'a Case,
    seed: u64,
    made: &'a Made,
    baked: Baked,
    object: &'a Object<'a>,
    frames: usize,
    players: [Option<Player>; 2],
    thesis: Option<Published<'a>>,
    grid: Option<Grid>,
    shadows: Option<Shadows<'a>>,
}

/// The published recipe at the places that it chooses.
struct Published<'a> {
    thesis: Thesis<'a>,
    samples: usize,
    seconds: f64,
}

/// Size and making of what was drawn.
struct Stored {
    light_bytes: usize,
    sample_bytes: f64,
    seconds: f64,
}

impl<'a> Bench<'a> {
    /// `made` is what was baked of `case` with `seed`, nothing else is made yet; a median is taken over `frames` frames.
    pub fn new(
        (case, seed): (&'a Case, u64),
        made: &'a Made,
        baked: Baked,
        object: &'a Object<'a>,
        frames: usize,
    ) -> Self {
        let players = [None, None];
        Self { case, seed, made, baked, object, frames, players, thesis: None, grid: None, shadows: None }
    }

    /// Makes one measurement.
    pub fn measure(&mut self, wanted: &Wanted, scene: &Scene, reference: &Known) -> anyhow::Result<Outcome> {
        let mut adapter = format!("{} threads", rayon::current_num_threads());
        let (shot, stored) = match wanted.drawing.method {
            Method::Splats => {
                let (shot, name) = self.splats(wanted, scene)?;
                adapter = name;
                (shot, self.asset_stored())
            }
            Method::Thesis => self.thesis(scene, reference)?,
            Method::March => self.march(wanted.drawing.steps, scene)?,
            Method::Grid => self.grid(wanted.drawing.steps, scene, reference)?,
        };
        let metrics = measure::judge(&shot.picture, reference)?;
        Ok(Outcome {
            bytes: self.made.shared_bytes + stored.light_bytes,
            light_bytes: stored.light_bytes,
            bytes_per_sample: stored.sample_bytes,
            bake_s: stored.seconds,
            frame_ms: shot.frame_ms,
            splats_per_ray: shot.splats_per_ray,
            rel_rmse: metrics.rel_rmse,
            psnr_db: metrics.psnr_db.is_finite().then_some(metrics.psnr_db),
            bias: metrics.bias,
            p99_rel: metrics.p99_rel,
            non_finite: metrics.non_finite,
            reference_noise: reference.noise,
            adapter,
            note: shot.note,
        })
    }

    fn splats(&mut self, wanted: &Wanted, scene: &Scene) -> anyhow::Result<(Shot, String)> {
        let (slot, backend) = if wanted.gpu { (1, Backend::Gpu) } else { (0, Backend::Cpu) };
        let player = match &mut self.players[slot] {
            Some(player) => player,
            empty => empty.insert(Player::new(&self.made.asset, backend)?),
        };
        let shot = measure::splats(player, scene, self.frames)?;
        Ok((shot, player.describe().1))
    }

    fn asset_stored(&self) -> Stored {
        let samples = self.made.asset.samples.len() as f64;
        Stored {
            light_bytes: (samples * self.made.sample_bytes).round() as usize,
            sample_bytes: self.made.sample_bytes,
            seconds: self.made.seconds,
        }
    }

    fn frame(&self, scene: &Scene) -> anyhow::Result<Frame> {
        Ok(Frame::new(scene, &self.made.asset.info)?)
    }

    fn thesis(&mut self, scene: &Scene, reference: &Known) -> anyhow::Result<(Shot, Stored)> {
        let frame = self.frame(scene)?;
        let published = match &self.thesis {
            Some(published) => published,
            None => {
                let placed = measure::place_as_published(self.case, self.baked.samples, self.seed)?;
                let thesis = Thesis::new(self.object, &placed.asset, self.baked.directions);
                let seconds = placed.placing_seconds + thesis.seconds;
                self.thesis.insert(Published { thesis, samples: placed.asset.samples.len(), seconds })
            }
        };
        let shot = measure::recipe(&published.thesis, &frame, reference, self.frames)?;
        let stored = Stored {
            light_bytes: published.samples * thesis::BYTES,
            sample_bytes: thesis::BYTES as f64,
            seconds: published.seconds,
        };
        Ok((shot, stored))
    }

    fn march(&mut self, steps: usize, scene: &Scene) -> anyhow::Result<(Shot, Stored)> {
        let frame = self.frame(scene)?;
        let object = self.object;
        let light = &*self.shadows.get_or_insert_with(|| Shadows::new(object));
        let shot = measure::march(&March { object, steps, light }, &frame, self.frames)?;
        Ok((shot, Stored { light_bytes: 0, sample_bytes: 0.0, seconds: 0.0 }))
    }

    fn grid(&mut self, steps: usize, scene: &Scene, reference: &Known) -> anyhow::Result<(Shot, Stored)> {
        let frame = self.frame(scene)?;
        let grid = match &mut self.grid {
            Some(grid) => grid,
            empty => {
                let made = measure::grid(self.object, self.made, &self.baked);
                empty.insert(made.context("the object has no room for a node of a grid")?)
            }
        };
        let shot = measure::through_grid(self.object, grid, steps, &frame, reference, self.frames)?;
        let stored = Stored {
            light_bytes: (grid.stored as f64 * self.made.function_bytes) as usize,
            sample_bytes: self.made.function_bytes,
            seconds: grid.seconds,
        };
        Ok((shot, stored))
    }
}
