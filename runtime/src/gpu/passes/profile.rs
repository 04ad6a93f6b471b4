//! The profile pass: density along one inside piece of every pixel.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::slabs::MOST_SLABS;
use super::super::targets::{ARGUMENTS, OVER_CELLS, Targets};
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device, ShaderStages};

/// See profile.wgsl.
#[derive(Clone)]
pub(crate) struct Profile {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Profile {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        let slots = [&[Slot::Read, Slot::Write][..], &[Slot::Read; MOST_SLABS]].concat();
        let layout = layout(device, "profile", ShaderStages::COMPUTE, &slots);
        let pipeline_layout = pipeline_layout(device, "profile", common, &layout);
        let module = shaders::module(device, "profile", shaders::PROFILE);
        let several = f64::from(u8::from(asset.slabs.are_several()));
        let pipeline = compute(device, "profile", &pipeline_layout, &module, &[("SLABS", several)]);
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, asset: &AssetBuffers, targets: &Targets, piece: usize) -> BindGroup {
        let mut resources = vec![targets.piece(piece), targets.profile.as_entire_binding()];
        resources.extend(asset.slabs.buffers.iter().map(|b| b.as_entire_binding()));
        group(device, "profile", &self.layout, resources)
    }

    /// Does nothing where no pixel has this piece.
    pub fn record(&self, r: &mut Recorder, group: &BindGroup, targets: &Targets, piece: usize) {
        let at = ARGUMENTS * piece as u64 + OVER_CELLS;
        r.compute(Pass::Profile, &self.pipeline, group, |pass| {
            pass.dispatch_workgroups_indirect(&targets.arguments, at);
        });
    }
}
