//! The lighting pass: the source of every sample, once a frame.

use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::scene::{AssetBuffers, FrameBuffers};
use super::super::shaders;
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device, ShaderStages};

/// Workgroups in a row; more samples make more rows.
const ROW: u32 = 1024;

/// See lighting.wgsl.
pub(crate) struct Lighting {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Lighting {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        use Slot::{Read, Uniform, Write};
        let slots = [Read, Read, Read, Read, Read, Read, Write, Uniform];
        let layout = layout(device, "lighting", ShaderStages::COMPUTE, &slots);
        let pipeline_layout = pipeline_layout(device, "lighting", common, &layout);
        let module = shaders::module(device, "lighting", shaders::LIGHTING);
        let constants = [("FRESNEL", f64::from(u8::from(asset.fresnel)))];
        let pipeline = compute(device, "lighting", &pipeline_layout, &module, &constants);
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, asset: &AssetBuffers, frame: &FrameBuffers) -> BindGroup {
        let resources = [
            &asset.samples,
            &asset.weights,
            &asset.depth,
            &asset.boundary,
            &frame.lights,
            &frame.exact,
            &asset.sources,
            &asset.recurrence,
        ];
        group(
            device,
            "lighting",
            &self.layout,
            resources.map(|b| b.as_entire_binding()).into(),
        )
    }

    pub fn record(&self, r: &mut Recorder, group: &BindGroup, asset: &AssetBuffers) {
        let groups = asset.sample_count.div_ceil(64);
        let rows = groups.div_ceil(ROW);
        r.compute(Pass::Lighting, &self.pipeline, group, |pass| {
            pass.dispatch_workgroups(groups.min(ROW), rows, 1);
        });
    }
}
