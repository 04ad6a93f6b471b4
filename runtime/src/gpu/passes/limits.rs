//! The limits pass: distances from a host's depth buffer.

use super::super::bindings::{Slot, compute, filled_buffer, group, layout};
use super::super::shaders;
use bytemuck::{Pod, Zeroable};
use glam::Mat4;
use wgpu::{
    BindGroupLayout, BindingResource, Buffer, BufferUsages, CommandEncoder, ComputePassDescriptor,
    ComputePipeline, Device, PipelineLayoutDescriptor, ShaderStages, TextureView,
};

/// `Limits` of limits.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct LimitsUniform {
    size: [u32; 2],
    unused: [u32; 2],
    inverse: [f32; 16],
}

/// See limits.wgsl.
pub(crate) struct Limits {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

impl Limits {
    pub fn new(device: &Device) -> Self {
        let slots = [Slot::Uniform, Slot::Depth, Slot::Write];
        let layout = layout(device, "limits", ShaderStages::COMPUTE, &slots);
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("limits"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let module = shaders::module(device, "limits", shaders::LIMITS);
        let pipeline = compute(device, "limits", &pipeline_layout, &module, &[]);
        Self { layout, pipeline }
    }

    /// Writes `distances` of a picture of `size` pixels that was drawn with `projection`.
    pub fn record(
        &self,
        device: &Device,
        encoder: &mut CommandEncoder,
        size: [u32; 2],
        depth: (&TextureView, Mat4),
        distances: &Buffer,
    ) {
        let inverse = depth.1.inverse().to_cols_array();
        let uniform = LimitsUniform { size, unused: [0; 2], inverse };
        let uniform = filled_buffer(device, "limits", &[uniform], BufferUsages::UNIFORM);
        let resources = vec![
            uniform.as_entire_binding(),
            BindingResource::TextureView(depth.0),
            distances.as_entire_binding(),
        ];
        let group = group(device, "limits", &self.layout, resources);
        let mut pass = encoder
            .begin_compute_pass(&ComputePassDescriptor { label: Some("limits"), timestamp_writes: None });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        let [x, y] = size.map(|n| n.div_ceil(8));
        pass.dispatch_workgroups(x, y, 1);
    }
}
