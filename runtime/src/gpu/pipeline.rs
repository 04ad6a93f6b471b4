//! The passes of a frame with everything that they read and write.

use super::asset::AssetBuffers;
use super::frame::{FrameBuffers, VIEW_STRIDE, common_layout};
use super::passes::Recorder;
use super::passes::boundary::Boundary;
use super::passes::clip::Clip;
use super::passes::fold::Fold;
use super::passes::gather::Gather;
use super::passes::lighting::Lighting;
use super::passes::outlines::Outlines;
use super::passes::profile::Profile;
use super::passes::resolve::Resolve;
use super::passes::segments::Segments;
use super::passes::slopes::Slopes;
use super::passes::splat::Splat;
use super::passes::surface::Surface;
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
use wgpu::{BindGroup, BindGroupLayout, CommandEncoder, Device, DeviceType, Features, Queue};

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
    /// Bytes that the state of all pixels may take.
    pub(super) most_memory: u64,
    /// Bytes that the latest targets take, about.
    tile_memory: u64,
}

/// How kernels are summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatPath {
    /// A quad for each kernel, blended into textures of f32: needs `FLOAT32_BLENDABLE`.
    Quads,
    /// Every tile of 8 × 8 pixels gathers its kernels in registers.
    Tiles,
}

impl SplatPath {
    /// The one that a device draws with unless it is told otherwise: tiles need no feature beyond those of every adapter and
    /// were faster wherever both were measured. Software adapters take quads where they can: Mesa 22.3.6's keeps the memory
    /// of every dispatch whose workgroups have barriers, 4 MB a ray by tiles and 0.02 MB by quads.
    pub fn best(device: &Device) -> Self {
        let software = device.adapter_info().device_type == DeviceType::Cpu;
        let quads = software && device.features().contains(Features::FLOAT32_BLENDABLE);
        if quads { Self::Quads } else { Self::Tiles }
    }

    /// Itself where the device can take it.
    ///
    /// # Errors
    /// Quads where 32-bit floats cannot be blended.
    pub fn checked(self, device: &Device) -> Result<Self> {
        if self == Self::Quads && !device.features().contains(Features::FLOAT32_BLENDABLE) {
            return Err(Error::Gpu("the adapter cannot blend 32-bit floats, which quads need".to_owned()));
        }
        Ok(self)
    }

    /// "quads" or "tiles".
    pub fn name(self) -> &'static str {
        match self {
            Self::Quads => "quads",
            Self::Tiles => "tiles",
        }
    }
}

/// The passes of a [`SplatPath`].
#[derive(Clone)]
enum Splatting {
    Quads(Outlines, Splat, Resolve),
    Tiles(Gather),
}

/// The groups of all passes.
struct Groups {
    lighting: BindGroup,
    fold: BindGroup,
    slopes: BindGroup,
    surface: BindGroup,
    boundary: Option<BindGroup>,
    segments: BindGroup,
    outlines: Option<BindGroup>,
    pieces: Vec<PieceGroups>,
}

struct PieceGroups {
    profile: Option<BindGroup>,
    splatting: SplattingGroups,
}

enum SplattingGroups {
    Quads { splat: BindGroup, resolve: BindGroup },
    Tiles(BindGroup),
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
            splatting: match path {
                SplatPath::Quads => Splatting::Quads(
                    Outlines::new(device, &common),
                    Splat::new(device, &common, &asset),
                    Resolve::new(device, &common, &asset),
                ),
                SplatPath::Tiles => Splatting::Tiles(Gather::new(device, &common, &asset)),
            },
            frame: FrameBuffers::new(device, &common, &asset),
            common,
            asset,
            reuse: false,
            lit: None,
            relight: true,
            targets: None,
            most_memory: TOTAL,
            tile_memory: 0,
        })
    }

    /// How kernels are summed.
    pub(super) fn path(&self) -> SplatPath {
        match self.splatting {
            Splatting::Quads(..) => SplatPath::Quads,
            Splatting::Tiles(_) => SplatPath::Tiles,
        }
    }

    /// Takes extinction and albedo from an edited asset's parameters.
    pub(super) fn set_material(&mut self, device: &Device, queue: &Queue, info: &Info) {
        self.asset.set_material(queue, info);
        self.lit = None;
        self.renew_variant(device);
    }

    /// Compiles what the material needs and is not there.
    fn renew_variant(&mut self, device: &Device) {
        let variant = self.asset.variant();
        match &mut self.splatting {
            Splatting::Quads(_, splat, _) => splat.set_variant(device, variant),
            Splatting::Tiles(gather) => gather.set_variant(device, variant),
        }
    }

    /// The same for one instance, whose medium others share until now.
    pub(super) fn set_own_material(&mut self, device: &Device, queue: &Queue, info: &Info) {
        self.asset.own_medium(device);
        self.frame.renew(device, &self.common, &self.asset);
        self.set_material(device, queue, info);
    }

    /// Uploads a frame's lights, and sees that there are targets for its tiles, which it returns.
    pub(super) fn begin(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame,
        exact: Option<&ExactDepths>,
    ) -> Result<Vec<Tile>> {
        let key = self.light(device, queue, frame, exact)?;
        let mut tiles = self.split(device, frame)?;
        // The first tile is the largest; `split` returns at least one.
        let fits = self.targets.as_ref().is_some_and(|(t, _)| t.size == tiles[0].size);
        if !fits || self.frame.take_changed() {
            let mut old = self.targets.take().map(|(t, _)| t).filter(|_| fits);
            let targets = loop {
                let made = old.take().map_or_else(|| self.allocate(device, tiles[0]), Ok);
                match made {
                    Err(Error::GpuMemory(what)) if self.shrink(&what) => tiles = self.split(device, frame)?,
                    made => break made?,
                }
            };
            let groups = self.groups(device, &targets);
            self.targets = Some((targets, groups));
        }
        self.lit = Some(key);
        Ok(tiles)
    }

    fn split(&self, device: &Device, frame: &Frame) -> Result<Vec<Tile>> {
        split(frame.width, frame.height, budget(device, self.asset.pixel_state(), self.most_memory))
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
        level.renew_variant(device);
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
            splatting: self.splatting.clone(),
            frame: FrameBuffers::new(device, &self.common, &asset),
            reuse: true,
            lit: None,
            relight: true,
            asset,
            targets: None,
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
            let view = |(&offset, rays)| ViewUniform::new(frame, diagonal, tile, offset, rays, lights);
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
        if let (Splatting::Quads(outlines, ..), Some(group)) = (&self.splatting, &groups.outlines) {
            outlines.record(r, group, &self.asset);
        }
        for (k, piece) in groups.pieces.iter().enumerate() {
            if let (Some(profile), Some(group)) = (&self.profile, &piece.profile) {
                profile.record(r, group, targets, k);
            }
            match (&self.splatting, &piece.splatting) {
                (Splatting::Quads(_, quads, end), SplattingGroups::Quads { splat, resolve }) => {
                    quads.record(r, splat, targets, k);
                    end.record(r, resolve, targets, k);
                }
                (Splatting::Tiles(gather), SplattingGroups::Tiles(group)) => {
                    gather.record(r, group, targets, k);
                }
                _ => {}
            }
        }
    }

    fn groups(&self, device: &Device, targets: &Targets) -> Groups {
        let (asset, frame) = (&self.asset, &self.frame);
        let piece = |k: usize| PieceGroups {
            profile: self.profile.as_ref().map(|p| p.bind(device, asset, targets, k)),
            splatting: match &self.splatting {
                Splatting::Quads(_, splat, resolve) => SplattingGroups::Quads {
                    splat: splat.bind(device, asset, targets, k),
                    resolve: resolve.bind(device, targets, k),
                },
                Splatting::Tiles(gather) => SplattingGroups::Tiles(gather.bind(device, asset, targets, k)),
            },
        };
        Groups {
            lighting: self.lighting.bind(device, asset, frame),
            fold: self.fold.bind(device, asset, frame),
            slopes: self.slopes.bind(device, asset),
            surface: self.surface.bind(device, asset, targets),
            boundary: self.boundary.as_ref().map(|b| b.bind(device, asset, frame, targets)),
            segments: self.segments.bind(device, targets),
            outlines: match &self.splatting {
                Splatting::Quads(outlines, ..) => Some(outlines.bind(device, asset, targets)),
                Splatting::Tiles(_) => None,
            },
            pieces: (0..MAX_PIECES).map(piece).collect(),
        }
    }
}
