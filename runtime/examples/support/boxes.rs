//! Opaque boxes with a plain shader: what stands for a host program's own renderer.

use diaphane_runtime::wgpu;
use glam::{Mat4, Vec3};
use wgpu::util::DeviceExt;

const SHADER: &str = "
struct Corner { @builtin(position) position: vec4f, @location(0) colour: vec3f }
@group(0) @binding(0) var<uniform> to_clip: mat4x4f;
@vertex fn corner(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) colour: vec3f) -> Corner {
    let light = 0.25 + 0.75 * max(dot(normal, normalize(vec3f(0.6, 0.7, 0.4))), 0.0);
    return Corner(to_clip * vec4f(position, 1.0), colour * light);
}
@fragment fn paint(in: Corner) -> @location(0) vec4f { return vec4f(in.colour, 1.0); }
";

/// A few boxes and how to draw them.
pub struct Boxes {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    corners: wgpu::Buffer,
    count: u32,
}

impl Boxes {
    /// A floor, two pillars and a low wall; depth is reversed: 0 is far away.
    pub fn new(
        device: &wgpu::Device,
        colour: wgpu::TextureFormat,
        depth: wgpu::TextureFormat,
        to_clip: Mat4,
    ) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("boxes"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("boxes"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: 36,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &attributes,
                })],
            },
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: depth,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &[Some(colour.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let buffer = |usage, contents: &[u8]| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("boxes"),
                contents,
                usage,
            })
        };
        let matrix = buffer(wgpu::BufferUsages::UNIFORM, bytemuck::bytes_of(&to_clip));
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("boxes"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: matrix.as_entire_binding() }],
        });
        let wood = Vec3::new(0.3, 0.2, 0.1);
        let corners: Vec<[Vec3; 3]> = [
            cuboid(Vec3::new(-2.0, -0.6, -2.0), Vec3::new(2.0, -0.4, 2.0), Vec3::splat(0.08)),
            cuboid(Vec3::new(0.42, -0.4, 0.45), Vec3::new(0.5, 0.35, 0.53), wood),
            cuboid(Vec3::new(-0.2, -0.4, -0.4), Vec3::new(-0.1, 0.45, -0.3), wood),
            cuboid(Vec3::new(-1.5, -0.4, -1.5), Vec3::new(1.5, -0.1, -1.35), Vec3::new(0.08, 0.12, 0.2)),
        ]
        .concat();
        let count = corners.len() as u32;
        let corners = buffer(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&corners));
        Self { pipeline, group, corners, count }
    }

    /// Draws them on a fresh picture.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        colour: &wgpu::TextureView,
        depth: &wgpu::TextureView,
    ) {
        let mut pass = pass(encoder, colour, depth, true);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.draw(0..self.count, 0..1);
    }
}

/// A pass over colour and depth, cleared or as they are.
pub fn pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    depth: &wgpu::TextureView,
    clear: bool,
) -> wgpu::RenderPass<'a> {
    let sky = wgpu::Color { r: 0.02, g: 0.03, b: 0.05, a: 1.0 };
    let (sky, far) = if clear {
        (wgpu::LoadOp::Clear(sky), wgpu::LoadOp::Clear(0.0))
    } else {
        (wgpu::LoadOp::Load, wgpu::LoadOp::Load)
    };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("host"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: colour,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: sky, store: wgpu::StoreOp::Store },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations { load: far, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

/// Position, normal and colour of the corners of a box's triangles.
fn cuboid(low: Vec3, high: Vec3, colour: Vec3) -> Vec<[Vec3; 3]> {
    let mut corners = Vec::with_capacity(36);
    for axis in 0..3 {
        for (side, at) in [(-1.0, low[axis]), (1.0, high[axis])] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut normal = Vec3::ZERO;
            normal[axis] = side;
            let corner = |a: bool, b: bool| {
                let mut p = Vec3::ZERO;
                (p[axis], p[u], p[v]) =
                    (at, if a { high[u] } else { low[u] }, if b { high[v] } else { low[v] });
                [p, normal, colour]
            };
            let [a, b, c, d] =
                [corner(false, false), corner(true, false), corner(true, true), corner(false, true)];
            corners.extend([a, b, c, a, c, d]);
        }
    }
    corners
}
