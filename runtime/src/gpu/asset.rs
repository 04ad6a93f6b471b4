//! Buffers that stay as long as an asset does.

use super::bindings::{empty_buffer, filled_buffer};
use super::corners::Corners;
use super::faults::allocate;
use super::neighbours::neighbours;
use super::packed;
use super::pipeline::SplatPath;
use super::targets::PixelState;
use super::uniforms::MediumUniform;
use crate::cpu::surface::corner_normals;
use crate::rendered::MAX_PIECES;
use crate::usable::{density_at, usable_samples};
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info, Samples};
use diaphane_formats::hits::DENSE;
use diaphane_formats::slopes::{NEIGHBOURS, Stencil};
use diaphane_formats::{kernel, sh};
use glam::Vec3;
use std::sync::Arc;
use wgpu::{BindingResource, Buffer, BufferBinding, BufferSize, BufferUsages, Device, Queue};

/// Everything that stays as long as the asset does.
#[derive(Clone)]
pub(super) struct AssetBuffers {
    pub medium: Buffer,
    /// What [`Self::medium`] holds.
    pub material: MediumUniform,
    pub positions: Buffer,
    pub triangles: Buffer,
    /// Positions of the vertices that are drawn, and three of them for every triangle; see [`Corners`].
    pub corners: Buffer,
    pub indices: Buffer,
    pub neighbours: Buffer,
    pub normals: Buffer,
    /// Kernels, then a sphere around every [`CLUSTER`] of them that follow each other; radius 0 without any.
    pub samples: Buffer,
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
    /// Written by the outlines pass, and by the next instance's.
    pub outlines: Buffer,
    /// Whether a sample may meet each piece.
    pub shown: Buffer,
    /// As they are played.
    pub info: Info,
    /// Kept for the transmittance of folded lights.
    pub source: Arc<Samples>,
    /// Of the grid; 1 without.
    most_density: f32,
    /// Of the widest kernel.
    least_sharpness: f32,
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
    /// An asset that makes no sense, or one that is too large for the adapter's buffers or memory.
    pub fn allocate(device: &Device, asset: &Asset, path: SplatPath) -> Result<Self> {
        let what = || {
            let (samples, triangles) = (asset.samples.len(), asset.mesh_triangles.len());
            format!("an asset of {samples} samples and {triangles} triangles")
        };
        allocate(device, what, || Self::new(device, asset, path))
    }

    fn new(device: &Device, asset: &Asset, path: SplatPath) -> Result<Self> {
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
        let corners = Corners::new(&asset.mesh_triangles, asset.mesh_positions.len());
        let drawn: Vec<[f32; 3]> =
            corners.vertices.iter().map(|v| asset.mesh_positions[*v as usize]).collect();
        // Only quads need them.
        let outlined = if path == SplatPath::Quads { kernels.len() as u64 } else { 0 };
        let storage = BufferUsages::STORAGE;
        Ok(Self {
            positions: filled_buffer(device, "positions", &asset.mesh_positions, storage),
            triangles: filled_buffer(device, "triangles", &asset.mesh_triangles, storage),
            corners: filled_buffer(device, "corners", &drawn, BufferUsages::VERTEX),
            indices: filled_buffer(device, "indices", &corners.indices, BufferUsages::INDEX),
            neighbours: filled_buffer(device, "neighbours", &neighbours(&asset.mesh_triangles), storage),
            normals: filled_buffer(device, "normals", normals.as_flattened(), storage),
            samples: filled_buffer(
                device,
                "samples",
                &[&kernels[..], &clusters(&kernels, &samples.weight)].concat(),
                storage,
            ),
            weights: filled_buffer(device, "weights", &samples.weight, storage),
            depth: filled_buffer(device, "depth", &packed::words(&samples.depth), storage),
            boundary: filled_buffer(device, "boundary", &packed::words(&samples.boundary), storage),
            recurrence: filled_buffer(device, "recurrence", &recurrence, BufferUsages::UNIFORM),
            bands: filled_buffer(device, "bands", &packed::bands(&samples), BufferUsages::UNIFORM),
            packed: filled_buffer(device, "packed", &packed::records(&samples), storage),
            grid: filled_buffer(device, "grid", grid, storage),
            centroids: filled_buffer(device, "centroids", &centroids, storage),
            spokes: filled_buffer(device, "spokes", &spokes, storage),
            values: empty_buffer(
                device,
                "values",
                16 * kernels.len() as u64,
                storage | BufferUsages::COPY_DST,
            ),
            sources: empty_buffer(device, "sources", 64 * kernels.len() as u64, storage),
            outlines: empty_buffer(device, "outlines", OUTLINE * outlined, storage),
            shown: empty_buffer(device, "shown", MAX_PIECES as u64 * shown_stride(outlined), storage),
            info: info.clone(),
            most_density: if grid.is_empty() {
                1.0
            } else {
                grid.iter().map(|v| v[0].to_f32()).fold(0.0, f32::max)
            },
            least_sharpness: kernels.iter().map(|k| k[3]).fold(f32::INFINITY, f32::min),
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
        let own = |label: &str, like: &Buffer| empty_buffer(device, label, like.size(), like.usage());
        Self { values: own("values", &self.values), sources: own("sources", &self.sources), ..self.clone() }
    }

    /// Gives this instance a medium of its own.
    pub fn own_medium(&mut self, device: &Device) {
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        self.medium = filled_buffer(device, "medium", &[self.material], usage);
    }

    /// Which samples may meet piece `k`.
    pub fn shown(&self, k: usize) -> BindingResource<'_> {
        let part = self.shown.size() / MAX_PIECES as u64;
        let (offset, size) = (k as u64 * part, BufferSize::new(part));
        BindingResource::Buffer(BufferBinding { buffer: &self.shown, offset, size })
    }

    /// What it keeps for a pixel.
    pub fn pixel_state(&self) -> PixelState {
        PixelState { fresnel: self.fresnel, heterogeneous: self.heterogeneous }
    }

    /// Whether another asset's passes are compiled with the same constants, its [`Variant`] aside.
    pub fn compiles_as(&self, asset: &Asset) -> bool {
        let boundary_order = asset.info.boundary_order as usize;
        (self.fresnel, self.boundary_order, self.heterogeneous)
            == (asset.info.ior != 1.0, boundary_order, asset.density.is_some())
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

/// Bytes of a sample's outline.
const OUTLINE: u64 = 24;

/// Bytes that tell of each of so many samples whether it is shown, such that a binding may begin behind them.
fn shown_stride(samples: u64) -> u64 {
    (4 * samples).next_multiple_of(256).max(256)
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
