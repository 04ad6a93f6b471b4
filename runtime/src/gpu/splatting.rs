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

    /// How many workgroups keep a device busy: where a picture has fewer tiles rays are drawn side by side, and several share each
    /// tile. A software adapter has no more than a few threads.
    pub(super) fn workgroups(self, device: &Device) -> u32 {
        let software = device.adapter_info().device_type == DeviceType::Cpu;
        if self == Self::Quads || software { 0 } else { 1024 }
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
    Tiles {
        /// Where samples are one shard: sums join the picture at once.
        joined: Option<Gather>,
        /// Where sums are kept, from shard to shard or slice by slice.
        kept: Option<(Gather, Resolve)>,
    },
}

/// The groups of the pieces that are summed at once.
pub(super) struct SumGroups {
    /// One for each shard, of sums that are blended or join the picture at once.
    shards: Vec<BindGroup>,
    /// The same of sums that are kept.
    kept: Vec<BindGroup>,
    resolve: Option<BindGroup>,
}

impl Splatting {
    /// `sliced`: samples may be cut into slices.
    pub fn new(
        device: &Device,
        common: &BindGroupLayout,
        asset: &AssetBuffers,
        path: SplatPath,
        sliced: bool,
    ) -> Self {
        if path == SplatPath::Quads {
            return Self::Quads(
                Splat::new(device, common, asset),
                Resolve::new(device, common, asset, false),
            );
        }
        let sharded = asset.pixel_state().kept;
        let gather = |kept: bool| Gather::new(device, common, asset, kept);
        Self::Tiles {
            joined: (!sharded).then(|| gather(false)),
            kept: (sharded || sliced).then(|| (gather(true), Resolve::new(device, common, asset, true))),
        }
    }

    pub fn path(&self) -> SplatPath {
        match self {
            Self::Quads(..) => SplatPath::Quads,
            Self::Tiles { .. } => SplatPath::Tiles,
        }
    }

    /// Compiles anew what another material needs otherwise.
    pub fn set_variant(&mut self, device: &Device, variant: Variant) {
        match self {
            Self::Quads(splat, _) => splat.set_variant(device, variant),
            Self::Tiles { joined, kept } => {
                let gathers = joined.iter_mut().chain(kept.iter_mut().map(|(gather, _)| gather));
                gathers.for_each(|g| g.set_variant(device, variant));
            }
        }
    }

    /// For the pieces from `k` on that are summed at once.
    pub fn bind(&self, device: &Device, asset: &AssetBuffers, targets: &Targets, k: usize) -> SumGroups {
        let each = |bind: &dyn Fn(&Shard) -> BindGroup| asset.shards.iter().map(bind).collect::<Vec<_>>();
        let of = |gather: &Gather| each(&|s| gather.bind(device, s, targets, k));
        match self {
            Self::Quads(splat, resolve) => SumGroups {
                shards: each(&|s| splat.bind(device, s, targets, k)),
                kept: Vec::new(),
                resolve: Some(resolve.bind(device, targets, k)),
            },
            Self::Tiles { joined, kept } => SumGroups {
                shards: joined.as_ref().map(of).unwrap_or_default(),
                kept: kept.as_ref().map(|(gather, _)| of(gather)).unwrap_or_default(),
                resolve: kept.as_ref().map(|(_, resolve)| resolve.bind(device, targets, k)),
            },
        }
    }

    /// Adds these pieces of every pixel to the picture.
    pub fn record(
        &self,
        r: &mut Recorder,
        groups: &SumGroups,
        asset: &AssetBuffers,
        targets: &Targets,
        k: usize,
    ) {
        let resolve = match self {
            Self::Quads(quads, resolve) => {
                quads.record(r, &groups.shards, asset, targets, k);
                Some(resolve)
            }
            Self::Tiles { joined: Some(gather), .. } if r.lot.sums == 0 => {
                gather.record(r, &groups.shards, targets, k);
                None
            }
            Self::Tiles { kept, .. } => kept.as_ref().map(|(gather, resolve)| {
                gather.record(r, &groups.kept, targets, k);
                resolve
            }),
        };
        if let (Some(resolve), Some(group)) = (resolve, &groups.resolve) {
            resolve.record(r, group, targets, k);
        }
    }
}
