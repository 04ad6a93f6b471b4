//! Exact optical depths on the GPU: a ray for every sample, to one light.

use super::bindings::{
    Slot, compute, empty_buffer, filled_buffer, group, layout, most_bound, pipeline_layout,
};
use super::device::GpuDevice;
use super::frame::common_layout;
use super::hierarchy::{Hierarchy, Node};
use super::lot::MOST_VIEWS;
use super::readback;
use super::shaders;
use super::uniforms::{MediumUniform, ViewUniform};
use crate::frame::{FrameLight, LightKind};
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use diaphane_formats::asset::Info;
use diaphane_formats::mesh::Mesh;
use glam::Vec3;
use std::ops::Range;
use wgpu::{
    BindGroup, Buffer, BufferUsages, ComputePassDescriptor, ComputePipeline, Device, Queue, ShaderStages,
};

/// Most threads of a dispatch: workgroups of 64 along one axis.
const MOST: usize = 64 * 65_535;

/// `Request` of depths.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Request {
    place: Vec3,
    far: u32,
    first: u32,
    count: u32,
    density: f32,
    unused: u32,
}

/// What traces depths from the samples of an asset.
pub struct GpuDepths {
    device: Device,
    queue: Queue,
    pipeline: ComputePipeline,
    common: BindGroup,
    group: BindGroup,
    request: Buffer,
    depths: Buffer,
    density: f32,
}

impl GpuDepths {
    /// For an asset of even density whose values hold at `places`; `None` where shells overlap or cross themselves, or the mesh or the samples are too
    /// large for a binding.
    pub fn new(owned: &GpuDevice, mesh: &Mesh, info: &Info, places: &[Vec3]) -> Option<Self> {
        // Where the medium counts once although the boundary encloses it twice.
        let report = &info.provenance.mesh_report;
        let overlap =
            report.mending.overlapping > 0 || report.self_intersections > 0 || report.non_manifold_edges > 0;
        let most = most_bound(&owned.device);
        let too_many = places.is_empty() || places.len() > MOST || 16 * places.len() as u64 > most;
        if overlap || too_many || mesh.triangles.is_empty() {
            return None;
        }
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.as_vec3().to_array()).collect();
        let hierarchy = Hierarchy::new(&positions, &mesh.triangles);
        hierarchy.fits(most).then(|| Self::upload(owned, info, places, &hierarchy))
    }

    fn upload(owned: &GpuDevice, info: &Info, places: &[Vec3], hierarchy: &Hierarchy) -> Self {
        use Slot::{Read, Uniform, Write};
        let GpuDevice { device, queue, .. } = owned;
        let (storage, uniform) = (BufferUsages::STORAGE, BufferUsages::UNIFORM);
        let common = common_layout(device);
        let own = layout(device, "depths", ShaderStages::COMPUTE, &[Read, Read, Read, Uniform, Write]);
        let module = shaders::module(device, "depths", shaders::DEPTHS);
        let flag = |b: bool| f64::from(u8::from(b));
        let constants = [("FRESNEL", flag(info.ior != 1.0)), ("WATCHED", flag(owned.is_software()))];
        let pipeline_layout = pipeline_layout(device, "depths", &common, &own);
        let pipeline = compute(device, "depths", &pipeline_layout, &module, &constants);
        let view = filled_buffer(device, "no view", &[ViewUniform::zeroed(); MOST_VIEWS], uniform);
        let medium = filled_buffer(
            device,
            "medium",
            &[MediumUniform { ior: info.ior as f32, ..MediumUniform::zeroed() }],
            uniform,
        );
        let nodes = filled_buffer::<Node>(device, "hierarchy", &hierarchy.nodes, storage);
        let corners = filled_buffer(device, "corners", &hierarchy.corners, storage);
        let places: Vec<[f32; 4]> = places.iter().map(|p| p.extend(0.0).to_array()).collect();
        let request =
            empty_buffer(device, "request", size_of::<Request>() as u64, uniform | BufferUsages::COPY_DST);
        let depths =
            empty_buffer(device, "depths", 8 * places.len() as u64, storage | BufferUsages::COPY_SRC);
        let places = filled_buffer(device, "places", &places, storage);
        let resources = [&nodes, &corners, &places, &request, &depths];
        Self {
            common: group(
                device,
                "common",
                &common,
                vec![view.as_entire_binding(), medium.as_entire_binding()],
            ),
            group: group(device, "depths", &own, resources.map(|b| b.as_entire_binding()).into()),
            device: device.clone(),
            queue: queue.clone(),
            pipeline,
            request,
            depths,
            density: info.uniform_density as f32,
        }
    }

    /// Depths of some samples as [`crate::exact::Depths`] holds them; below 0 where a software adapter gave up. Waits for the device.
    ///
    /// # Errors
    /// The device failed.
    pub fn trace(&self, light: &FrameLight, range: Range<usize>) -> Result<Vec<[f32; 2]>> {
        let far = light.kind == LightKind::Directional;
        let request = Request {
            place: if far { light.direction } else { light.position },
            far: u32::from(far),
            first: range.start as u32,
            count: range.len() as u32,
            density: self.density,
            unused: 0,
        };
        self.queue.write_buffer(&self.request, 0, bytemuck::bytes_of(&request));
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder
            .begin_compute_pass(&ComputePassDescriptor { label: Some("depths"), timestamp_writes: None });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.common, &[0]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.dispatch_workgroups(request.count.div_ceil(64), 1, 1);
        drop(pass);
        self.queue.submit([encoder.finish()]);
        let size = 8 * range.len() as u64;
        let copies = readback::buffers(&self.device, &self.queue, &[(&self.depths, size)])?;
        let failed = |_| Error::Gpu("the device did not hand depths back".to_owned());
        let copy = copies.first().ok_or_else(|| failed(()))?;
        let view = copy.get_mapped_range(..).map_err(|_| failed(()))?;
        // Buffers are larger than a single sample's depths.
        Ok(view.chunks_exact(8).take(range.len()).map(bytemuck::pod_read_unaligned).collect())
    }
}
