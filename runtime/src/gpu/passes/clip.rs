//! The clip pass: pieces end at a host's opaque surfaces.

use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::targets::Targets;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, Buffer, ComputePipeline, Device, ShaderStages};

/// See clip.wgsl.
pub(crate) struct Clip {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Clip {
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        use Slot::{Read, Write};
        let layout = layout(device, "clip", ShaderStages::COMPUTE, &[Read, Write]);
        let pipeline_layout = pipeline_layout(device, "clip", common, &layout);
        let module = shaders::module(device, "clip", shaders::CLIP);
        let pipeline = compute(device, "clip", &pipeline_layout, &module, &[]);
        Self { layout, pipeline }
    }

    /// For the `distances` of the whole picture.
    pub fn bind(&self, device: &Device, distances: &Buffer, targets: &Targets) -> BindGroup {
        let resources = [distances, &targets.pieces].map(|b| b.as_entire_binding());
        group(device, "clip", &self.layout, resources.into())
    }

    pub fn record(&self, r: &mut Recorder, group: &BindGroup) {
        r.over_pixels("clip", &self.pipeline, group);
    }
}
