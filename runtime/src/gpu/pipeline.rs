//! The passes of a frame with everything that they read and write.

mod objects;
mod room;

pub(super) use objects::Drawn;

use super::asset::AssetBuffers;
use super::bindings::most_bound;
use super::frame::{FrameBuffers, Lit, Object, VIEW_STRIDE, common_layout};
use super::lot::Lot;
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
use super::splatting::{Splatting, SumGroups};
use super::targets::{COUNTERS, KEPT, RADIANCE, TOTAL, Targets};
use super::tiles::Tile;
use super::timers::Timers;
use super::uniforms::ViewUniform;
use crate::exact::ExactDepths;
use crate::fold::LightingKey;
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
    /// See [`SplatPath::workgroups`].
    workgroups: u32,
    /// That a binding holds.
    most_sums: u64,
    pub(super) asset: AssetBuffers,
    frame: FrameBuffers,
    /// Whether later frames may keep the sources of an earlier one.
    pub(super) reuse: bool,
    /// What is counted beside the pictures, [`crate::rendered::Census`].
    pub(super) counting: bool,
    /// What the sources that are there depend on, by slot.
    lit: Vec<Option<LightingKey>>,
    /// The same for those that the frame that was begun makes anew, and these themselves, the most lights first.
    pending: Vec<(usize, LightingKey)>,
    relit: Vec<Lit>,
    /// The views of the frame that was begun, first those of [`Self::relit`].
    views: Vec<ViewUniform>,
    targets: Option<(Targets, Groups)>,
    /// Bytes that the state of all pixels may take.
    pub(super) most_memory: u64,
    /// Bytes that the latest targets take, about.
    tile_memory: u64,
}

/// The groups of all passes; those that mind samples have one for each shard, those that draw the mesh one for each part.
struct Groups {
    lighting: Vec<BindGroup>,
    fold: Vec<BindGroup>,
    slopes: Vec<BindGroup>,
    surface: Vec<BindGroup>,
    boundary: Vec<BindGroup>,
    segments: BindGroup,
    outlines: Vec<BindGroup>,
    batches: Vec<BindGroup>,
    pieces: Vec<PieceGroups>,
}

/// Those of the pieces that are summed at once.
struct PieceGroups {
    profile: Option<BindGroup>,
    sums: SumGroups,
}

impl Pipeline {
    /// Compiles the passes and uploads an asset.
    ///
    /// # Errors
    /// An asset that makes no sense or is too large for the device.
    pub fn new(device: &Device, asset: &Asset, path: SplatPath) -> Result<Self> {
        let path = path.checked(device)?;
        let workgroups = path.workgroups(device);
        let common = common_layout(device);
        let asset = AssetBuffers::allocate(device, asset, path)?;
        Ok(Self {
            lighting: Lighting::new(device, &common, &asset),
            fold: Fold::new(device, &common),
            slopes: Slopes::new(device, &common),
            surface: Surface::new(device, &common),
            boundary: asset.fresnel.then(|| Boundary::new(device, &common)),
            segments: Segments::new(device, &common, &asset),
            profile: asset.heterogeneous.then(|| Profile::new(device, &common, &asset)),
            outlines: Outlines::new(device, &common, path),
            batches: Batches::new(device, &common, path),
            splatting: Splatting::new(device, &common, &asset, path, workgroups > 0),
            workgroups,
            most_sums: most_bound(device) / KEPT,
            frame: FrameBuffers::new(device, &common, &asset),
            common,
            asset,
            reuse: false,
            counting: true,
            lit: Vec::new(),
            pending: Vec::new(),
            relit: Vec::new(),
            views: Vec::new(),
            targets: None,
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
        self.lit.clear();
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
    /// the last), which it returns, when so many rays a pixel are drawn by [`Self::write_rays`].
    pub(super) fn begin(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame,
        exact: Option<&ExactDepths>,
        area: [[u32; 2]; 2],
        rays: usize,
    ) -> Result<Vec<Tile>> {
        self.light(device, queue, &[Object { slot: 0, frame, exact }])?;
        let mut tiles = self.split(device, area)?;
        let fits =
            self.targets.as_ref().is_some_and(|(t, _)| t.lot.holds(self.largest(device, &tiles, rays)));
        if !fits || self.frame.take_changed() {
            let mut old = self.targets.take().map(|(t, _)| t).filter(|_| fits);
            let targets = loop {
                let made = old.take().map_or_else(|| self.allocate(device, &tiles, rays), Ok);
                match made {
                    Err(Error::GpuMemory(what)) if self.shrink(&what) => tiles = self.split(device, area)?,
                    made => break made?,
                }
            };
            let groups = self.groups(device, &targets);
            self.targets = Some((targets, groups));
        }
        self.keep_lit();
        Ok(tiles)
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
            level.make_splatting(device);
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
            workgroups: self.workgroups,
            most_sums: self.most_sums,
            frame: FrameBuffers::new(device, &self.common, &asset),
            reuse: true,
            counting: self.counting,
            lit: Vec::new(),
            pending: Vec::new(),
            relit: Vec::new(),
            views: Vec::new(),
            asset,
            targets: None,
            most_memory: self.most_memory,
            tile_memory: 0,
        }
    }

    /// Begins a frame of several objects, with targets that others use too, large enough for what is to be drawn.
    ///
    /// # Errors
    /// The lights are too large for the device.
    pub(super) fn begin_in(
        &mut self,
        device: &Device,
        queue: &Queue,
        objects: &[Object<'_>],
        targets: &Targets,
    ) -> Result<()> {
        self.light(device, queue, objects)?;
        let stale = self.targets.as_ref().is_none_or(|(known, _)| known.pieces != targets.pieces);
        if self.frame.take_changed() || stale {
            let groups = self.groups(device, targets);
            self.targets = Some((targets.clone(), groups));
        }
        self.keep_lit();
        Ok(())
    }

    /// The layout of the group that all passes share.
    pub(super) fn common_layout(&self) -> &BindGroupLayout {
        &self.common
    }

    /// Where the passes of a lot are recorded whose first view is `view`.
    pub(super) fn recorder<'a>(
        &'a self,
        encoder: &'a mut CommandEncoder,
        timers: &'a mut Timers,
        view: usize,
        lot: impl Into<Lot>,
    ) -> Recorder<'a> {
        let view_offset = ((self.relit.len() + view) as u64 * VIEW_STRIDE) as u32;
        Recorder { encoder, timers, common: self.frame.common(), view_offset, lot: self.cut(lot.into()) }
    }

    /// The targets of the frame that was begun.
    pub(super) fn targets(&self) -> Option<&Targets> {
        self.targets.as_ref().map(|(t, _)| t)
    }

    /// Records the lighting of all samples of the objects that need it; says how many do.
    pub(super) fn record_lighting(&self, encoder: &mut CommandEncoder, timers: &mut Timers) -> usize {
        let Some((_, groups)) = &self.targets else { return 0 };
        if self.asset.sample_count > 0 && !self.relit.is_empty() {
            let lot = Lot { count: self.relit.len() as u32, ..Lot::default() };
            let mut r = Recorder { encoder, timers, common: self.frame.common(), view_offset: 0, lot };
            self.lighting.record(&mut r, &groups.lighting, &self.asset, &self.relit);
            let folds = |lit: &Lit| self.frame.plan(lit.slot).is_some_and(|p| !p.folded.is_empty());
            if self.relit.iter().any(folds) {
                self.fold.record(&mut r, &groups.fold, &self.asset);
            }
            self.slopes.record(&mut r, &groups.slopes, &self.asset);
        }
        self.relit.len()
    }

    /// Records the start of a lot: an empty picture.
    pub(super) fn record_start(&self, encoder: &mut CommandEncoder, lot: impl Into<Lot>) {
        let Some((targets, _)) = &self.targets else { return };
        let pixels = lot.into().pixels;
        for (buffer, bytes) in [(&targets.radiance, RADIANCE), (&targets.counters, COUNTERS)] {
            encoder.clear_buffer(buffer, 0, Some(bytes * pixels));
        }
        encoder.clear_buffer(&targets.census, 0, None);
    }

    /// Records one ray of every pixel of a lot, added to the picture.
    pub(super) fn record_ray(
        &self,
        encoder: &mut CommandEncoder,
        timers: &mut Timers,
        view: usize,
        lot: impl Into<Lot>,
        clip: Option<(&Clip, &BindGroup)>,
    ) {
        let Some((targets, groups)) = &self.targets else {
            return;
        };
        let r = &mut self.recorder(encoder, timers, view, lot);
        self.surface.record(r, &groups.surface, &self.asset.mesh, targets);
        if let Some(boundary) = &self.boundary {
            boundary.record(r, &groups.boundary, &self.asset.mesh, targets);
        }
        self.segments.record(r, &groups.segments, targets);
        if let Some((clip, group)) = clip {
            clip.record(r, group);
        }
        if self.counting || self.path() == SplatPath::Quads {
            self.outlines.record(r, &groups.outlines, &self.asset);
            self.batches.record(r, &groups.batches, &self.asset);
        }
        for (k, piece) in (0..MAX_PIECES).step_by(self.pieces_at_once()).zip(&groups.pieces) {
            if let (Some(profile), Some(group)) = (&self.profile, &piece.profile) {
                profile.record(r, group, targets, k);
            }
            self.splatting.record(r, &piece.sums, &self.asset, targets, k);
        }
    }

    fn groups(&self, device: &Device, targets: &Targets) -> Groups {
        let (asset, frame) = (&self.asset, &self.frame);
        let each = |bind: &dyn Fn(&Shard) -> BindGroup| asset.shards.iter().map(bind).collect::<Vec<_>>();
        let piece = |k: usize| PieceGroups {
            profile: self.profile.as_ref().map(|p| p.bind(device, asset, targets, k)),
            sums: self.splatting.bind(device, asset, targets, k),
        };
        Groups {
            lighting: each(&|s| self.lighting.bind(device, asset, s, frame)),
            fold: each(&|s| self.fold.bind(device, asset, s, frame)),
            slopes: each(&|s| self.slopes.bind(device, asset, s)),
            surface: asset.mesh.iter().map(|part| self.surface.bind(device, part, targets)).collect(),
            boundary: asset
                .mesh
                .iter()
                .filter_map(|part| Some(self.boundary.as_ref()?.bind(device, part, frame, targets)))
                .collect(),
            segments: self.segments.bind(device, targets),
            outlines: each(&|s| self.outlines.bind(device, s, targets)),
            batches: each(&|s| self.batches.bind(device, s, targets)),
            pieces: (0..MAX_PIECES).step_by(self.pieces_at_once()).map(piece).collect(),
        }
    }
}
