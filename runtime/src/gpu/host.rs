//! The renderer for programs that own device, targets and frame: many objects beside their own opaque geometry.
//!
//! ```text
//! host: opaque geometry -> colour, depth
//! prepare: [limits] lighting then, lot by lot from the front: surface .. segments [clip] gather, compose
//! render: overlay in the host's render pass
//! ```
//!
//! A lot is one large object, or several small ones with the same samples ([`lots`], [`pools`]), which tiles draw together.
//! Objects attenuate what lies behind them, the host's colours and each other, and cast no shadows on each other. They are
//! ordered by the distance of their centres; where two run through each other the nearer one counts as in front altogether.

mod interface;
mod lots;
mod pools;

pub use interface::{HostDepth, HostFrame, HostReport, Options};

use super::bindings::empty_buffer;
use super::faults::allocate;
use super::frame::{Object, common_layout};
use super::lot::Lot;
use super::passes::clip::Clip;
use super::passes::compose::Compose;
use super::passes::limits::Limits;
use super::passes::overlay::Overlay;
use super::pipeline::{Drawn, Pipeline, SplatPath};
use super::targets::{PixelState, TOTAL, Targets, budget};
use super::tiles::{Tile, split};
use super::timers::Timers;
use crate::detail::{Choice, Detail, Fineness, details, pixels_at_nearest};
use crate::edit::Edit;
use crate::frame::Frame;
use crate::placement::{Placement, covered};
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info};
use lots::{Together, arrange};
use pools::Pools;
use wgpu::{
    BindGroup, Buffer, BufferUsages, Color, CommandEncoder, Device, Features, LoadOp, Operations, Queue,
    RenderPass, RenderPassColorAttachment, RenderPassDescriptor, StoreOp, TextureView,
};

/// An asset of a [`Renderer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AssetId(usize);

/// An object of a [`Renderer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstanceId(usize);

struct Instance {
    asset: usize,
    placement: Placement,
    /// As they are played.
    info: Info,
}

/// An asset: its levels, level 0 first, what is known of them, and what draws objects with them.
struct Levels {
    pipelines: Vec<Pipeline>,
    details: Vec<Detail>,
    pools: Vec<Pools>,
}

/// Buffers of the size of the picture.
struct Picture {
    size: [u32; 2],
    total: Buffer,
    opaque: Buffer,
    distances: Buffer,
    overlay: BindGroup,
}

/// What the last picture shows.
#[derive(PartialEq)]
struct Seen {
    frames: Vec<Frame>,
    exposure: f32,
}

/// Draws assets with a device that somebody else owns. No feature is needed; [`Self::FEATURES`] make it faster.
pub struct Renderer {
    overlay: Overlay,
    compose: Compose,
    clip: Clip,
    limits: Limits,
    path: SplatPath,
    fineness: Fineness,
    assets: Vec<Option<Levels>>,
    instances: Vec<Option<Instance>>,
    targets: Option<(Targets, PixelState)>,
    picture: Option<Picture>,
    seen: Option<Seen>,
    report: HostReport,
}

/// An object that is in sight.
struct Visible {
    instance: usize,
    choice: Choice,
    frame: Frame,
    tiles: Vec<Tile>,
    /// Its units of a world unit.
    per_unit: f32,
}

/// Which pool draws something: of an asset, a level, one of its pools.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct PoolId {
    asset: usize,
    level: usize,
    pool: usize,
}

/// A level of an object that is in sight, by its place among these.
struct Part {
    visible: usize,
    pool: PoolId,
    slot: usize,
    /// See view.wgsl.
    share: f32,
}

/// Tiles that are drawn together.
struct Job {
    pool: PoolId,
    lot: Lot,
    /// The first of their views.
    view: usize,
    tiles: Vec<Tile>,
}

impl Renderer {
    /// What a host may ask its adapter for, as far as it has it: lanes that talk, which make tiles faster, and blending of 32-bit
    /// floats, which software adapters draw faster with.
    pub const FEATURES: Features = Features::SUBGROUP.union(Features::FLOAT32_BLENDABLE);

    /// Compiles what all objects share.
    ///
    /// # Errors
    /// Quads where the device cannot blend 32-bit floats.
    pub fn new(device: &Device, options: Options) -> Result<Self> {
        let common = common_layout(device);
        Ok(Self {
            overlay: Overlay::new(device, &options),
            compose: Compose::new(device, &common),
            clip: Clip::new(device, &common),
            limits: Limits::new(device),
            path: options.path.unwrap_or_else(|| SplatPath::best(device)).checked(device)?,
            fineness: options.fineness,
            assets: Vec::new(),
            instances: Vec::new(),
            targets: None,
            picture: None,
            seen: None,
            report: HostReport::default(),
        })
    }

    /// Uploads an asset.
    ///
    /// # Errors
    /// An asset that makes no sense or is too large for the device.
    pub fn add_asset(&mut self, device: &Device, asset: &Asset) -> Result<AssetId> {
        // Nothing is compiled that an asset of the same kind has.
        let known = self.assets.iter().flatten().find_map(|l| {
            let all = l.pipelines.first()?;
            all.asset.compiles_as(asset).then_some(all)
        });
        let all = match known {
            Some(all) => all.level(device, asset)?,
            None => Pipeline::new(device, asset, self.path)?,
        };
        let coarser = (1..asset.level_sizes().len())
            .map(|k| all.level(device, &asset.level(k)?))
            .collect::<Result<Vec<_>>>()?;
        let mut pipelines: Vec<Pipeline> = std::iter::once(all).chain(coarser).collect();
        // Nobody asks for the census.
        pipelines.iter_mut().for_each(|p| p.counting = false);
        let pools = pipelines.iter().map(|_| Pools::default()).collect();
        self.assets.push(Some(Levels { pipelines, details: details(asset), pools }));
        Ok(AssetId(self.assets.len() - 1))
    }

    /// Forgets an asset and all its instances.
    pub fn remove_asset(&mut self, id: AssetId) {
        if let Some(asset) = self.assets.get_mut(id.0) {
            *asset = None;
        }
        self.instances
            .iter_mut()
            .filter(|i| i.as_ref().is_some_and(|i| i.asset == id.0))
            .for_each(|i| *i = None);
        self.seen = None;
    }

    /// Puts an asset somewhere.
    ///
    /// # Errors
    /// An asset that is not there, a placement that makes no sense.
    pub fn add_instance(&mut self, asset: AssetId, placement: Placement) -> Result<InstanceId> {
        placement.validate()?;
        let levels = self.assets.get(asset.0).and_then(Option::as_ref).ok_or_else(|| missing("asset"))?;
        let info = levels.pipelines[0].asset.info.clone();
        self.seen = None;
        self.instances.push(Some(Instance { asset: asset.0, placement, info }));
        Ok(InstanceId(self.instances.len() - 1))
    }

    /// Puts an object somewhere else.
    ///
    /// # Errors
    /// An object that is not there, a placement that makes no sense.
    pub fn place(&mut self, id: InstanceId, placement: Placement) -> Result<()> {
        placement.validate()?;
        self.instance_mut(id)?.placement = placement;
        Ok(())
    }

    /// Gives an object another extinction and albedo, relative to those that were baked.
    ///
    /// # Errors
    /// An object that is not there, values out of range.
    pub fn edit(&mut self, id: InstanceId, edit: &Edit) -> Result<()> {
        let asset = self.instance_mut(id)?.asset;
        let baked = self.assets.get(asset).and_then(Option::as_ref).ok_or_else(|| missing("asset"))?;
        let info = edit.apply(&baked.pipelines[0].asset.info)?;
        self.instance_mut(id)?.info = info;
        self.release(id);
        Ok(())
    }

    /// Takes an object away.
    pub fn remove_instance(&mut self, id: InstanceId) {
        self.release(id);
        if let Some(instance) = self.instances.get_mut(id.0) {
            *instance = None;
        }
    }

    /// Forgets what was made for an object.
    fn release(&mut self, id: InstanceId) {
        if let Some(Some(instance)) = self.instances.get(id.0)
            && let Some(Some(levels)) = self.assets.get_mut(instance.asset)
        {
            levels.pools.iter_mut().for_each(|pools| pools.release(id.0));
        }
        self.seen = None;
    }

    fn instance_mut(&mut self, id: InstanceId) -> Result<&mut Instance> {
        self.instances.get_mut(id.0).and_then(Option::as_mut).ok_or_else(|| missing("object"))
    }

    /// What the last frame took.
    pub fn report(&self) -> HostReport {
        self.report
    }

    /// Records all passes of a frame but the overlay. Call it when the commands before it have drawn the depth buffer.
    ///
    /// # Errors
    /// A picture without pixels or too large for the device or its memory; lights that are. The encoder is then of no use any
    /// more. The host hears of a lost device itself, and makes everything anew.
    pub fn prepare(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        host: &HostFrame<'_>,
    ) -> Result<()> {
        let [w, h] = host.size;
        let what = || format!("a picture of {w} x {h} pixels");
        let done = allocate(device, what, || self.record(device, queue, encoder, host));
        if done.is_err() {
            // Whatever was made for this frame may be without memory.
            (self.targets, self.picture, self.seen) = (None, None, None);
            self.assets.iter_mut().flatten().for_each(|l| l.pools.iter_mut().for_each(|p| *p = Pools::default()));
        }
        done
    }

    fn record(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        host: &HostFrame<'_>,
    ) -> Result<()> {
        let bytes = 16 * u64::from(host.size[0]) * u64::from(host.size[1]);
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes == 0 || bytes > most {
            let [w, h] = host.size;
            return Err(Error::Host(format!("a picture of {w} x {h} pixels does not fit the device")));
        }
        let (visible, report) = self.visible(device, host)?;
        self.report = report;
        // A depth buffer may have changed without a word.
        let frames = visible.iter().map(|v| v.frame.clone()).collect();
        let seen = host.depth.is_none().then_some(Seen { frames, exposure: host.exposure });
        let fits = self.picture.as_ref().is_some_and(|p| p.size == host.size);
        if fits && seen.is_some() && self.seen == seen {
            self.report = HostReport { reused: true, tiles: 0, draws: 0, samples: 0, ..self.report };
            return Ok(());
        }
        self.seen = None;
        if !fits {
            self.picture = Some(self.new_picture(device, host.size));
        }
        self.overlay.write(queue, host.size, host.exposure);
        let parts = self.parts(device, queue, &visible);
        let jobs = self.begin(device, queue, &visible, &parts, host.size)?;
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

    /// The levels of all objects in sight, the nearest object first, and where they are drawn.
    fn parts(&mut self, device: &Device, queue: &Queue, visible: &[Visible]) -> Vec<Part> {
        let mut parts = Vec::new();
        for (v, seen) in visible.iter().enumerate() {
            let Some(Some(Instance { asset, info, .. })) = self.instances.get(seen.instance) else { continue };
            let Some(Some(levels)) = self.assets.get_mut(*asset) else { continue };
            for (level, share) in shares(seen.choice) {
                let pipeline = &levels.pipelines[level];
                let baked = &pipeline.asset.info;
                let is_edited = baked.extinction != info.extinction || baked.albedo != info.albedo;
                let berth = levels.pools[level].place(
                    device,
                    queue,
                    pipeline,
                    seen.instance,
                    is_edited.then_some(info),
                );
                let pool = PoolId { asset: *asset, level, pool: berth.pool };
                parts.push(Part { visible: v, pool, slot: berth.slot, share });
            }
        }
        parts
    }

    /// Uploads lights and views of all parts, and says what is drawn together.
    fn begin(
        &mut self,
        device: &Device,
        queue: &Queue,
        visible: &[Visible],
        parts: &[Part],
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
                .filter(|p| p.pool == pool)
                .map(|p| Object { slot: p.slot, frame: &visible[p.visible].frame, exact: None })
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

    /// Draws the picture over the colours of the pass's viewport.
    pub fn render(&self, pass: &mut RenderPass<'_>) {
        if let Some(picture) = &self.picture {
            self.overlay.draw(pass, &picture.overlay);
        }
    }

    /// The same in a pass of its own: over black and transparent where `clear` says so, else over what is there. The target has
    /// the format of [`Options::colour`]; options with a depth attachment or several samples need [`Self::render`].
    pub fn render_to_texture(&self, encoder: &mut CommandEncoder, target: &TextureView, clear: bool) {
        let load = if clear { LoadOp::Clear(Color::TRANSPARENT) } else { LoadOp::Load };
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("diaphane"),
            color_attachments: &[Some(RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load, store: StoreOp::Store },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        self.render(&mut pass);
    }

    /// Objects in sight, the nearest first.
    fn visible(&self, device: &Device, host: &HostFrame<'_>) -> Result<(Vec<Visible>, HostReport)> {
        let mut report = HostReport::default();
        let mut visible = Vec::new();
        for (index, instance) in self.instances.iter().enumerate() {
            let Some(Instance { placement, info, .. }) = instance else { continue };
            let Some(levels) = self.levels_of(index) else { continue };
            let HostFrame { size, lights, environment, surface, .. } = *host;
            let frame = host.camera.frame(size, lights, environment, surface, placement, info);
            let Some([low, high]) = covered(&frame, info) else {
                report.culled += 1;
                continue;
            };
            let state = levels.pipelines[0].asset.pixel_state();
            let budget = budget(device, state, TOTAL);
            let mut tiles = split(high[0] - low[0], high[1] - low[1], budget)?;
            tiles.iter_mut().for_each(|t| t.start = [t.start[0] + low[0], t.start[1] + low[1]]);
            report.drawn += 1;
            report.tiles += tiles.len();
            let distance = host.camera.distance(placement.centre(info));
            let pixels = pixels_at_nearest(&frame, info);
            let choice = self.fineness.choose(&levels.details, pixels, state.heterogeneous);
            report.fading += usize::from(choice.coarser > 0.0);
            let samples = |(level, _): (usize, f32)| u64::from(levels.pipelines[level].asset.sample_count);
            report.samples += shares(choice).map(samples).sum::<u64>();
            let per_unit = (1.0 / placement.scale) as f32;
            visible.push((distance, Visible { instance: index, choice, frame, tiles, per_unit }));
        }
        visible.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok((visible.into_iter().map(|(_, v)| v).collect(), report))
    }

    fn levels_of(&self, instance: usize) -> Option<&Levels> {
        let instance = self.instances.get(instance)?.as_ref()?;
        self.assets.get(instance.asset)?.as_ref()
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
        let bytes = budget(device, needs, TOTAL).pixel_total * lot.pixels;
        let targets = Targets::allocate(device, needs, lot, self.path, bytes)?;
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

/// The levels to draw, one after the other, and their shares as view.wgsl knows them.
fn shares(choice: Choice) -> impl Iterator<Item = (usize, f32)> {
    let Choice { level, coarser } = choice;
    let (first, second) = match coarser > 0.0 {
        true => ((level, coarser - 1.0), Some((level + 1, coarser))),
        false => ((level, 1.0), None),
    };
    std::iter::once(first).chain(second)
}

/// Each once.
fn pools_of(ids: impl Iterator<Item = PoolId>) -> Vec<PoolId> {
    let mut ids: Vec<PoolId> = ids.collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

fn missing(what: &str) -> Error {
    Error::Host(format!("the {what} was removed or belongs to another renderer"))
}
