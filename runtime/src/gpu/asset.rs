//! Buffers that stay as long as an asset does.

use super::bindings::{empty_buffer, filled_buffer, most_bound};
use super::faults::allocate;
use super::mesh::{self, MeshPart};
use super::packed;
use super::shard::{SOURCE, Shard, Source, ranges};
use super::slabs::Slabs;
use super::splatting::SplatPath;
use super::targets::PixelState;
use super::uniforms::MediumUniform;
use crate::cpu::surface::corner_normals;
use crate::rendered::MAX_PIECES;
use crate::usable::{density_at, usable_samples};
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info, Samples};
use diaphane_formats::hits::DENSE;
use diaphane_formats::slopes::Stencil;
use diaphane_formats::{kernel, sh};
use std::sync::Arc;
use wgpu::{Buffer, BufferUsages, Device, Queue};

/// Bytes of a sample's value.
pub(super) const VALUE: u64 = 16;

/// Everything that stays as long as the asset does.
#[derive(Clone)]
pub(super) struct AssetBuffers {
    /// The samples, in as many shards as the adapter's bindings ask for; at least one.
    pub shards: Vec<Shard>,
    /// What all shards' media hold, but for which samples they are.
    pub material: MediumUniform,
    /// The mesh, likewise.
    pub mesh: Vec<MeshPart>,
    pub recurrence: Buffer,
    /// Layout and profiles of the harmonics' bands.
    pub bands: Buffer,
    pub slabs: Slabs,
    /// Of all samples, whatever their shard, because slopes look at neighbours; written by the lighting pass.
    pub values: Buffer,
    /// Objects that have a part of them, and of the shards' sources.
    pub slots: usize,
    /// As they are played.
    pub info: Info,
    /// Kept for the transmittance of folded lights.
    pub source: Arc<Samples>,
    /// Of the grid, least and greatest; 1 without.
    densities: [f32; 2],
    /// Whether pixels keep sums from shard to shard in a buffer.
    kept: bool,
    /// Whether [`MediumUniform::sight`] is what the medium lets one see.
    limited_sight: bool,
    /// Of the widest kernel.
    least_sharpness: f32,
    pub sample_count: u32,
    pub samples_drawn: u64,
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
        let mut material = MediumUniform::new(asset);
        let densities = densities(grid.iter().map(|v| v[0].to_f32()));
        let fits = Fits::new(device);
        fits.bound("values of the samples", 16 * kernels.len())?;
        let slabs = Slabs::new(device, asset.density.as_ref(), fits.binding)
            .ok_or_else(|| fits.refuse("voxels (six slabs of whole layers at the most)", 4 * grid.len()))?;
        material.grid_layers = slabs.layers;
        if asset.mesh_triangles.len() > (u32::MAX / 3) as usize {
            return Err(Error::Gpu("the mesh has too many triangles; use the CPU backend".to_owned()));
        }
        let source =
            Source { samples: &samples, kernels: &kernels, centroids: &centroids, spokes: &spokes, material };
        let shards: Vec<Shard> = ranges(kernels.len(), fits.binding)
            .ok_or_else(|| fits.refuse("samples", 64 * size_of_val(&spokes[..1])))?
            .into_iter()
            .map(|range| Shard::new(device, &source, range, path))
            .collect();
        let surface = mesh::Source {
            positions: &asset.mesh_positions,
            triangles: &asset.mesh_triangles,
            normals: &normals,
        };
        let mesh = surface
            .upload(device, fits.binding)
            .ok_or_else(|| fits.refuse("triangles", mesh::LARGEST as usize * asset.mesh_triangles.len()))?;
        let storage = BufferUsages::STORAGE;
        Ok(Self {
            mesh,
            recurrence: filled_buffer(device, "recurrence", &recurrence, BufferUsages::UNIFORM),
            bands: filled_buffer(device, "bands", &packed::bands(&samples), BufferUsages::UNIFORM),
            slabs,
            values: empty_buffer(
                device,
                "values",
                VALUE * kernels.len() as u64,
                storage | BufferUsages::COPY_DST,
            ),
            slots: 1,
            info: info.clone(),
            densities,
            kept: shards.len() > 1 && path == SplatPath::Tiles,
            limited_sight: true,
            least_sharpness: kernels.iter().map(|k| k[3]).fold(f32::INFINITY, f32::min),
            sample_count: kernels.len() as u32,
            samples_drawn: samples.weight.iter().filter(|w| **w > 0.0).count() as u64,
            diagonal: info.diagonal(),
            fresnel,
            boundary_order: info.boundary_order as usize,
            heterogeneous: asset.density.is_some(),
            shards,
            material,
            source: Arc::new(samples),
        })
    }

    /// Whether samples are left out that are hidden; the others' sums hold none of them then.
    pub fn set_sight(&mut self, queue: &Queue, limited: bool) {
        self.limited_sight = limited;
        self.set_material(queue, &self.info.clone());
    }

    /// Takes extinction and albedo from an edited asset's parameters: a few bytes to upload.
    pub fn set_material(&mut self, queue: &Queue, info: &Info) {
        self.material.set_material(info, self.heterogeneous.then_some(self.densities[0]));
        if !self.limited_sight {
            self.material.sight = f32::MAX;
        }
        self.info = info.clone();
        for shard in &self.shards {
            queue.write_buffer(&shard.medium, 0, bytemuck::bytes_of(&shard.uniform(self.material)));
        }
    }

    /// The same with values and sources for so many objects.
    pub fn with_slots(&self, device: &Device, slots: usize) -> Self {
        let size = VALUE * u64::from(self.sample_count) * slots as u64;
        let values = empty_buffer(device, "values", size, self.values.usage());
        let shards = self.shards.iter().map(|s| s.with_slots(device, slots)).collect();
        Self { values, shards, slots, ..self.clone() }
    }

    /// Bytes of values and sources of one of them.
    pub fn slot_bytes(&self) -> u64 {
        (VALUE + SOURCE) * u64::from(self.sample_count)
    }

    /// How many slots bindings hold.
    pub fn most_slots(&self, device: &Device) -> usize {
        let largest = self.shards.iter().map(|s| SOURCE * s.range.len() as u64);
        let largest = largest.max().unwrap_or(0).max(VALUE * u64::from(self.sample_count)).max(1);
        (Fits::new(device).binding / largest).max(1) as usize
    }

    /// The same object once more, with values and sources of its own.
    pub fn instance(&self, device: &Device) -> Self {
        self.with_slots(device, self.slots)
    }

    /// Gives this instance a medium of its own.
    pub fn own_medium(&mut self, device: &Device) {
        for shard in &mut self.shards {
            shard.own_medium(device, self.material);
        }
    }

    /// What it keeps for a pixel.
    pub fn pixel_state(&self) -> PixelState {
        PixelState { fresnel: self.fresnel, heterogeneous: self.heterogeneous, kept: self.kept }
    }

    /// Whether another asset's passes are compiled with the same constants, its [`Variant`] aside.
    pub fn compiles_as(&self, asset: &Asset) -> bool {
        let boundary_order = asset.info.boundary_order as usize;
        let several = self.slabs.are_several_for(asset.density.as_ref());
        (self.fresnel, self.boundary_order, self.heterogeneous, self.slabs.are_several())
            == (asset.info.ior != 1.0, boundary_order, asset.density.is_some(), several)
    }

    /// Pieces of a ray that one dispatch sums: all by tiles, unless the density varies, whose profiles are kept of one alone, or
    /// sums are kept from shard to shard.
    pub fn pieces_at_once(&self, path: SplatPath) -> usize {
        let one = path == SplatPath::Quads || self.heterogeneous || self.pixel_state().kept;
        if one { 1 } else { MAX_PIECES }
    }

    /// The code that the material needs.
    pub fn variant(&self) -> Variant {
        Variant {
            grey: self.material.is_grey(),
            dense: self.material.kappa.max_element() * self.densities[1] > DENSE * self.least_sharpness,
            heterogeneous: self.heterogeneous,
        }
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

/// Least and greatest; 1 without any.
fn densities(values: impl Iterator<Item = f32>) -> [f32; 2] {
    values.map(|v| [v; 2]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([1.0; 2])
}

/// What the device's limits let a shader see at once.
struct Fits {
    /// Bytes of a binding.
    binding: u64,
}

impl Fits {
    fn new(device: &Device) -> Self {
        Self { binding: most_bound(device) }
    }

    /// Whether a shader may see so many bytes at once.
    fn bound(&self, what: &str, bytes: usize) -> Result<()> {
        if bytes as u64 > self.binding { Err(self.refuse(what, bytes)) } else { Ok(()) }
    }

    fn refuse(&self, what: &str, bytes: usize) -> Error {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        Error::Gpu(format!(
            "the asset's {what} take {:.1} MiB, the adapter's max_storage_buffer_binding_size is {:.1} MiB; use the CPU backend",
            mib(bytes as u64),
            mib(self.binding)
        ))
    }
}
