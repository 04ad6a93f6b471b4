//! The slopes pass: sources from the lighting pass's values, once a frame.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::shard::Shard;
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device, ShaderStages};

/// See slopes.wgsl.
#[derive(Clone)]
pub(crate) struct Slopes {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Slopes {
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        use Slot::{Read, Write};
        let layout = layout(device, "slopes", ShaderStages::COMPUTE, &[Read, Read, Read, Read, Write]);
        let pipeline_layout = pipeline_layout(device, "slopes", common, &layout);
        let module = shaders::module(device, "slopes", shaders::SLOPES);
        let pipeline = compute(device, "slopes", &pipeline_layout, &module, &[]);
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, asset: &AssetBuffers, shard: &Shard) -> BindGroup {
        let resources = [&shard.samples, &shard.centroids, &shard.spokes, &asset.values, &shard.sources];
        group(device, "slopes", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], asset: &AssetBuffers) {
        r.over_samples(Pass::Slopes, &self.pipeline, groups, &asset.shards);
    }
}
