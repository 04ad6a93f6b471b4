//! The fold pass: many directional lights as one vector, where a frame has so many.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::frame::FrameBuffers;
use super::super::shaders;
use super::super::shard::Shard;
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device, ShaderStages};

/// See fold.wgsl.
#[derive(Clone)]
pub(crate) struct Fold {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Fold {
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        use Slot::{Read, Write};
        let layout = layout(device, "fold", ShaderStages::COMPUTE, &[Read, Read, Read, Write]);
        let pipeline_layout = pipeline_layout(device, "fold", common, &layout);
        let module = shaders::module(device, "fold", shaders::FOLD);
        let pipeline = compute(device, "fold", &pipeline_layout, &module, &[]);
        Self { layout, pipeline }
    }

    pub fn bind(
        &self,
        device: &Device,
        asset: &AssetBuffers,
        shard: &Shard,
        frame: &FrameBuffers,
    ) -> BindGroup {
        let resources = [&shard.centroids, &frame.linear, &frame.ambient, &asset.values];
        group(device, "fold", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], asset: &AssetBuffers) {
        r.over_samples(Pass::Fold, &self.pipeline, groups, &asset.shards);
    }
}
