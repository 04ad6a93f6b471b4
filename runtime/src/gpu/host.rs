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

mod exact;
mod interface;
mod jobs;
mod lots;
mod pools;
mod sight;

pub use interface::{HostDepth, HostFrame, HostReport, Options};

use super::faults::allocate;
use super::frame::common_layout;
use super::passes::clip::Clip;
use super::passes::compose::Compose;
use super::passes::limits::Limits;
use super::passes::overlay::Overlay;
use super::pipeline::{Pipeline, SplatPath};
use super::targets::{PixelState, Targets};
use crate::detail::{Detail, Fineness, details};
use crate::edit::Edit;
use crate::exact::Settings;
use crate::frame::Frame;
use crate::placement::Placement;
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info};
use exact::{Spreads, Tracers};
use pools::Pools;
use wgpu::{
    BindGroup, Buffer, Color, CommandEncoder, Device, Features, LoadOp, Operations, Queue, RenderPass,
    RenderPassColorAttachment, RenderPassDescriptor, StoreOp, TextureView,
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
    spreads: Spreads,
}

/// An asset: its levels, level 0 first, what is known of them, and what draws objects with them.
struct Levels {
    pipelines: Vec<Pipeline>,
    details: Vec<Detail>,
    pools: Vec<Pools>,
    /// Where lights may have exact depths.
    tracers: Option<Tracers>,
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
    exact: Option<Settings>,
    assets: Vec<Option<Levels>>,
    instances: Vec<Option<Instance>>,
    targets: Option<(Targets, PixelState)>,
    picture: Option<Picture>,
    seen: Option<Seen>,
    report: HostReport,
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
            exact: options.exact,
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
        let tracers = self.exact.map(|_| Tracers::new(asset)).transpose()?;
        self.assets.push(Some(Levels { pipelines, details: details(asset), pools, tracers }));
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
        self.instances.push(Some(Instance { asset: asset.0, placement, info, spreads: Spreads::default() }));
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
        let instance = self.instance_mut(id)?;
        instance.spreads.set_material(&info);
        instance.info = info;
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
            self.assets
                .iter_mut()
                .flatten()
                .for_each(|l| l.pools.iter_mut().for_each(|p| *p = Pools::default()));
        }
        done
    }

    /// Whether the next frames will differ from the last one although nothing moves: lights are on their way from baked depths to
    /// exact ones.
    pub fn is_busy(&self) -> bool {
        self.instances.iter().flatten().any(|i| i.spreads.is_busy())
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
}

fn missing(what: &str) -> Error {
    Error::Host(format!("the {what} was removed or belongs to another renderer"))
}
