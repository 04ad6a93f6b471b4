//! The splat pass: every sample's kernel along one inside piece of every pixel.

use super::super::asset::{AssetBuffers, Variant};
use super::super::bindings::{Slot, filled_buffer, group, layout, options, pipeline_layout};
use super::super::shaders;
use super::super::shard::{BATCH, DRAW, Shard};
use super::super::targets::{SUM_FORMAT, Targets};
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{
    BindGroup, BindGroupLayout, BlendComponent, BlendFactor, BlendOperation, BlendState, Buffer,
    BufferUsages, Color, ColorTargetState, ColorWrites, Device, FragmentState, IndexFormat, LoadOp,
    Operations, PipelineLayout, PrimitiveState, PrimitiveTopology, RenderPassColorAttachment,
    RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor, ShaderModule, ShaderStages, StoreOp,
    TextureView, VertexState,
};

const ADD: BlendComponent = BlendComponent {
    src_factor: BlendFactor::One,
    dst_factor: BlendFactor::One,
    operation: BlendOperation::Add,
};

/// See splat.wgsl.
#[derive(Clone)]
pub(crate) struct Splat {
    layout: BindGroupLayout,
    pipeline_layout: PipelineLayout,
    module: ShaderModule,
    variant: Variant,
    pipeline: RenderPipeline,
    /// Of the hexagons of a batch of samples.
    indices: Buffer,
}

impl Splat {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        let layout = layout(device, "splat", ShaderStages::VERTEX_FRAGMENT, &[Slot::Read; 7]);
        let pipeline_layout = pipeline_layout(device, "splat", common, &layout);
        let module = shaders::module(device, "splat", shaders::SPLAT);
        let variant = asset.variant();
        let pipeline = Self::pipeline(device, &pipeline_layout, &module, variant);
        let indices = filled_buffer(device, "hexagons", &hexagons(), BufferUsages::INDEX);
        Self { layout, pipeline_layout, module, variant, pipeline, indices }
    }

    /// Compiles the pass anew where another material needs other code.
    pub fn set_variant(&mut self, device: &Device, variant: Variant) {
        if variant != self.variant {
            self.variant = variant;
            self.pipeline = Self::pipeline(device, &self.pipeline_layout, &self.module, variant);
        }
    }

    fn pipeline(
        device: &Device,
        layout: &PipelineLayout,
        module: &ShaderModule,
        variant: Variant,
    ) -> RenderPipeline {
        let constants = variant.constants();
        let target = Some(ColorTargetState {
            format: SUM_FORMAT,
            blend: Some(BlendState { color: ADD, alpha: ADD }),
            write_mask: ColorWrites::ALL,
        });
        device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some("splat"),
            layout: Some(layout),
            vertex: VertexState {
                module,
                entry_point: Some("outline"),
                compilation_options: options(&constants),
                buffers: &[],
            },
            primitive: PrimitiveState { topology: PrimitiveTopology::TriangleList, ..Default::default() },
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(FragmentState {
                module,
                entry_point: Some("add"),
                compilation_options: options(&constants),
                targets: &[target.clone(), target],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    pub fn bind(&self, device: &Device, shard: &Shard, targets: &Targets, piece: usize) -> BindGroup {
        let resources = vec![
            shard.samples.as_entire_binding(),
            shard.sources.as_entire_binding(),
            targets.piece(piece),
            targets.profile.as_entire_binding(),
            shard.outlines.as_entire_binding(),
            shard.shown(piece),
            shard.listed(piece),
        ];
        group(device, "splat", &self.layout, resources)
    }

    /// Only clears where no pixel has this piece. For one tile: quads are blended where their pixels are.
    pub fn record(
        &self,
        r: &mut Recorder,
        groups: &[BindGroup],
        asset: &AssetBuffers,
        targets: &Targets,
        piece: usize,
    ) {
        let mut render = r.encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("splat"),
            color_attachments: &[cleared(&targets.numerator), cleared(&targets.denominator)],
            depth_stencil_attachment: None,
            timestamp_writes: r.timers.render(Pass::Splat),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        render.set_pipeline(&self.pipeline);
        Recorder::aim(r.common, r.view_offset, r.lot.size, &mut render);
        render.set_index_buffer(self.indices.slice(..), IndexFormat::Uint16);
        for ((shard, common), group) in asset.shards.iter().zip(r.common).zip(groups) {
            render.set_bind_group(0, common, &[r.view_offset]);
            render.set_bind_group(1, group, &[]);
            render.draw_indexed_indirect(&shard.batches, DRAW * piece as u64);
        }
    }
}

/// Corners of the four triangles of each hexagon of a batch (a draw of few corners costs adapters as much as one of a few
/// hundred), whose corners are numbered as those of a strip.
fn hexagons() -> Vec<u16> {
    let triangles = [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]];
    (0..BATCH as u16).flat_map(|k| triangles.as_flattened().iter().map(move |c| 6 * k + c)).collect()
}

fn cleared(view: &TextureView) -> Option<RenderPassColorAttachment<'_>> {
    Some(RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store },
    })
}
