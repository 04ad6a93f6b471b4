//! The overlay pass: the composed picture over a host's colours.

use super::super::bindings::{Slot, empty_buffer, group, layout, options};
use super::super::host::Options;
use super::super::shaders;
use bytemuck::{Pod, Zeroable};
use wgpu::{
    BindGroup, BindGroupLayout, BlendComponent, BlendFactor, BlendOperation, BlendState, Buffer,
    BufferUsages, ColorTargetState, ColorWrites, CompareFunction, DepthStencilState, Device, FragmentState,
    MultisampleState, PipelineLayout, PipelineLayoutDescriptor, Queue, RenderPass, RenderPipeline,
    RenderPipelineDescriptor, ShaderModule, ShaderStages, VertexState,
};

/// `Overlay` of overlay.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct OverlayUniform {
    size: [u32; 2],
    exposure: f32,
    unused: u32,
}

/// See overlay.wgsl.
pub(crate) struct Overlay {
    layout: BindGroupLayout,
    attenuate: RenderPipeline,
    shine: RenderPipeline,
    uniform: Buffer,
}

const fn add(source: BlendFactor, target: BlendFactor) -> BlendComponent {
    BlendComponent { src_factor: source, dst_factor: target, operation: BlendOperation::Add }
}

/// Colours times the source, alpha as it is.
const ATTENUATE: BlendState = BlendState {
    color: add(BlendFactor::Dst, BlendFactor::Zero),
    alpha: add(BlendFactor::Zero, BlendFactor::One),
};
/// Colours added, alpha covered.
const SHINE: BlendState = BlendState {
    color: add(BlendFactor::One, BlendFactor::One),
    alpha: add(BlendFactor::One, BlendFactor::OneMinusSrcAlpha),
};

impl Overlay {
    pub fn new(device: &Device, target: &Options) -> Self {
        let slots = [Slot::Uniform, Slot::Read, Slot::Read];
        let layout = layout(device, "overlay", ShaderStages::FRAGMENT, &slots);
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("overlay"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let module = shaders::module(device, "overlay", shaders::OVERLAY);
        let make = |entry, blend| pipeline(device, &pipeline_layout, &module, target, entry, blend);
        let size = size_of::<OverlayUniform>() as u64;
        let uniform = empty_buffer(device, "overlay", size, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        Self { attenuate: make("attenuate", ATTENUATE), shine: make("shine", SHINE), layout, uniform }
    }

    pub fn bind(&self, device: &Device, total: &Buffer, opaque: &Buffer) -> BindGroup {
        let resources = [&self.uniform, total, opaque].map(|b| b.as_entire_binding());
        group(device, "overlay", &self.layout, resources.into())
    }

    pub fn write(&self, queue: &Queue, size: [u32; 2], exposure: f32) {
        let uniform = OverlayUniform { size, exposure, unused: 0 };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }

    pub fn draw(&self, pass: &mut RenderPass<'_>, group: &BindGroup) {
        pass.set_bind_group(0, group, &[]);
        for pipeline in [&self.attenuate, &self.shine] {
            pass.set_pipeline(pipeline);
            pass.draw(0..3, 0..1);
        }
    }
}

fn pipeline(
    device: &Device,
    layout: &PipelineLayout,
    module: &ShaderModule,
    target: &Options,
    entry: &str,
    blend: BlendState,
) -> RenderPipeline {
    device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some("overlay"),
        layout: Some(layout),
        vertex: VertexState {
            module,
            entry_point: Some("whole"),
            compilation_options: options(&[]),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: target.depth.map(|format| DepthStencilState {
            format,
            depth_write_enabled: Some(false),
            depth_compare: Some(CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: MultisampleState { count: target.sample_count, ..Default::default() },
        fragment: Some(FragmentState {
            module,
            entry_point: Some(entry),
            compilation_options: options(&[]),
            targets: &[Some(ColorTargetState {
                format: target.colour,
                blend: Some(blend),
                write_mask: ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
