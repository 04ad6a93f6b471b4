//! The batches pass: lists of the batches of samples that each piece draws, and counts of what the view needs.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::shard::Shard;
use super::super::splatting::SplatPath;
use super::super::targets::Targets;
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device, ShaderStages};

/// See batches.wgsl.
#[derive(Clone)]
pub(crate) struct Batches {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
    drawn: bool,
}

impl Batches {
    pub fn new(device: &Device, common: &BindGroupLayout, path: SplatPath) -> Self {
        use Slot::{Read, Write};
        let layout = layout(device, "batches", ShaderStages::COMPUTE, &[Write, Read, Write]);
        let pipeline_layout = pipeline_layout(device, "batches", common, &layout);
        let module = shaders::module(device, "batches", shaders::BATCHES);
        let drawn = path == SplatPath::Quads;
        let constants = [("DRAWN", f64::from(u8::from(drawn)))];
        let pipeline = compute(device, "batches", &pipeline_layout, &module, &constants);
        Self { layout, pipeline, drawn }
    }

    pub fn bind(&self, device: &Device, shard: &Shard, targets: &Targets) -> BindGroup {
        let resources = [&shard.batches, &targets.arguments, &targets.census];
        group(device, "batches", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], asset: &AssetBuffers) {
        r.over_shards(Pass::Batches, &self.pipeline, groups, |pass, k| {
            // Without lists there are only the counts.
            let [columns, rows] = if self.drawn { asset.shards[k].batch_groups() } else { [1; 2] };
            pass.dispatch_workgroups(columns, rows, 1);
        });
    }
}
