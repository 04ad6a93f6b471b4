//! Buffers and passes of the rivals, and the drawing of one picture.

use super::lattice::Lattice;
use super::parts::Patience;
use super::uniforms::{Part, SettingsUniform};
use super::{Drawn, Settings};
use crate::frame::Frame;
use crate::gpu::bindings::{
    Slot, compute, empty_buffer, filled_buffer, group, layout, most_bound, pipeline_layout,
};
use crate::gpu::device::GpuDevice;
use crate::gpu::frame::{VIEW_STRIDE, common_layout};
use crate::gpu::hierarchy::{Hierarchy, Node};
use crate::gpu::lot::MOST_VIEWS;
use crate::gpu::tiles::Tile;
use crate::gpu::uniforms::{LightLayout, LightRecord, MediumUniform, ViewUniform};
use crate::gpu::{readback, shaders};
use crate::{Error, Result};
use bytemuck::Zeroable;
use diaphane_formats::asset::Asset;
use diaphane_formats::picture::Picture;
use glam::Vec3;
use std::time::Instant;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, BufferBinding, BufferUsages, ComputePassDescriptor,
    ComputePassTimestampWrites, ComputePipeline, Device, Features, QuerySet, QuerySetDescriptor, QueryType,
    ShaderStages,
};

/// Threads of a row of workgroups in fill.wgsl.
const ROW: u32 = 65536;

/// What stays.
pub(super) struct Stage {
    common: BindGroupLayout,
    /// Of march.wgsl and of fill.wgsl: the same but for the last two bindings.
    own: [BindGroupLayout; 2],
    march: ComputePipeline,
    look_up: ComputePipeline,
    fill: ComputePipeline,
    medium: Buffer,
    nodes: Buffer,
    corners: Buffer,
    voxels: Buffer,
    node_count: u32,
    /// Shortest edge of a voxel, mesh units.
    voxel: f32,
    diagonal: f32,
    pub heterogeneous: bool,
    patience: Patience,
    clock: Option<Clock>,
    period: f64,
}

/// Two ticks.
struct Clock {
    set: QuerySet,
    resolved: Buffer,
}

/// A grid on the adapter.
pub(super) struct Grid {
    lattice: Lattice,
    listed: Buffer,
    values: Buffer,
}

impl Grid {
    pub fn new(device: &Device, lattice: Lattice) -> Self {
        let listed = filled_buffer(device, "listed", &lattice.listed, BufferUsages::STORAGE);
        let values = empty_buffer(device, "values", 16 * lattice.nodes(), BufferUsages::STORAGE);
        Self { lattice, listed, values }
    }
}

/// Dispatches of one pass: columns and rows of workgroups of each.
struct Work<'a> {
    pipeline: &'a ComputePipeline,
    group: BindGroup,
    parts: Vec<[u32; 2]>,
}

impl Stage {
    pub fn new(owned: &GpuDevice, asset: &Asset, hierarchy: &Hierarchy) -> Self {
        use Slot::{Moving, Read, Write};
        let device = &owned.device;
        let common = common_layout(device);
        let slots = [Read, Read, Read, Read, Moving, Read, Write];
        let own = ["march", "fill"].map(|name| layout(device, name, ShaderStages::COMPUTE, &slots));
        let heterogeneous = asset.density.is_some();
        let pipeline = |kind: usize, source, more: &[(&str, f64)]| {
            let module = shaders::module(device, "rival", source);
            let layout = pipeline_layout(device, "rival", &common, &own[kind]);
            let flag = |b: bool| f64::from(u8::from(b));
            let own = [("HETEROGENEOUS", flag(heterogeneous)), ("WATCHED", flag(owned.is_software()))];
            let constants = [&own[..], more].concat();
            compute(device, "rival", &layout, &module, &constants)
        };
        let march = pipeline(0, shaders::RIVAL_MARCH, &[("GRID", 0.0)]);
        let look_up = pipeline(0, shaders::RIVAL_MARCH, &[("GRID", 1.0)]);
        let fill = pipeline(1, shaders::RIVAL_FILL, &[]);
        let voxel = asset.density.as_ref().map_or(1.0, |g| {
            let size = Vec3::from(g.max) - Vec3::from(g.min);
            (size / Vec3::from(g.size.map(|n| n as f32))).min_element()
        });
        let voxels = asset.density.as_ref().map_or(&[][..], |g| &g.values);
        let clock = device.features().contains(Features::TIMESTAMP_QUERY).then(|| Clock {
            set: device.create_query_set(&QuerySetDescriptor {
                label: Some("clock"),
                ty: QueryType::Timestamp,
                count: 2,
            }),
            resolved: empty_buffer(device, "clock", 16, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
        });
        let storage = BufferUsages::STORAGE;
        Self {
            medium: filled_buffer(device, "medium", &[MediumUniform::new(asset)], BufferUsages::UNIFORM),
            nodes: filled_buffer::<Node>(device, "hierarchy", &hierarchy.nodes, storage),
            corners: filled_buffer(device, "corners", &hierarchy.corners, storage),
            voxels: filled_buffer(device, "voxels", voxels, storage),
            node_count: hierarchy.nodes.len() as u32,
            voxel,
            diagonal: asset.info.diagonal(),
            heterogeneous,
            patience: Patience::of(owned.is_software(), heterogeneous),
            clock,
            period: f64::from(owned.queue.get_timestamp_period()),
            common,
            own,
            march,
            look_up,
            fill,
        }
    }

    /// Draws a frame, with light from `grid` or else from shadow rays.
    pub fn draw(
        &self,
        owned: &GpuDevice,
        frame: &Frame,
        settings: Settings,
        grid: Option<&Grid>,
    ) -> Result<Drawn> {
        let started = Instant::now();
        let device = &owned.device;
        let bytes = 16 * u64::from(frame.width) * u64::from(frame.height);
        let most = most_bound(device);
        if bytes > most || (size_of::<LightRecord>() * frame.lights.len()) as u64 > most {
            return Err(Error::Rival("picture or lights are too large for the rivals".to_owned()));
        }
        let lights = frame.lights.iter().map(|l| LightRecord::new(l, None, true));
        let lights: Vec<LightRecord> = lights.chain([LightRecord::zeroed()]).collect();
        let lights = filled_buffer(device, "lights", &lights, BufferUsages::STORAGE);
        let radiance =
            empty_buffer(device, "radiance", bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        // Read where there is no grid, but never looked at.
        let nothing = empty_buffer(device, "nothing", 16, BufferUsages::STORAGE);
        let mut shared =
            SettingsUniform::new(self.node_count, settings.steps.max(1), settings.stride * self.voxel);
        if let Some(grid) = grid {
            shared = shared.with_grid(&grid.lattice);
        }
        let count = frame.lights.len() as u32;
        let fill = grid.map(|g| self.patience.cut(g.lattice.listed.len() as u32, 1, 1, count));
        let light = if grid.is_some() { 1 } else { count };
        let march = self.patience.cut(frame.height, frame.width, shared.steps, light);
        let uniforms: Vec<SettingsUniform> =
            fill.iter().flatten().chain(&march).map(|part| shared.part(part)).collect();
        let uniforms = moving(device, &uniforms);
        let bind = |kind: usize, read: &Buffer, write: &Buffer| {
            let settings = BindingResource::Buffer(BufferBinding {
                buffer: &uniforms,
                offset: 0,
                size: wgpu::BufferSize::new(size_of::<SettingsUniform>() as u64),
            });
            let [nodes, corners, lights, voxels, read, write] =
                [&self.nodes, &self.corners, &lights, &self.voxels, read, write]
                    .map(|b| b.as_entire_binding());
            let resources = vec![nodes, corners, lights, voxels, settings, read, write];
            group(device, "rival", &self.own[kind], resources)
        };
        let values = grid.map_or(&nothing, |g| &g.values);
        let pipeline = if grid.is_some() { &self.look_up } else { &self.march };
        let mut work = Vec::new();
        if let (Some(grid), Some(parts)) = (grid, fill) {
            let groups = |part: &Part| {
                let threads = part.places.end - part.places.start;
                [threads.min(ROW).div_ceil(64), threads.div_ceil(ROW)]
            };
            let group = bind(1, &grid.listed, &grid.values);
            work.push(Work { pipeline: &self.fill, group, parts: parts.iter().map(groups).collect() });
        }
        let groups =
            |part: &Part| [frame.width.div_ceil(8), (part.places.end - part.places.start).div_ceil(8)];
        let parts = march.iter().map(groups).collect();
        work.push(Work { pipeline, group: bind(0, values, &radiance), parts });
        self.submit(owned, &self.view(device, frame), &work);
        self.read(owned, frame, &radiance, started)
    }

    /// The group that all passes share.
    fn view(&self, device: &Device, frame: &Frame) -> BindGroup {
        let tile = Tile { start: [0; 2], size: [frame.width, frame.height] };
        let lights = LightLayout {
            single: frame.lights.len() as u32,
            first_scene_light: 0,
            means: 1.0,
            environment: 0,
            negligible: 0.0,
            slot: 0,
            first_light: 0,
            first_ambient: 0,
        };
        let mut views = [ViewUniform::zeroed(); MOST_VIEWS];
        views[0] = ViewUniform::new(frame, self.diagonal, tile, [0.5; 2], 1, lights);
        let view = filled_buffer(device, "view", &views, BufferUsages::UNIFORM);
        let resources = vec![view.as_entire_binding(), self.medium.as_entire_binding()];
        group(device, "common", &self.common, resources)
    }

    fn submit(&self, owned: &GpuDevice, common: &BindGroup, work: &[Work<'_>]) {
        let count: usize = work.iter().map(|w| w.parts.len()).sum();
        let dispatches = work.iter().flat_map(|w| w.parts.iter().map(move |groups| (w, *groups)));
        for (k, (work, [x, y])) in dispatches.enumerate() {
            let mut encoder = owned.device.create_command_encoder(&Default::default());
            let (first, last) = (k == 0, k + 1 == count);
            let ticks = self.clock.as_ref().filter(|_| first || last);
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
                label: Some("rival"),
                timestamp_writes: ticks.map(|clock| ComputePassTimestampWrites {
                    query_set: &clock.set,
                    beginning_of_pass_write_index: first.then_some(0),
                    end_of_pass_write_index: last.then_some(1),
                }),
            });
            pass.set_pipeline(work.pipeline);
            pass.set_bind_group(0, common, &[0]);
            pass.set_bind_group(1, &work.group, &[(k as u64 * VIEW_STRIDE) as u32]);
            pass.dispatch_workgroups(x, y, 1);
            drop(pass);
            if let Some(clock) = self.clock.as_ref().filter(|_| last) {
                encoder.resolve_query_set(&clock.set, 0..2, &clock.resolved, 0);
            }
            owned.queue.submit([encoder.finish()]);
        }
    }

    fn read(&self, owned: &GpuDevice, frame: &Frame, radiance: &Buffer, started: Instant) -> Result<Drawn> {
        let mut sources = vec![(radiance, radiance.size())];
        sources.extend(self.clock.as_ref().map(|c| (&c.resolved, 16)));
        let copies = readback::buffers(&owned.device, &owned.queue, &sources)?;
        owned.check()?;
        let bytes = |copy: &Buffer| {
            copy.get_mapped_range(..).map_err(|e| Error::Gpu(format!("cannot read the picture back: {e}")))
        };
        let texels = bytes(&copies[0])?;
        let frame_ms = started.elapsed().as_secs_f64() * 1e3;
        let mut picture = Picture::new(frame.width as usize, frame.height as usize);
        let texels = bytemuck::cast_slice::<u8, [f32; 4]>(&texels);
        picture.pixels.iter_mut().zip(texels).for_each(|(p, [r, g, b, _])| *p = [*r, *g, *b]);
        picture.coverage = Some(texels.iter().take(picture.pixels.len()).map(|t| t[3]).collect());
        if texels.iter().any(|t| t[3] < 0.0) {
            return Err(Error::Rival(
                "the software adapter ends loops too early for rays through this mesh".to_owned(),
            ));
        }
        let mut clock_ms = None;
        if let Some(copy) = copies.get(1) {
            let view = bytes(copy)?;
            let ticks = |i: usize| bytemuck::pod_read_unaligned::<u64>(&view[8 * i..8 * i + 8]);
            clock_ms = Some(ticks(1).saturating_sub(ticks(0)) as f64 * self.period * 1e-6);
        }
        Ok(Drawn { picture, frame_ms, clock_ms })
    }
}

/// Settings at multiples of [`VIEW_STRIDE`].
fn moving(device: &Device, settings: &[SettingsUniform]) -> Buffer {
    let mut bytes = vec![0u8; settings.len() * VIEW_STRIDE as usize];
    for (place, one) in bytes.chunks_exact_mut(VIEW_STRIDE as usize).zip(settings) {
        place[..size_of::<SettingsUniform>()].copy_from_slice(bytemuck::bytes_of(one));
    }
    filled_buffer(device, "settings", &bytes, BufferUsages::UNIFORM)
}
