//! The surface pass: crossings of all rays with the mesh.

use super::super::bindings::{Slot, group, layout, options, pipeline_layout};
use super::super::mesh::MeshPart;
use super::super::shaders;
use super::super::targets::{CROSSINGS, MARKER_FORMAT, Targets};
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{
    BindGroup, BindGroupLayout, Color, ColorTargetState, ColorWrites, Device, FragmentState, FrontFace,
    IndexFormat, LoadOp, Operations, PipelineLayout, PrimitiveState, PrimitiveTopology,
    RenderPassColorAttachment, RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor, ShaderModule,
    ShaderStages, StoreOp, VertexAttribute, VertexBufferLayout, VertexFormat, VertexState, VertexStepMode,
};

/// See surface.wgsl.
#[derive(Clone)]
pub(crate) struct Surface {
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

impl Surface {
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        let layout = layout(
            device,
            "surface",
            ShaderStages::VERTEX_FRAGMENT,
            &[Slot::Read, Slot::Read, Slot::Write, Slot::Read],
        );
        let pipeline_layout = pipeline_layout(device, "surface", common, &layout);
        let module = shaders::module(device, "surface", shaders::SURFACE);
        let pipeline = mesh_pipeline(device, "surface", &pipeline_layout, &module, "insert");
        Self { layout, pipeline }
    }

    pub fn bind(&self, device: &Device, part: &MeshPart, targets: &Targets) -> BindGroup {
        let resources = [&part.positions, &part.triangles, &targets.crossings, &part.neighbours];
        group(device, "surface", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    /// With a group for each part of the mesh.
    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], mesh: &[MeshPart], targets: &Targets) {
        r.clear_pixels(&targets.crossings, CROSSINGS);
        draw_mesh(r, Pass::Surface, &self.pipeline, groups, mesh, targets);
    }
}

/// A pipeline that draws every triangle from both sides and writes no attachment. The pass needs one none the less,
/// because its size is the largest tile's.
pub(super) fn mesh_pipeline(
    device: &Device,
    label: &str,
    layout: &PipelineLayout,
    module: &ShaderModule,
    fragment: &str,
) -> RenderPipeline {
    device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(layout),
        vertex: VertexState {
            module,
            entry_point: Some("corner"),
            compilation_options: options(&[]),
            buffers: &[Some(VertexBufferLayout {
                array_stride: 12,
                step_mode: VertexStepMode::Vertex,
                attributes: &[VertexAttribute {
                    format: VertexFormat::Float32x3,
                    offset: 0,
                    shader_location: 0,
                }],
            })],
        },
        primitive: PrimitiveState {
            topology: PrimitiveTopology::TriangleList,
            front_face: FrontFace::Ccw,
            cull_mode: None,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: options(&[]),
            targets: &[Some(ColorTargetState {
                format: MARKER_FORMAT,
                blend: None,
                write_mask: ColorWrites::empty(),
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Draws the whole mesh of every object.
pub(super) fn draw_mesh(
    r: &mut Recorder,
    pass: Pass,
    pipeline: &RenderPipeline,
    groups: &[BindGroup],
    mesh: &[MeshPart],
    targets: &Targets,
) {
    let mut render = r.encoder.begin_render_pass(&RenderPassDescriptor {
        label: Some(pass.name()),
        color_attachments: &[Some(RenderPassColorAttachment {
            view: &targets.marker,
            depth_slice: None,
            resolve_target: None,
            ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Discard },
        })],
        depth_stencil_attachment: None,
        timestamp_writes: r.timers.render(pass),
        occlusion_query_set: None,
        multiview_mask: None,
    });
    render.set_pipeline(pipeline);
    Recorder::aim(r.common, r.view_offset, r.lot.size, &mut render);
    for (group, part) in groups.iter().zip(mesh) {
        render.set_bind_group(1, group, &[]);
        render.set_vertex_buffer(0, part.corners.slice(..));
        render.set_index_buffer(part.indices.slice(..), IndexFormat::Uint32);
        render.draw_indexed(0..3 * part.triangle_count, 0, 0..r.lot.count);
    }
}
