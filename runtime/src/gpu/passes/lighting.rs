//! The lighting pass: the value of every sample, once a frame.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::frame::FrameBuffers;
use super::super::shaders;
use super::super::shard::Shard;
use super::super::timers::Pass;
use super::Recorder;
use crate::fold::PORTION;
use diaphane_formats::harmonics;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device, ShaderStages};

/// See lighting.wgsl.
#[derive(Clone)]
pub(crate) struct Lighting {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Lighting {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        use Slot::{Read, Uniform, Write};
        let slots = [Read, Read, Read, Read, Read, Read, Write, Uniform, Uniform, Read];
        let layout = layout(device, "lighting", ShaderStages::COMPUTE, &slots);
        let pipeline_layout = pipeline_layout(device, "lighting", common, &layout);
        let module = shaders::module(device, "lighting", shaders::LIGHTING);
        let constants = [
            ("FRESNEL", f64::from(u8::from(asset.fresnel))),
            ("PORTION", PORTION as f64),
            ("BOUNDARY_ORDER", asset.boundary_order as f64),
            ("BOUNDARY_BYTES", harmonics::bytes(asset.boundary_order) as f64),
        ];
        let pipeline = compute(device, "lighting", &pipeline_layout, &module, &constants);
        Self { layout, pipeline }
    }

    pub fn bind(
        &self,
        device: &Device,
        asset: &AssetBuffers,
        shard: &Shard,
        frame: &FrameBuffers,
    ) -> BindGroup {
        let resources = [
            &shard.centroids,
            &shard.weights,
            &shard.depth,
            &shard.boundary,
            &frame.lights,
            &frame.exact,
            &asset.values,
            &asset.recurrence,
            &asset.bands,
            &shard.packed,
        ];
        group(device, "lighting", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    /// For so many lights.
    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], asset: &AssetBuffers, lights: usize) {
        let portions = lights.div_ceil(PORTION).max(1);
        if portions > 1 {
            r.encoder.clear_buffer(&asset.values, 0, None);
        }
        r.over_samples(Pass::Lighting, &self.pipeline, groups, &asset.shards, portions as u32);
    }
}
