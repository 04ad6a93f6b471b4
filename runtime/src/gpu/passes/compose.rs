//! The compose pass: objects one behind the other.

use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::targets::Targets;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, Buffer, ComputePipeline, Device, ShaderStages};

/// See compose.wgsl.
pub(crate) struct Compose {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Compose {
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        use Slot::{Read, Write};
        let layout = layout(device, "compose", ShaderStages::COMPUTE, &[Read, Read, Write, Write]);
        let pipeline_layout = pipeline_layout(device, "compose", common, &layout);
        let module = shaders::module(device, "compose", shaders::COMPOSE);
        let pipeline = compute(device, "compose", &pipeline_layout, &module, &[]);
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, targets: &Targets, total: &Buffer, opaque: &Buffer) -> BindGroup {
        let resources = [&targets.radiance, &targets.front, total, opaque];
        group(device, "compose", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    pub fn record(&self, r: &mut Recorder, group: &BindGroup) {
        r.over_pixels("compose", &self.pipeline, group);
    }
}
