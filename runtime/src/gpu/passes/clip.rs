//! The clip pass: pieces end at a host's opaque surfaces.

use super::super::bindings::{Slot, compute, filled_buffer, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::targets::Targets;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, Buffer, BufferUsages, ComputePipeline, Device, ShaderStages};

/// See clip.wgsl.
pub(crate) struct Clip {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Clip {
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        use Slot::{Read, Uniform, Write};
        let layout = layout(device, "clip", ShaderStages::COMPUTE, &[Read, Write, Uniform]);
        let pipeline_layout = pipeline_layout(device, "clip", common, &layout);
        let module = shaders::module(device, "clip", shaders::CLIP);
        let pipeline = compute(device, "clip", &pipeline_layout, &module, &[]);
        Self { layout, pipeline }
    }

    /// For an object with `per_unit` of its units in a unit of the `distances` of a picture `width` pixels wide.
    pub fn bind(
        &self,
        device: &Device,
        distances: &Buffer,
        targets: &Targets,
        per_unit: f32,
        width: u32,
    ) -> BindGroup {
        let clip = filled_buffer(device, "clip", &[per_unit, f32::from_bits(width)], BufferUsages::UNIFORM);
        let resources = [distances, &targets.pieces, &clip].map(|b| b.as_entire_binding());
        group(device, "clip", &self.layout, resources.into())
    }

    pub fn record(&self, r: &mut Recorder, group: &BindGroup) {
        r.over_pixels("clip", &self.pipeline, group);
    }
}
