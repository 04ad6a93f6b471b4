//! The outlines pass: where every kernel is in the picture, and which pieces it may meet.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
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
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        use Slot::{Read, Write};
        let layout = layout(device, "outlines", ShaderStages::COMPUTE, &[Read, Read, Read, Write, Write]);
        let pipeline_layout = pipeline_layout(device, "outlines", common, &layout);
        let module = shaders::module(device, "outlines", shaders::OUTLINES);
        let pipeline = compute(device, "outlines", &pipeline_layout, &module, &[]);
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, asset: &AssetBuffers, targets: &Targets) -> BindGroup {
        let resources = [&asset.samples, &asset.sources, &targets.cells, &asset.outlines, &asset.shown];
        group(device, "outlines", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    pub fn record(&self, r: &mut Recorder, group: &BindGroup, asset: &AssetBuffers) {
        r.compute(Pass::Outlines, &self.pipeline, group, |pass| {
            let [columns, rows] = asset.sample_groups();
            pass.dispatch_workgroups(columns, rows, 1);
        });
    }
}
