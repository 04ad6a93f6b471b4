//! The display pass: a picture with exposure on somebody's target.

use super::super::bindings::{Slot, empty_buffer, group, layout, options};
use super::super::shaders;
use bytemuck::{Pod, Zeroable};
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, BufferUsages, Device, FragmentState,
    PipelineLayoutDescriptor, Queue, RenderPass, RenderPipeline, RenderPipelineDescriptor, ShaderStages,
    TextureFormat, TextureView, VertexState,
};

/// `Display` of display.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct DisplayUniform {
    exposure: f32,
    encode: u32,
    unused: [u32; 2],
}

/// See display.wgsl.
pub(crate) struct Display {
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
    uniform: Buffer,
    encode: bool,
}

impl Display {
    pub fn new(device: &Device, target: TextureFormat) -> Self {
        let layout = layout(device, "display", ShaderStages::FRAGMENT, &[Slot::Uniform, Slot::Texture]);
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("display"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let module = shaders::module(device, "display", shaders::DISPLAY);
        let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some("display"),
            layout: Some(&pipeline_layout),
            vertex: VertexState {
                module: &module,
                entry_point: None,
                compilation_options: options(&[]),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: options(&[]),
                targets: &[Some(target.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let size = size_of::<DisplayUniform>() as u64;
        let uniform = empty_buffer(device, "display", size, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        Self { layout, pipeline, uniform, encode: !target.is_srgb() }
    }

    pub fn bind(&self, device: &Device, picture: &TextureView) -> BindGroup {
        let resources = vec![self.uniform.as_entire_binding(), BindingResource::TextureView(picture)];
        group(device, "display", &self.layout, resources)
    }

    pub fn write(&self, queue: &Queue, exposure: f32) {
        let uniform = DisplayUniform { exposure, encode: u32::from(self.encode), unused: [0; 2] };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }

    pub fn draw(&self, pass: &mut RenderPass<'_>, group: &BindGroup) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }
}
