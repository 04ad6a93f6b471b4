//! The publish pass: the mean of the rays so far into a texture that others can use.

use super::super::bindings::{Slot, group, layout, options, pipeline_layout};
use super::super::shaders;
use super::super::targets::{SUM_FORMAT, Targets};
use super::super::tiles::Tile;
use super::Recorder;
use wgpu::{
    BindGroup, BindGroupLayout, Device, FragmentState, LoadOp, Operations, RenderPassColorAttachment,
    RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor, ShaderStages, StoreOp, TextureView,
    VertexState,
};

/// See publish.wgsl.
pub(crate) struct Publish {
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

impl Publish {
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        let layout = layout(device, "publish", ShaderStages::FRAGMENT, &[Slot::Read; 2]);
        let pipeline_layout = pipeline_layout(device, "publish", common, &layout);
        let module = shaders::module(device, "publish", shaders::PUBLISH);
        let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some("publish"),
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
                targets: &[Some(SUM_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, targets: &Targets) -> BindGroup {
        let resources = [&targets.radiance, &targets.counters];
        group(device, "publish", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    /// Writes the tile's part of `picture`.
    pub fn record(&self, r: &mut Recorder, group: &BindGroup, tile: Tile, picture: &TextureView) {
        let mut render = r.encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("publish"),
            color_attachments: &[Some(RenderPassColorAttachment {
                view: picture,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load: LoadOp::Load, store: StoreOp::Store },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let [x, y] = tile.start.map(|n| n as f32);
        let [width, height] = tile.size.map(|n| n as f32);
        render.set_pipeline(&self.pipeline);
        render.set_viewport(x, y, width, height, 0.0, 1.0);
        render.set_bind_group(0, &r.common[0], &[r.view_offset]);
        render.set_bind_group(1, group, &[]);
        render.draw(0..3, 0..1);
    }
}
