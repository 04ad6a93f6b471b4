//! Buffers of an asset, and of a frame's rays and lights.

use super::bindings::{Slot, empty_buffer, filled_buffer, group, layout};
use super::neighbours::neighbours;
use super::packed;
use super::targets::PixelState;
use super::uniforms::{LightRecord, MediumUniform, ViewUniform};
use crate::cpu::lighting::Lighting;
use crate::cpu::surface::corner_normals;
use crate::exact::ExactDepths;
use crate::fold::{Ambient, Linear, Plan};
use crate::frame::Frame;
use crate::usable::{density_at, usable_samples};
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info, Samples};
use diaphane_formats::hits::DENSE;
use diaphane_formats::slopes::{NEIGHBOURS, Stencil};
use diaphane_formats::{kernel, sh};
use glam::Vec3;
use half::f16;
use std::sync::Arc;
use wgpu::{BindGroup, BindGroupLayout, Buffer, BufferBinding, BufferUsages, Device, Queue, ShaderStages};

/// Everything that stays as long as the asset does.
#[derive(Clone)]
pub(super) struct AssetBuffers {
    pub medium: Buffer,
    /// What [`Self::medium`] holds.
    pub material: MediumUniform,
    pub positions: Buffer,
    pub triangles: Buffer,
    pub neighbours: Buffer,
    pub normals: Buffer,
    pub samples: Buffer,
    /// A sphere around every [`CLUSTER`] kernels that follow each other; radius 0 without any.
    pub clusters: Buffer,
    pub weights: Buffer,
    pub depth: Buffer,
    pub boundary: Buffer,
    pub recurrence: Buffer,
    /// Layout and profiles of the harmonics' bands.
    pub bands: Buffer,
    /// Where each sample's codes are, and its scales.
    pub packed: Buffer,
    pub grid: Buffer,
    /// Where values hold, and the density there.
    pub centroids: Buffer,
    /// Gradient stencils.
    pub spokes: Buffer,
    /// Written by the lighting pass.
    pub values: Buffer,
    /// Written by the slopes pass.
    pub sources: Buffer,
    /// As they are played.
    pub info: Info,
    /// Kept for the transmittance of folded lights.
    source: Arc<Samples>,
    /// Of the grid; 1 without.
    most_density: f32,
    /// Of the widest kernel.
    least_sharpness: f32,
    /// How far kernels reach, mesh units: the mean over the samples.
    pub reach: f32,
    pub sample_count: u32,
    pub samples_drawn: u64,
    pub triangle_count: u32,
    pub diagonal: f32,
    pub fresnel: bool,
    pub boundary_order: usize,
    pub heterogeneous: bool,
}

impl AssetBuffers {
    /// Uploads an asset.
    ///
    /// # Errors
    /// An asset that makes no sense, or one that is too large for the adapter's buffers.
    pub fn new(device: &Device, asset: &Asset) -> Result<Self> {
        asset.validate()?;
        let (samples, info) = (usable_samples(asset), &asset.info);
        let fresnel = info.ior != 1.0;
        let kernels: Vec<[f32; 4]> = samples
            .position_radius
            .iter()
            .map(|&[x, y, z, radius]| [x, y, z, kernel::sharpness(radius, info.width_factor)])
            .collect();
        let density = density_at(info, asset.density.as_ref());
        // The shader limits the slopes itself, for whatever extinction is played.
        let stencil = Stencil::new(&samples, |_| 0.0);
        let centroids: Vec<[f32; 4]> =
            stencil.centroid.iter().map(|c| c.extend(density(*c)).to_array()).collect();
        let spokes: Vec<[f32; 4]> = stencil
            .spokes
            .as_flattened()
            .iter()
            .map(|s| s.gradient.extend(f32::from_bits(s.neighbour)).to_array())
            .collect();
        let normals = if fresnel { corner_normals(&asset.mesh()?) } else { Vec::new() };
        let recurrence: Vec<[f32; 4]> = sh::shader_table().iter().map(|&[a, b]| [a, b, 0.0, 0.0]).collect();
        let grid = asset.density.as_ref().map_or(&[][..], |g| &g.values);
        let material = MediumUniform::new(asset);
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let largest = [
            samples.depth.codes.len() + 8,
            samples.boundary.codes.len() + 8,
            16 * NEIGHBOURS * kernels.len(),
            36 * asset.mesh_triangles.len(),
            12 * asset.mesh_positions.len(),
            4 * grid.len(),
        ];
        if let Some(size) = largest.into_iter().map(|s| s as u64).max().filter(|&s| s > most) {
            return Err(Error::Gpu(format!(
                "the asset needs a buffer of {} MiB, the adapter allows {} MiB",
                size >> 20,
                most >> 20
            )));
        }
        if asset.mesh_triangles.len() > (u32::MAX / 3) as usize {
            return Err(Error::Gpu("the mesh has too many triangles".to_owned()));
        }
        let storage = BufferUsages::STORAGE;
        Ok(Self {
            positions: filled_buffer(device, "positions", &asset.mesh_positions, storage),
            triangles: filled_buffer(device, "triangles", &asset.mesh_triangles, storage),
            neighbours: filled_buffer(device, "neighbours", &neighbours(&asset.mesh_triangles), storage),
            normals: filled_buffer(device, "normals", normals.as_flattened(), storage),
            samples: filled_buffer(device, "samples", &kernels, storage),
            clusters: filled_buffer(device, "clusters", &clusters(&kernels, &samples.weight), storage),
            weights: filled_buffer(device, "weights", &samples.weight, storage),
            depth: filled_buffer(device, "depth", &packed::words(&samples.depth), storage),
            boundary: filled_buffer(device, "boundary", &packed::words(&samples.boundary), storage),
            recurrence: filled_buffer(device, "recurrence", &recurrence, BufferUsages::UNIFORM),
            bands: filled_buffer(device, "bands", &packed::bands(&samples), BufferUsages::UNIFORM),
            packed: filled_buffer(device, "packed", &packed::records(&samples), storage),
            grid: filled_buffer(device, "grid", grid, storage),
            centroids: filled_buffer(device, "centroids", &centroids, storage),
            spokes: filled_buffer(device, "spokes", &spokes, storage),
            values: empty_buffer(device, "values", 16 * kernels.len() as u64, storage),
            sources: empty_buffer(device, "sources", 64 * kernels.len() as u64, storage),
            info: info.clone(),
            most_density: if grid.is_empty() {
                1.0
            } else {
                grid.iter().map(|v| v[0].to_f32()).fold(0.0, f32::max)
            },
            least_sharpness: kernels.iter().map(|k| k[3]).fold(f32::INFINITY, f32::min),
            reach: kernels.iter().map(|k| kernel::CUT_OFF_RADIUS / k[3]).sum::<f32>()
                / kernels.len().max(1) as f32,
            sample_count: kernels.len() as u32,
            samples_drawn: samples.weight.iter().filter(|w| **w > 0.0).count() as u64,
            triangle_count: asset.mesh_triangles.len() as u32,
            diagonal: info.diagonal(),
            fresnel,
            boundary_order: info.boundary_order as usize,
            heterogeneous: asset.density.is_some(),
            medium: filled_buffer(
                device,
                "medium",
                &[material],
                BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            ),
            material,
            source: Arc::new(samples),
        })
    }

    /// Takes extinction and albedo from an edited asset's parameters: a few bytes to upload.
    pub fn set_material(&mut self, queue: &Queue, info: &Info) {
        self.material.set_material(info, self.heterogeneous);
        self.info = info.clone();
        queue.write_buffer(&self.medium, 0, bytemuck::bytes_of(&self.material));
    }

    /// The same object once more, with values and sources of its own.
    pub fn instance(&self, device: &Device) -> Self {
        let own =
            |label: &str, like: &Buffer| empty_buffer(device, label, like.size(), BufferUsages::STORAGE);
        Self { values: own("values", &self.values), sources: own("sources", &self.sources), ..self.clone() }
    }

    /// Gives this instance a medium of its own.
    pub fn own_medium(&mut self, device: &Device) {
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        self.medium = filled_buffer(device, "medium", &[self.material], usage);
    }

    /// What it keeps for a pixel.
    pub fn pixel_state(&self) -> PixelState {
        PixelState { fresnel: self.fresnel, heterogeneous: self.heterogeneous }
    }

    /// The code that the material needs.
    pub fn variant(&self) -> Variant {
        Variant {
            grey: self.material.is_grey(),
            dense: self.material.kappa.max_element() * self.most_density > DENSE * self.least_sharpness,
            heterogeneous: self.heterogeneous,
        }
    }

    /// Columns and rows of workgroups with 64 threads that give each sample one.
    pub fn sample_groups(&self) -> [u32; 2] {
        const ROW: u32 = 1024;
        let groups = self.sample_count.div_ceil(64);
        [groups.min(ROW), groups.div_ceil(ROW)]
    }
}

/// What the code of a splat depends on; compiled anew where it changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Variant {
    /// All channels attenuate alike.
    grey: bool,
    /// The medium is too dense over some kernel for the fast form of its integral.
    dense: bool,
    heterogeneous: bool,
}

impl Variant {
    /// As overrides of the shaders.
    pub fn constants(self) -> [(&'static str, f64); 3] {
        let number = |b: bool| f64::from(u8::from(b));
        [
            ("GREY", number(self.grey)),
            ("DENSE", number(self.dense)),
            ("HETEROGENEOUS", number(self.heterogeneous)),
        ]
    }
}

/// Samples of a cluster.
const CLUSTER: usize = 64;

/// Spheres around the supports of [`CLUSTER`] kernels each (position, sharpness), as far as they have weight.
fn clusters(kernels: &[[f32; 4]], weights: &[f32]) -> Vec<[f32; 4]> {
    let sphere = |(kernels, weights): (&[[f32; 4]], &[f32])| {
        let drawn = || kernels.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(k, _)| *k);
        let centre = |k: [f32; 4]| Vec3::new(k[0], k[1], k[2]);
        let low = drawn().map(centre).fold(Vec3::INFINITY, Vec3::min);
        let high = drawn().map(centre).fold(Vec3::NEG_INFINITY, Vec3::max);
        let middle = if low.is_finite() { 0.5 * (low + high) } else { Vec3::ZERO };
        let reach = |k: [f32; 4]| middle.distance(centre(k)) + kernel::CUT_OFF_RADIUS / k[3];
        middle.extend(drawn().map(reach).fold(0.0, f32::max)).to_array()
    };
    kernels.chunks(CLUSTER).zip(weights.chunks(CLUSTER)).map(sphere).collect()
}

/// Distance between two rays' uniforms: the largest alignment that an adapter may ask for.
pub(super) const VIEW_STRIDE: u64 = 256;

/// Buffers that follow the frame. They grow when they must; [`Self::changed`] then tells that groups are stale.
pub(super) struct FrameBuffers {
    views: Buffer,
    pub lights: Buffer,
    pub exact: Buffer,
    /// Transmittance for folded lights, of the material whose ratio this is.
    pub linear: Buffer,
    known: Option<(Vec3, Linear)>,
    /// What folded lights send.
    pub ambient: Buffer,
    common: BindGroup,
    changed: bool,
    /// Which lights are evaluated how.
    pub plan: Plan,
    /// Share of the lights that baked means serve.
    pub means: f32,
    /// Place of the scene's first light among the records.
    pub first_scene_light: u32,
}

/// The layout of the group that all passes share: the ray's view and the medium.
pub(super) fn common_layout(device: &Device) -> BindGroupLayout {
    layout(
        device,
        "common",
        ShaderStages::VERTEX_FRAGMENT | ShaderStages::COMPUTE,
        &[Slot::Moving, Slot::Uniform],
    )
}

fn common_group(device: &Device, layout: &BindGroupLayout, views: &Buffer, medium: &Buffer) -> BindGroup {
    let view = wgpu::BindingResource::Buffer(BufferBinding {
        buffer: views,
        offset: 0,
        size: wgpu::BufferSize::new(size_of::<ViewUniform>() as u64),
    });
    group(device, "common", layout, vec![view, medium.as_entire_binding()])
}

impl FrameBuffers {
    /// Small buffers to start with.
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        let views =
            empty_buffer(device, "views", VIEW_STRIDE, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        Self {
            common: common_group(device, common, &views, &asset.medium),
            views,
            lights: empty_buffer(device, "lights", 64, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            exact: empty_buffer(device, "exact", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            linear: empty_buffer(device, "linear", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            known: None,
            ambient: empty_buffer(device, "ambient", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            changed: true,
            plan: Plan::default(),
            means: 1.0,
            first_scene_light: 0,
        }
    }

    /// Binds another medium.
    pub fn renew(&mut self, device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) {
        self.common = common_group(device, common, &self.views, &asset.medium);
    }

    /// The shared group; set it with an offset of [`VIEW_STRIDE`] times the view's index.
    pub fn common(&self) -> &BindGroup {
        &self.common
    }

    /// Whether a buffer was replaced since the last call.
    pub fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// Writes the views of the rays to come, at multiples of [`VIEW_STRIDE`].
    pub fn write_views(
        &mut self,
        device: &Device,
        queue: &Queue,
        layout: &BindGroupLayout,
        asset: &AssetBuffers,
        views: &[ViewUniform],
    ) {
        let mut bytes = vec![0; views.len() * VIEW_STRIDE as usize];
        for (place, view) in bytes.chunks_exact_mut(VIEW_STRIDE as usize).zip(views) {
            place[..size_of::<ViewUniform>()].copy_from_slice(bytemuck::bytes_of(view));
        }
        if self.views.size() < bytes.len() as u64 {
            let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
            self.views = empty_buffer(device, "views", bytes.len() as u64, usage);
            self.common = common_group(device, layout, &self.views, &asset.medium);
        }
        queue.write_buffer(&self.views, 0, &bytes);
    }

    /// Writes the lights and the exact depth tables that serve some of them.
    ///
    /// # Errors
    /// The tables are too large for the adapter's buffers.
    pub fn write_lights(
        &mut self,
        device: &Device,
        queue: &Queue,
        asset: &AssetBuffers,
        frame: &Frame,
        exact: Option<&ExactDepths>,
    ) -> Result<()> {
        self.means = frame.share_of_means(exact);
        self.plan = Plan::new(frame, &asset.info, exact);
        self.fold(device, queue, asset, frame);
        // Those that are evaluated first, an environment's in front; then the scene's others, for highlights alone.
        let is_single = |l: usize| self.plan.single.binary_search(&l).is_ok();
        let environment = self.plan.single.iter().copied().filter(|l| *l >= frame.scene_lights);
        let scene = self.plan.single.iter().copied().filter(|l| *l < frame.scene_lights);
        let others = (0..frame.scene_lights).filter(|l| !is_single(*l));
        self.first_scene_light = environment.clone().count() as u32;
        let mut tables: Vec<&[[f32; 2]]> = Vec::new();
        let mut records = Vec::with_capacity(frame.lights.len());
        for l in environment.chain(scene).chain(others) {
            let table = exact.and_then(|e| e.light(l)).filter(|t| t.len() == asset.sample_count as usize);
            let slot = table.map(|t| {
                tables.push(t);
                tables.len() as u32 - 1
            });
            records.push(LightRecord::new(&frame.lights[l], slot));
        }
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let table_bytes = 8 * u64::from(asset.sample_count);
        let size = table_bytes * tables.len() as u64;
        if size > most || (records.len() * size_of::<LightRecord>()) as u64 > most {
            return Err(Error::Gpu(format!(
                "{} lights with exact depths for {} samples do not fit the adapter's buffers ({} MiB)",
                tables.len(),
                asset.sample_count,
                most >> 20
            )));
        }
        self.changed |=
            grow(device, &mut self.lights, "lights", (records.len() * size_of::<LightRecord>()) as u64);
        self.changed |= grow(device, &mut self.exact, "exact", size);
        if !records.is_empty() {
            queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&records));
        }
        for (k, table) in tables.iter().enumerate() {
            queue.write_buffer(&self.exact, k as u64 * table_bytes, bytemuck::cast_slice(table));
        }
        Ok(())
    }
}

impl FrameBuffers {
    /// Uploads what the fold pass needs for the lights that the plan folds. Where its coefficients do not fit the adapter
    /// the lights are evaluated one by one.
    fn fold(&mut self, device: &Device, queue: &Queue, asset: &AssetBuffers, frame: &Frame) {
        if self.plan.folded.is_empty() {
            return;
        }
        let ratio = asset.material.ratio;
        if self.known.as_ref().is_none_or(|(known, _)| *known != ratio) {
            let lighting = Lighting::new(&asset.info, &asset.source);
            let limits = device.limits();
            let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
            let Some(bands) = Linear::fitting(asset.source.len(), lighting.channels(), most) else {
                self.plan.single.append(&mut self.plan.folded);
                self.plan.single.sort_unstable();
                return;
            };
            let linear =
                Linear::new(asset.source.len(), bands, lighting.channels(), lighting.order(), |i, to, b| {
                    lighting.arriving(i, to, b)
                });
            let packed: Vec<f16> = linear.values.iter().map(|v| f16::from_f32(*v)).collect();
            self.changed |= grow(device, &mut self.linear, "linear", 2 * packed.len() as u64);
            queue.write_buffer(&self.linear, 0, bytemuck::cast_slice(&packed));
            self.known = Some((ratio, Linear { values: Vec::new(), ..linear }));
        }
        let Some((_, linear)) = &self.known else { return };
        let lights = self.plan.folded.iter().filter_map(|l| frame.lights.get(*l));
        let ambient = Ambient::new(lights, asset.material.mean_cosine, frame.view.origin, linear.bands);
        let vectors = ambient.values.len() / ambient.count;
        let header = [ambient.count, vectors, linear.channels, 0].map(|n| f32::from_bits(n as u32));
        let bytes: Vec<[f32; 4]> = std::iter::once(header).chain(ambient.values).collect();
        self.changed |= grow(device, &mut self.ambient, "ambient", 16 * bytes.len() as u64);
        queue.write_buffer(&self.ambient, 0, bytemuck::cast_slice(&bytes));
    }

    /// Error of the transmittance that folded lights see.
    pub fn fold_error(&self) -> f32 {
        self.known.as_ref().map_or(0.0, |(_, linear)| linear.error)
    }
}

/// Replaces a storage buffer that is too small; says whether it did.
fn grow(device: &Device, buffer: &mut Buffer, label: &str, size: u64) -> bool {
    let small = buffer.size() < size;
    if small {
        *buffer = empty_buffer(device, label, size, BufferUsages::STORAGE | BufferUsages::COPY_DST);
    }
    small
}
