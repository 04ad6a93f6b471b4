//! The outlines pass: which samples a ray of every pixel may see, and why it sees no others; for quads also where every kernel
//! is in the picture, and which pieces and batches it may meet.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::shard::Shard;
use super::super::splatting::SplatPath;
use super::super::targets::Targets;
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device, ShaderStages};

/// See outlines.wgsl.
#[derive(Clone)]
pub(crate) struct Outlines {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Outlines {
    pub fn new(device: &Device, common: &BindGroupLayout, path: SplatPath) -> Self {
        use Slot::{Read, Write};
        let slots = [Read, Read, Read, Write, Write, Write, Write];
        let layout = layout(device, "outlines", ShaderStages::COMPUTE, &slots);
        let pipeline_layout = pipeline_layout(device, "outlines", common, &layout);
        let module = shaders::module(device, "outlines", shaders::OUTLINES);
        let constants = [("DRAWN", f64::from(u8::from(path == SplatPath::Quads)))];
        let pipeline = compute(device, "outlines", &pipeline_layout, &module, &constants);
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, shard: &Shard, targets: &Targets) -> BindGroup {
        let resources = [
            &shard.samples,
            &shard.sources,
            &targets.cells,
            &shard.outlines,
            &shard.shown,
            &shard.batches,
            &targets.census,
        ];
        group(device, "outlines", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], asset: &AssetBuffers) {
        for shard in &asset.shards {
            r.encoder.clear_buffer(&shard.batches, 0, None);
        }
        r.over_samples(Pass::Outlines, &self.pipeline, groups, &asset.shards);
    }
}
