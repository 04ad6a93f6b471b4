//! The two ways to sum kernels.

use super::asset::{AssetBuffers, Variant};
use super::passes::Recorder;
use super::passes::gather::Gather;
use super::passes::resolve::Resolve;
use super::passes::splat::Splat;
use super::shard::Shard;
use super::targets::Targets;
use crate::{Error, Result};
use wgpu::{BindGroup, BindGroupLayout, Device, DeviceType, Features};

/// How kernels are summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplatPath {
    /// A quad for each kernel, blended into textures of f32: needs `FLOAT32_BLENDABLE`.
    Quads,
    /// Every tile of 16 × 16 pixels gathers its kernels in registers.
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

    /// Why [`Self::best`] is what it is, and whether tiles have the feature that makes them faster.
    pub fn why_best(device: &Device) -> &'static str {
        let software = device.adapter_info().device_type == DeviceType::Cpu;
        match (software, Self::best(device), device.features().contains(Features::SUBGROUP)) {
            (_, Self::Quads, _) => "a software adapter, which may keep memory of every tile",
            (true, Self::Tiles, _) => "a software adapter that cannot blend 32-bit floats",
            (false, Self::Tiles, true) => "the default of hardware, with subgroups",
            (false, Self::Tiles, false) => {
                "the default of hardware; it has no subgroups, which would be faster"
            }
        }
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
pub(super) enum Splatting {
    Quads(Splat, Resolve),
    /// The second where sums are kept from shard to shard.
    Tiles(Gather, Option<Resolve>),
}

impl Splatting {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers, path: SplatPath) -> Self {
        let resolve = || Resolve::new(device, common, asset);
        match path {
            SplatPath::Quads => Self::Quads(Splat::new(device, common, asset), resolve()),
            SplatPath::Tiles => {
                Self::Tiles(Gather::new(device, common, asset), asset.pixel_state().kept.then(resolve))
            }
        }
    }
    pub fn path(&self) -> SplatPath {
        match self {
            Self::Quads(..) => SplatPath::Quads,
            Self::Tiles(..) => SplatPath::Tiles,
        }
    }

    /// Compiles anew what another material needs otherwise.
    pub fn set_variant(&mut self, device: &Device, variant: Variant) {
        match self {
            Self::Quads(splat, _) => splat.set_variant(device, variant),
            Self::Tiles(gather, _) => gather.set_variant(device, variant),
        }
    }

    /// For piece `k` of a shard.
    pub fn bind(&self, device: &Device, shard: &Shard, targets: &Targets, k: usize) -> BindGroup {
        match self {
            Self::Quads(splat, _) => splat.bind(device, shard, targets, k),
            Self::Tiles(gather, _) => gather.bind(device, shard, targets, k),
        }
    }

    /// For piece `k`, where sums have to be resolved.
    pub fn bind_resolve(&self, device: &Device, targets: &Targets, k: usize) -> Option<BindGroup> {
        self.resolve().map(|r| r.bind(device, targets, k))
    }

    fn resolve(&self) -> Option<&Resolve> {
        match self {
            Self::Quads(_, resolve) => Some(resolve),
            Self::Tiles(_, resolve) => resolve.as_ref(),
        }
    }

    /// Adds piece `k` of every pixel to the picture, from the groups of its shards and of its end.
    pub fn record(
        &self,
        r: &mut Recorder,
        shards: &[BindGroup],
        end: Option<&BindGroup>,
        asset: &AssetBuffers,
        targets: &Targets,
        k: usize,
    ) {
        match self {
            Self::Quads(quads, _) => quads.record(r, shards, asset, targets, k),
            Self::Tiles(gather, _) => gather.record(r, shards, targets, k),
        }
        if let (Some(resolve), Some(group)) = (self.resolve(), end) {
            resolve.record(r, group, targets, k);
        }
    }
}
