//! The segments pass: inside pieces from sorted crossings.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::targets::Targets;
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, ComputePipeline, Device, ShaderStages};

/// See segments.wgsl.
#[derive(Clone)]
pub(crate) struct Segments {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Segments {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        use Slot::{Read, Write};
        let slots = [Read, Read, Write, Write, Write, Write, Write, Write];
        let layout = layout(device, "segments", ShaderStages::COMPUTE, &slots);
        let pipeline_layout = pipeline_layout(device, "segments", common, &layout);
        let module = shaders::module(device, "segments", shaders::SEGMENTS);
        let constants = [("FRESNEL", f64::from(u8::from(asset.fresnel)))];
        let pipeline = compute(device, "segments", &pipeline_layout, &module, &constants);
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, targets: &Targets) -> BindGroup {
        let t = targets;
        let resources = [
            &t.crossings,
            &t.boundary,
            &t.pieces,
            &t.front,
            &t.radiance,
            &t.counters,
            &t.arguments,
            &t.cells,
        ];
        group(device, "segments", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    pub fn record(&self, r: &mut Recorder, group: &BindGroup, targets: &Targets) {
        r.encoder.clear_buffer(&targets.arguments, 0, None);
        let [x, y, z] = r.pixel_groups();
        r.compute(Pass::Segments, &self.pipeline, group, |pass| pass.dispatch_workgroups(x, y, z));
    }
}
