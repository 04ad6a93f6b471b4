//! What is drawn together in a frame, and its passes.

use super::lots::{Together, arrange};
use super::sight::{Part, PoolId, Visible};
use super::{HostFrame, HostReport, Picture, Renderer, Seen};
use crate::exact::ExactDepths;
use crate::gpu::bindings::{empty_buffer, most_bound};
use crate::gpu::frame::Object;
use crate::gpu::lot::Lot;
use crate::gpu::pipeline::{Drawn, Pipeline, SplatPath};
use crate::gpu::targets::{PixelState, TOTAL, Targets, budget};
use crate::gpu::tiles::Tile;
use crate::gpu::timers::Timers;
use crate::{Error, Result};
use wgpu::{BufferUsages, CommandEncoder, Device, Queue};

/// Tiles that are drawn together.
struct Job {
    pool: PoolId,
    lot: Lot,
    /// The first of their views.
    view: usize,
    tiles: Vec<Tile>,
}

impl Renderer {
    pub(super) fn record(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        host: &HostFrame<'_>,
    ) -> Result<()> {
        let bytes = 16 * u64::from(host.size[0]) * u64::from(host.size[1]);
        if bytes == 0 || bytes > most_bound(device) {
            let [w, h] = host.size;
            return Err(Error::Host(format!("a picture of {w} x {h} pixels does not fit the device")));
        }
        let (visible, report) = self.visible(device, host)?;
        let HostReport { exact, waiting, .. } = self.report;
        self.report = report;
        // A depth buffer may have changed without a word.
        let frames = visible.iter().map(|v| v.frame.clone()).collect();
        let seen = host.depth.is_none().then_some(Seen { frames, exposure: host.exposure });
        let fits = self.picture.as_ref().is_some_and(|p| p.size == host.size);
        if fits && seen.is_some() && self.seen == seen && !self.is_busy() {
            let still = HostReport { reused: true, tiles: 0, draws: 0, samples: 0, ..self.report };
            self.report = HostReport { exact, waiting, ..still };
            return Ok(());
        }
        self.seen = None;
        if !fits {
            self.picture = Some(self.new_picture(device, host.size));
        }
        self.overlay.write(queue, host.size, host.exposure);
        let parts = self.parts(device, queue, &visible);
        let exact = self.trace(device, &visible, &parts);
        let jobs = self.begin(device, queue, &visible, &parts, &exact, host.size)?;
        self.report.draws = jobs.len();
        let (Some(picture), Some((targets, _))) = (&self.picture, &self.targets) else { return Ok(()) };
        encoder.clear_buffer(&picture.total, 0, None);
        encoder.clear_buffer(&picture.opaque, 0, None);
        if let Some(depth) = host.depth {
            let depth = (depth.view, depth.projection);
            self.limits.record(device, encoder, host.size, depth, &picture.distances);
        }
        let compose = self.compose.bind(device, targets, &picture.total, &picture.opaque);
        let clip = host.depth.map(|_| self.clip.bind(device, &picture.distances, targets));
        let clip = clip.as_ref().map(|group| (&self.clip, group));
        let timers = &mut Timers::off();
        let mut lit = 0;
        for pool in pools_of(jobs.iter().map(|job| job.pool)) {
            lit += self.pipeline(pool).map_or(0, |p| p.record_lighting(encoder, timers));
        }
        for job in &jobs {
            let Some(pipeline) = self.pipeline(job.pool) else { continue };
            pipeline.record_start(encoder, job.lot);
            pipeline.record_ray(encoder, timers, job.view, job.lot, clip);
            for (k, tile) in job.tiles.iter().enumerate() {
                let r = &mut pipeline.recorder(encoder, timers, job.view + k, *tile);
                self.compose.record(r, &compose);
            }
        }
        self.report.lit = lit;
        self.seen = seen;
        Ok(())
    }

    /// Uploads lights and views of all parts, and says what is drawn together.
    fn begin(
        &mut self,
        device: &Device,
        queue: &Queue,
        visible: &[Visible],
        parts: &[Part],
        exact: &[Option<ExactDepths>],
        size: [u32; 2],
    ) -> Result<Vec<Job>> {
        let state = self.pixel_state(visible);
        let picture = u64::from(size[0]) * u64::from(size[1]);
        let most = match self.path {
            SplatPath::Tiles => budget(device, state, TOTAL).pixels().min(picture),
            // They are blended one object after the other.
            SplatPath::Quads => 0,
        };
        let (owners, tiles): (Vec<usize>, Vec<(PoolId, Tile)>) = parts
            .iter()
            .enumerate()
            .flat_map(|(p, part)| visible[part.visible].tiles.iter().map(move |t| (p, (part.pool, *t))))
            .unzip();
        let together = arrange(&tiles, most);
        // At least a pixel where nothing is in sight.
        let least = Lot::from(Tile { start: [0; 2], size: [1; 2] });
        let cut = |t: &Together<PoolId>| self.pipeline(t.kind).map_or(t.lot(), |p| p.cut(t.lot()));
        let needed = together.iter().map(cut).fold(least, Lot::or);
        let targets = self.fit_targets(device, needed, state)?;
        for pool in pools_of(parts.iter().map(|p| p.pool)) {
            let objects: Vec<Object> = parts
                .iter()
                .zip(exact)
                .filter(|(p, _)| p.pool == pool)
                .map(|(p, e)| Object { slot: p.slot, frame: &visible[p.visible].frame, exact: e.as_ref() })
                .collect();
            if let Some(pipeline) = self.pipeline_mut(pool) {
                pipeline.begin_in(device, queue, &objects, &targets)?;
            }
        }
        let mut jobs = Vec::new();
        for Together { kind, members, .. } in together {
            let drawn = |m: &usize| {
                let Part { visible: v, slot, share, .. } = parts[owners[*m]];
                let Visible { frame, per_unit, .. } = &visible[v];
                Drawn { slot, frame, tile: tiles[*m].1, share, per_unit: *per_unit }
            };
            let drawn: Vec<Drawn> = members.iter().map(drawn).collect();
            let Some(pipeline) = self.pipeline_mut(kind) else { continue };
            let (lot, view) = pipeline.add_lot(&drawn);
            jobs.push(Job { pool: kind, lot, view, tiles: drawn.iter().map(|d| d.tile).collect() });
        }
        for pool in pools_of(jobs.iter().map(|job| job.pool)) {
            if let Some(pipeline) = self.pipeline_mut(pool) {
                pipeline.upload_views(device, queue);
            }
        }
        Ok(jobs)
    }

    fn pipeline(&self, id: PoolId) -> Option<&Pipeline> {
        let levels = self.assets.get(id.asset)?.as_ref()?;
        Some(&levels.pools.get(id.level)?.get(id.pool)?.pipeline)
    }

    fn pipeline_mut(&mut self, id: PoolId) -> Option<&mut Pipeline> {
        let levels = self.assets.get_mut(id.asset)?.as_mut()?;
        Some(&mut levels.pools.get_mut(id.level)?.get_mut(id.pool)?.pipeline)
    }

    /// All that objects keep for a pixel.
    fn pixel_state(&self, visible: &[Visible]) -> PixelState {
        let levels = visible.iter().filter_map(|v| self.levels_of(v.instance));
        levels.map(|l| l.pipelines[0].asset.pixel_state()).fold(PixelState::default(), PixelState::or)
    }

    /// Targets that hold every lot and all that objects keep.
    fn fit_targets(&mut self, device: &Device, needed: Lot, state: PixelState) -> Result<Targets> {
        let (mut lot, mut needs) = (needed, state);
        if let Some((targets, known)) = &self.targets {
            if targets.lot.holds(needed) && known.or(state) == *known {
                return Ok(targets.clone());
            }
            (lot, needs) = (targets.lot.or(needed), known.or(state));
        }
        let targets = Targets::allocate(device, needs, lot, self.path, needs.bytes_of(lot))?;
        self.targets = Some((targets.clone(), needs));
        Ok(targets)
    }

    fn new_picture(&self, device: &Device, size: [u32; 2]) -> Picture {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let total = empty_buffer(device, "total", 16 * pixels, usage);
        let opaque = empty_buffer(device, "opaque", 16 * pixels, usage);
        let distances = empty_buffer(device, "distances", 4 * pixels, usage);
        let overlay = self.overlay.bind(device, &total, &opaque);
        Picture { size, total, opaque, distances, overlay }
    }
}

/// Each once.
fn pools_of(ids: impl Iterator<Item = PoolId>) -> Vec<PoolId> {
    let mut ids: Vec<PoolId> = ids.collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}
