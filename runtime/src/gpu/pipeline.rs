//! The passes of a frame with everything that they read and write.

use super::asset::AssetBuffers;
use super::frame::{FrameBuffers, VIEW_STRIDE, common_layout};
use super::passes::Recorder;
use super::passes::batches::Batches;
use super::passes::boundary::Boundary;
use super::passes::clip::Clip;
use super::passes::fold::Fold;
use super::passes::lighting::Lighting;
use super::passes::outlines::Outlines;
use super::passes::profile::Profile;
use super::passes::segments::Segments;
use super::passes::slopes::Slopes;
use super::passes::surface::Surface;
use super::shard::Shard;
pub(super) use super::splatting::SplatPath;
use super::splatting::Splatting;
use super::targets::{COUNTERS, LEAST, RADIANCE, TOTAL, Targets, budget};
use super::tiles::{Tile, split};
use super::timers::Timers;
use super::uniforms::{LightLayout, ViewUniform};
use crate::exact::ExactDepths;
use crate::fold::{LightCounts, LightingKey};
use crate::frame::Frame;
use crate::rendered::MAX_PIECES;
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info};
use wgpu::{BindGroup, BindGroupLayout, CommandEncoder, Device, Queue};

/// The passes, their buffers and their order.
pub(super) struct Pipeline {
    common: BindGroupLayout,
    lighting: Lighting,
    fold: Fold,
    slopes: Slopes,
    surface: Surface,
    boundary: Option<Boundary>,
    segments: Segments,
    profile: Option<Profile>,
    outlines: Outlines,
    batches: Batches,
    splatting: Splatting,
    pub(super) asset: AssetBuffers,
    frame: FrameBuffers,
    /// Whether later frames may keep the sources of an earlier one.
    pub(super) reuse: bool,
    /// What the sources that are there depend on.
    lit: Option<LightingKey>,
    /// Whether the frame that was begun needs other sources.
    relight: bool,
    targets: Option<(Targets, Groups)>,
    /// `share` of view.wgsl.
    pub(super) share: f32,
    /// Bytes that the state of all pixels may take.
    pub(super) most_memory: u64,
    /// Bytes that the latest targets take, about.
    tile_memory: u64,
}

/// The groups of all passes; those that mind samples have one for each shard.
struct Groups {
    lighting: Vec<BindGroup>,
    fold: Vec<BindGroup>,
    slopes: Vec<BindGroup>,
    surface: BindGroup,
    boundary: Option<BindGroup>,
    segments: BindGroup,
    outlines: Vec<BindGroup>,
    batches: Vec<BindGroup>,
    pieces: Vec<PieceGroups>,
}

struct PieceGroups {
    profile: Option<BindGroup>,
    splat: Vec<BindGroup>,
    resolve: Option<BindGroup>,
}

impl Pipeline {
    /// Compiles the passes and uploads an asset.
    ///
    /// # Errors
    /// An asset that makes no sense or is too large for the device.
    pub fn new(device: &Device, asset: &Asset, path: SplatPath) -> Result<Self> {
        let path = path.checked(device)?;
        let common = common_layout(device);
        let asset = AssetBuffers::allocate(device, asset, path)?;
        Ok(Self {
            lighting: Lighting::new(device, &common, &asset),
            fold: Fold::new(device, &common),
            slopes: Slopes::new(device, &common),
            surface: Surface::new(device, &common),
            boundary: asset.fresnel.then(|| Boundary::new(device, &common)),
            segments: Segments::new(device, &common, &asset),
            profile: asset.heterogeneous.then(|| Profile::new(device, &common)),
            outlines: Outlines::new(device, &common, path),
            batches: Batches::new(device, &common, path),
            splatting: Splatting::new(device, &common, &asset, path),
            frame: FrameBuffers::new(device, &common, &asset),
            common,
            asset,
            reuse: false,
            lit: None,
            relight: true,
            targets: None,
            share: 1.0,
            most_memory: TOTAL,
            tile_memory: 0,
        })
    }

    /// How kernels are summed.
    pub(super) fn path(&self) -> SplatPath {
        self.splatting.path()
    }

    /// Takes extinction and albedo from an edited asset's parameters.
    pub(super) fn set_material(&mut self, device: &Device, queue: &Queue, info: &Info) {
        self.asset.set_material(queue, info);
        self.lit = None;
        self.renew_variant(device);
    }

    /// Compiles what the material needs and is not there.
    fn renew_variant(&mut self, device: &Device) {
        self.splatting.set_variant(device, self.asset.variant());
    }

    /// The same for one instance, whose medium others share until now.
    pub(super) fn set_own_material(&mut self, device: &Device, queue: &Queue, info: &Info) {
        self.asset.own_medium(device);
        self.frame.renew(device, &self.common, &self.asset);
        self.set_material(device, queue, info);
    }

    /// Uploads a frame's lights, and sees that there are targets for the tiles of `area` (first column and row, and those behind
    /// the last), which it returns.
    pub(super) fn begin(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame,
        exact: Option<&ExactDepths>,
        area: [[u32; 2]; 2],
    ) -> Result<Vec<Tile>> {
        let key = self.light(device, queue, frame, exact)?;
        let mut tiles = self.split(device, area)?;
        // The first tile is the largest; `split` returns at least one.
        let size = tiles[0].size;
        let fits = self.targets.as_ref().is_some_and(|(t, _)| (0..2).all(|c| t.size[c] >= size[c]));
        if !fits || self.frame.take_changed() {
            let mut old = self.targets.take().map(|(t, _)| t).filter(|_| fits);
            let targets = loop {
                let made = old.take().map_or_else(|| self.allocate(device, tiles[0]), Ok);
                match made {
                    Err(Error::GpuMemory(what)) if self.shrink(&what) => tiles = self.split(device, area)?,
                    made => break made?,
                }
            };
            let groups = self.groups(device, &targets);
            self.targets = Some((targets, groups));
        }
        self.lit = Some(key);
        Ok(tiles)
    }

    fn split(&self, device: &Device, [low, high]: [[u32; 2]; 2]) -> Result<Vec<Tile>> {
        let budget = budget(device, self.asset.pixel_state(), self.most_memory);
        let mut tiles = split(high[0] - low[0], high[1] - low[1], budget)?;
        tiles.iter_mut().for_each(|t| t.start = [t.start[0] + low[0], t.start[1] + low[1]]);
        Ok(tiles)
    }

    fn allocate(&mut self, device: &Device, tile: Tile) -> Result<Targets> {
        let state = self.asset.pixel_state();
        self.tile_memory = budget(device, state, self.most_memory).pixel_total * tile.pixels();
        Targets::allocate(device, state, tile, self.path(), self.tile_memory)
    }

    /// Draws in tiles of half the memory from now on, because there is none for `what`. False where they are small already.
    pub(super) fn shrink(&mut self, what: &str) -> bool {
        let half = self.most_memory.min(self.tile_memory) / 2;
        let may = half >= LEAST;
        if may {
            log::warn!("the GPU has no memory for {what}; drawing in smaller tiles");
            self.most_memory = half;
            self.forget_targets();
        }
        may
    }

    /// Forgets what the size of the picture decides, so that it is made anew.
    pub(super) fn forget_targets(&mut self) {
        self.targets = None;
        self.lit = None;
    }

    /// Uploads a frame's lights where they need other sources. The key that comes back is to be kept in `lit` when all went
    /// well.
    fn light(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame,
        exact: Option<&ExactDepths>,
    ) -> Result<LightingKey> {
        let key = LightingKey::new(frame, &self.asset.info, exact);
        self.relight = !self.reuse || self.lit.as_ref() != Some(&key);
        // Not before all went well.
        self.lit = None;
        if self.relight {
            self.frame.write_lights(device, queue, &self.asset, frame, exact)?;
        }
        Ok(key)
    }

    /// The same object once more, with lights and sources of its own.
    pub(super) fn instance(&self, device: &Device) -> Self {
        self.with(device, self.asset.instance(device))
    }

    /// Another level of the same asset, for which nothing is compiled that is there.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn level(&self, device: &Device, asset: &Asset) -> Result<Self> {
        let mut level = self.with(device, AssetBuffers::allocate(device, asset, self.path())?);
        if level.asset.pixel_state().kept == self.asset.pixel_state().kept {
            level.renew_variant(device);
        } else {
            // Another number of shards.
            level.splatting = Splatting::new(device, &level.common, &level.asset, level.path());
        }
        Ok(level)
    }

    fn with(&self, device: &Device, asset: AssetBuffers) -> Self {
        Self {
            common: self.common.clone(),
            lighting: self.lighting.clone(),
            fold: self.fold.clone(),
            slopes: self.slopes.clone(),
            surface: self.surface.clone(),
            boundary: self.boundary.clone(),
            segments: self.segments.clone(),
            profile: self.profile.clone(),
            outlines: self.outlines.clone(),
            batches: self.batches.clone(),
            splatting: self.splatting.clone(),
            frame: FrameBuffers::new(device, &self.common, &asset),
            reuse: true,
            lit: None,
            relight: true,
            asset,
            targets: None,
            share: 1.0,
            most_memory: self.most_memory,
            tile_memory: 0,
        }
    }

    /// As [`Self::begin`] with targets that others use too, large enough for what is to be drawn.
    pub(super) fn begin_in(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame,
        targets: &Targets,
    ) -> Result<()> {
        let key = self.light(device, queue, frame, None)?;
        let stale = self.targets.as_ref().is_none_or(|(known, _)| known.pieces != targets.pieces);
        if self.frame.take_changed() || stale {
            let groups = self.groups(device, targets);
            self.targets = Some((targets.clone(), groups));
        }
        self.lit = Some(key);
        Ok(())
    }

    /// Uploads the rays of some tiles: view `t * offsets.len() + o` is offset o in tile t, added to pictures of `before`
    /// rays.
    pub(super) fn write_views(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame,
        tiles: &[Tile],
        offsets: &[[f32; 2]],
        before: u32,
    ) {
        let mut views = Vec::with_capacity(tiles.len() * offsets.len());
        for &tile in tiles {
            let diagonal = self.asset.diagonal;
            let lights = LightLayout {
                single: self.frame.plan.single.len() as u32,
                environment: self.frame.plan.environment as u32,
                negligible: self.frame.plan.negligible,
                first_scene_light: self.frame.first_scene_light,
                means: self.frame.means,
            };
            let view = |(&offset, rays)| ViewUniform {
                share: self.share,
                ..ViewUniform::new(frame, diagonal, tile, offset, rays, lights)
            };
            views.extend(offsets.iter().zip(before + 1..).map(view));
        }
        self.frame.write_views(device, queue, &self.common, &self.asset, &views);
    }

    /// What became of the lights of the frame that was begun.
    pub(super) fn light_counts(&self) -> LightCounts {
        self.frame.plan.counts(self.frame.fold_error(), None)
    }

    /// The layout of the group that all passes share.
    pub(super) fn common_layout(&self) -> &BindGroupLayout {
        &self.common
    }

    /// Where the passes of a view are recorded.
    pub(super) fn recorder<'a>(
        &'a self,
        encoder: &'a mut CommandEncoder,
        timers: &'a mut Timers,
        view: usize,
        tile: Tile,
    ) -> Recorder<'a> {
        let view_offset = (view as u64 * VIEW_STRIDE) as u32;
        Recorder { encoder, timers, common: self.frame.common(), view_offset, tile: tile.size }
    }

    /// The targets of the frame that was begun.
    pub(super) fn targets(&self) -> Option<&Targets> {
        self.targets.as_ref().map(|(t, _)| t)
    }

    /// Records the lighting of all samples where they need it; says whether they do.
    pub(super) fn record_lighting(&self, encoder: &mut CommandEncoder, timers: &mut Timers) -> bool {
        let Some((_, groups)) = &self.targets else { return false };
        if self.asset.sample_count > 0 && self.relight {
            let mut r =
                Recorder { encoder, timers, common: self.frame.common(), view_offset: 0, tile: [0; 2] };
            let lights = self.frame.plan.single.len();
            self.lighting.record(&mut r, &groups.lighting, &self.asset, lights);
            if !self.frame.plan.folded.is_empty() {
                self.fold.record(&mut r, &groups.fold, &self.asset);
            }
            self.slopes.record(&mut r, &groups.slopes, &self.asset);
        }
        self.relight
    }

    /// Records the start of a tile: an empty picture.
    pub(super) fn record_start(&self, encoder: &mut CommandEncoder, tile: Tile) {
        let Some((targets, _)) = &self.targets else { return };
        for (buffer, bytes) in [(&targets.radiance, RADIANCE), (&targets.counters, COUNTERS)] {
            encoder.clear_buffer(buffer, 0, Some(bytes * tile.pixels()));
        }
        encoder.clear_buffer(&targets.census, 0, None);
    }

    /// Records one ray of every pixel of a tile, added to the picture.
    pub(super) fn record_ray(
        &self,
        encoder: &mut CommandEncoder,
        timers: &mut Timers,
        view: usize,
        tile: Tile,
        clip: Option<(&Clip, &BindGroup)>,
    ) {
        let Some((targets, groups)) = &self.targets else {
            return;
        };
        let r = &mut self.recorder(encoder, timers, view, tile);
        self.surface.record(r, &groups.surface, &self.asset, targets);
        if let (Some(boundary), Some(group)) = (&self.boundary, &groups.boundary) {
            boundary.record(r, group, &self.asset, targets);
        }
        self.segments.record(r, &groups.segments, targets);
        if let Some((clip, group)) = clip {
            clip.record(r, group);
        }
        self.outlines.record(r, &groups.outlines, &self.asset);
        self.batches.record(r, &groups.batches, &self.asset);
        for (k, piece) in groups.pieces.iter().enumerate() {
            if let (Some(profile), Some(group)) = (&self.profile, &piece.profile) {
                profile.record(r, group, targets, k);
            }
            self.splatting.record(r, &piece.splat, piece.resolve.as_ref(), &self.asset, targets, k);
        }
    }

    fn groups(&self, device: &Device, targets: &Targets) -> Groups {
        let (asset, frame) = (&self.asset, &self.frame);
        let each = |bind: &dyn Fn(&Shard) -> BindGroup| asset.shards.iter().map(bind).collect::<Vec<_>>();
        let piece = |k: usize| PieceGroups {
            profile: self.profile.as_ref().map(|p| p.bind(device, asset, targets, k)),
            splat: each(&|s| self.splatting.bind(device, s, targets, k)),
            resolve: self.splatting.bind_resolve(device, targets, k),
        };
        Groups {
            lighting: each(&|s| self.lighting.bind(device, asset, s, frame)),
            fold: each(&|s| self.fold.bind(device, asset, s, frame)),
            slopes: each(&|s| self.slopes.bind(device, asset, s)),
            surface: self.surface.bind(device, asset, targets),
            boundary: self.boundary.as_ref().map(|b| b.bind(device, asset, frame, targets)),
            segments: self.segments.bind(device, targets),
            outlines: each(&|s| self.outlines.bind(device, s, targets)),
            batches: each(&|s| self.batches.bind(device, s, targets)),
            pieces: (0..MAX_PIECES).map(piece).collect(),
        }
    }
}
