//! The lighting pass: the value of every sample, once a frame.

use super::super::asset::AssetBuffers;
use super::super::asset::VALUE;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::frame::{FrameBuffers, Lit};
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

    /// For objects with so many lights each, the most first.
    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], asset: &AssetBuffers, lit: &[Lit]) {
        let portions = |o: &Lit| o.lights.div_ceil(PORTION).max(1);
        let bytes = VALUE * u64::from(asset.sample_count);
        for object in lit.iter().filter(|o| portions(o) > 1) {
            r.encoder.clear_buffer(&asset.values, bytes * object.slot as u64, Some(bytes));
        }
        let rounds = lit.first().map_or(1, portions);
        r.over_shards(Pass::Lighting, &self.pipeline, groups, |pass, k| {
            let [columns, rows] = asset.shards[k].sample_groups();
            for round in 0..rounds {
                let count = lit.iter().filter(|o| portions(o) > round).count();
                pass.dispatch_workgroups(columns, rows, count as u32);
            }
        });
    }
}
