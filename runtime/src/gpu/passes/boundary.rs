//! The boundary pass: Fresnel reflectance of every crossing and the highlight of the first entry.

use super::super::bindings::{Slot, group, layout, pipeline_layout};
use super::super::frame::FrameBuffers;
use super::super::mesh::MeshPart;
use super::super::shaders;
use super::super::targets::{BOUNDARY, Targets};
use super::super::timers::Pass;
use super::Recorder;
use super::surface::{draw_mesh, mesh_pipeline};
use wgpu::{BindGroup, BindGroupLayout, Device, RenderPipeline, ShaderStages};

/// See boundary.wgsl.
#[derive(Clone)]
pub(crate) struct Boundary {
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

impl Boundary {
    pub fn new(device: &Device, common: &BindGroupLayout) -> Self {
        use Slot::{Read, Write};
        let slots = [Read, Read, Write, Read, Read, Read, Write];
        let layout = layout(device, "boundary", ShaderStages::VERTEX_FRAGMENT, &slots);
        let pipeline_layout = pipeline_layout(device, "boundary", common, &layout);
        let module = shaders::module(device, "boundary", shaders::BOUNDARY);
        let pipeline = mesh_pipeline(device, "boundary", &pipeline_layout, &module, "reflect_at");
        Self { layout, pipeline }
    }

    pub fn bind(
        &self,
        device: &Device,
        part: &MeshPart,
        frame: &FrameBuffers,
        targets: &Targets,
    ) -> BindGroup {
        let resources = [
            &part.positions,
            &part.triangles,
            &targets.crossings,
            &part.neighbours,
            &part.normals,
            &frame.lights,
            &targets.boundary,
        ];
        group(device, "boundary", &self.layout, resources.map(|b| b.as_entire_binding()).into())
    }

    /// With a group for each part of the mesh.
    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], mesh: &[MeshPart], targets: &Targets) {
        r.clear_pixels(&targets.boundary, BOUNDARY);
        draw_mesh(r, Pass::Boundary, &self.pipeline, groups, mesh, targets);
    }
}
