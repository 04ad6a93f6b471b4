//! Plain data shared with the shaders. Layouts follow WGSL's rules: a vector of three starts at a multiple of 16 and
//! the scalar after it fills its last four bytes. The tests check sizes and places against the shaders' source.

use crate::cpu::shown::sight;
use crate::frame::{Frame, FrameLight};
use crate::usable::MOST_EXTINCTION;
use bytemuck::{Pod, Zeroable};
use diaphane_formats::asset::{Asset, DensityGrid, Info};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::kernel;
use diaphane_formats::slopes::{CELL_RADIUS, STEEPEST, means_share};
use glam::{DVec3, Vec3};

use super::lot::{Lot, Place};
use super::tiles::Tile;

/// Surface nearer to the camera than this fraction of the diagonal is not seen.
const NEAR: f32 = 1e-5;

/// `View` of shared/view.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct ViewUniform {
    pub origin: Vec3,
    pub width: u32,
    pub forward: Vec3,
    pub height: u32,
    pub right: Vec3,
    pub light_count: u32,
    pub up: Vec3,
    pub scene_lights: u32,
    pub tile_start: [u32; 2],
    pub tile_size: [u32; 2],
    pub offset: [f32; 2],
    pub pixel: [f32; 2],
    pub near: f32,
    pub least_distance: f32,
    pub specular: f32,
    pub alpha: f32,
    pub rays: u32,
    pub means: f32,
    pub first_scene_light: u32,
    pub share: f32,
    pub environment: u32,
    pub negligible: f32,
    pub viewport: [u32; 2],
    pub first_pixel: u32,
    pub first_cell: u32,
    pub first_tile: u32,
    pub slot: u32,
    pub first_light: u32,
    pub first_ambient: u32,
    pub per_unit: f32,
    pub slices: u32,
    pub pixels: u32,
    pub sharers: u32,
    pub unused: [u32; 18],
}

/// What a frame's rays need to know about its lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightLayout {
    /// Records that are evaluated at the samples.
    pub single: u32,
    /// Record of the scene's first light.
    pub first_scene_light: u32,
    /// Share of the lights that baked means serve.
    pub means: f32,
    /// Records in front that stand for an environment.
    pub environment: u32,
    /// What a sample may leave out: [`crate::fold::Plan::negligible`].
    pub negligible: f32,
    /// Which part of the values and sources is the object's.
    pub slot: u32,
    /// Its first record.
    pub first_light: u32,
    /// Its first vector of what folded lights send.
    pub first_ambient: u32,
}

impl ViewUniform {
    /// A frame's rays at `offset` inside the pixels of `tile`, which then hold `rays` rays and are drawn alone.
    pub fn new(
        frame: &Frame,
        diagonal: f32,
        tile: Tile,
        offset: [f32; 2],
        rays: u32,
        lights: LightLayout,
    ) -> Self {
        let surface = &frame.surface;
        Self {
            origin: frame.view.origin,
            width: frame.width,
            forward: frame.view.forward,
            height: frame.height,
            right: frame.view.right,
            light_count: lights.single,
            up: frame.view.up,
            scene_lights: frame.scene_lights as u32,
            tile_start: tile.start,
            tile_size: tile.size,
            offset,
            pixel: [2.0 / frame.width as f32, 2.0 / frame.height as f32],
            near: NEAR * diagonal,
            least_distance: frame.least_distance,
            specular: if surface.reflection { surface.specular as f32 } else { 0.0 },
            alpha: (surface.roughness as f32).max(crate::cpu::surface::LEAST_ROUGHNESS).powi(2),
            rays,
            means: lights.means,
            first_scene_light: lights.first_scene_light,
            share: 1.0,
            environment: lights.environment,
            negligible: lights.negligible,
            viewport: tile.size,
            first_pixel: 0,
            first_cell: 0,
            first_tile: 0,
            slot: lights.slot,
            first_light: lights.first_light,
            first_ambient: lights.first_ambient,
            per_unit: 1.0,
            slices: 1,
            pixels: tile.pixels() as u32,
            sharers: 1,
            unused: [0; 18],
        }
    }

    /// The same at a place among other tiles.
    pub fn at(self, place: Place) -> Self {
        let Place { first_pixel, first_cell, first_tile } = place;
        Self { first_pixel, first_cell, first_tile, ..self }
    }

    /// The same as one of a lot.
    pub fn of(self, lot: &Lot) -> Self {
        let Lot { size, slices, sharers, pixels, .. } = *lot;
        Self { viewport: size, slices, sharers, pixels: pixels as u32, ..self }
    }
}

/// `Medium` of shared/medium.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct MediumUniform {
    pub kappa: Vec3,
    pub cell_variance: f32,
    pub extinction: Vec3,
    pub samples: u32,
    pub ratio: Vec3,
    pub encoding: u32,
    pub albedo: Vec3,
    pub epsilon: f32,
    pub grid_min: Vec3,
    pub mean_cosine: f32,
    pub grid_max: Vec3,
    pub ior: f32,
    pub grid_size: [u32; 3],
    pub grid_layers: u32,
    pub means: Vec3,
    pub most_extinction: f32,
    pub steepest: f32,
    pub first: u32,
    pub total: u32,
    pub sight: f32,
}

impl MediumUniform {
    /// An asset's medium.
    pub fn new(asset: &Asset) -> Self {
        let info = &asset.info;
        let (encoding, epsilon) = match info.encoding {
            Encoding::Transmittance => (0, 0.0),
            Encoding::Reciprocal { epsilon } | Encoding::Lobe { epsilon } => (1, epsilon),
            Encoding::Depth => (2, 0.0),
        };
        let grid = asset.density.as_ref();
        // Of a kernel with disk radius 1.
        let sharpness = kernel::sharpness(1.0, info.width_factor);
        let mut medium = Self {
            cell_variance: (CELL_RADIUS * sharpness).powi(2) / 5.0,
            samples: asset.samples.len() as u32,
            total: asset.samples.len() as u32,
            encoding,
            epsilon,
            grid_min: grid.map_or(Vec3::ZERO, |g| g.min.into()),
            mean_cosine: info.phase.mean_cosine() as f32,
            grid_max: grid.map_or(Vec3::ONE, |g| g.max.into()),
            ior: info.ior as f32,
            grid_size: grid.map_or([1; 3], |g| g.size),
            grid_layers: grid.map_or(1, |g| g.size[2]),
            steepest: STEEPEST / sharpness,
            ..Self::zeroed()
        };
        let least = |g: &DensityGrid| g.values.iter().map(|v| v[0].to_f32()).fold(f32::INFINITY, f32::min);
        medium.set_material(info, grid.map(least));
        medium
    }

    /// Takes extinction and albedo from an edited asset's parameters; `grid` is the least density of its grid if it has one.
    pub fn set_material(&mut self, info: &Info, grid: Option<f32>) {
        let extinction = DVec3::from(info.extinction);
        let along = if grid.is_some() { extinction } else { extinction * info.uniform_density };
        self.kappa = along.min(DVec3::splat(MOST_EXTINCTION)).as_vec3();
        self.sight = sight(self.kappa.min_element() * grid.unwrap_or(1.0));
        self.extinction = extinction.as_vec3();
        self.ratio = info.ratio();
        self.albedo = DVec3::from(info.albedo).as_vec3();
        self.means = means_share(info.ratio());
        self.most_extinction = extinction.max_element().min(MOST_EXTINCTION) as f32;
    }

    /// Whether all channels attenuate alike.
    pub fn is_grey(&self) -> bool {
        self.kappa.x == self.kappa.y && self.kappa.y == self.kappa.z
    }
}

/// `Light` of shared/light.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct LightRecord {
    pub position: Vec3,
    pub kind: u32,
    pub direction: Vec3,
    pub cos_inner: f32,
    pub colour: Vec3,
    pub cos_outer: f32,
    pub table: u32,
    pub most_cosine: f32,
    pub share: f32,
    pub baked: u32,
}

/// A table that replaces or corrects a light's baked depths.
#[derive(Clone, Copy, Debug)]
pub(super) struct TableUse {
    /// Which one.
    pub slot: u32,
    /// 1: exact depths; below: that share of corrections.
    pub share: f32,
}

impl LightRecord {
    /// A light, the table that it has if any, and whether its baked light is evaluated and not folded.
    pub fn new(light: &FrameLight, table: Option<TableUse>, baked: bool) -> Self {
        Self {
            position: light.position,
            kind: light.kind as u32,
            direction: light.direction,
            cos_inner: light.cos_inner,
            colour: light.colour,
            cos_outer: light.cos_outer,
            table: table.map_or(u32::MAX, |t| t.slot),
            most_cosine: light.most_cosine,
            share: table.map_or(0.0, |t| t.share),
            baked: u32::from(baked),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::{offset_of, size_of};

    /// Fields of a WGSL struct with WGSL's offsets, and its size.
    fn wgsl(source: &str, name: &str) -> (Vec<(String, usize)>, usize) {
        let body = source.split(&format!("struct {name} {{")).nth(1).unwrap().split('}').next().unwrap();
        let (mut at, mut align_all, mut fields) = (0usize, 4, Vec::new());
        for line in body.lines() {
            let line = line.split("//").next().unwrap().trim().trim_end_matches(',');
            let Some((field, kind)) = line.split_once(':') else {
                continue;
            };
            let kind = kind.trim();
            let (align, size) = match kind {
                "vec3f" | "vec3u" => (16, 12),
                "vec2f" | "vec2u" => (8, 8),
                "f32" | "u32" => (4, 4),
                "array<vec4u, 4>" => (16, 64),
                other => panic!("{other}"),
            };
            at = at.next_multiple_of(align);
            align_all = align_all.max(align);
            if field.trim() != "unused" {
                fields.push((field.trim().to_owned(), at));
            }
            at += size;
        }
        (fields, at.next_multiple_of(align_all))
    }

    macro_rules! mirrors {
        ($rust:ident, $file:literal, $name:literal, $($field:ident),*) => {
            let (fields, size) = wgsl(include_str!(concat!("../shaders/shared/", $file)), $name);
            let ours = vec![$((stringify!($field).to_owned(), offset_of!($rust, $field))),*];
            assert_eq!(fields, ours);
            assert_eq!(size, size_of::<$rust>());
        };
    }

    #[test]
    fn structs_lie_as_the_shaders_read_them() {
        mirrors!(
            ViewUniform,
            "view.wgsl",
            "View",
            origin,
            width,
            forward,
            height,
            right,
            light_count,
            up,
            scene_lights,
            tile_start,
            tile_size,
            offset,
            pixel,
            near,
            least_distance,
            specular,
            alpha,
            rays,
            means,
            first_scene_light,
            share,
            environment,
            negligible,
            viewport,
            first_pixel,
            first_cell,
            first_tile,
            slot,
            first_light,
            first_ambient,
            per_unit,
            slices,
            pixels,
            sharers
        );
        mirrors!(
            MediumUniform,
            "medium.wgsl",
            "Medium",
            kappa,
            cell_variance,
            extinction,
            samples,
            ratio,
            encoding,
            albedo,
            epsilon,
            grid_min,
            mean_cosine,
            grid_max,
            ior,
            grid_size,
            grid_layers,
            means,
            most_extinction,
            steepest,
            first,
            total,
            sight
        );
        mirrors!(
            LightRecord,
            "light.wgsl",
            "Light",
            position,
            kind,
            direction,
            cos_inner,
            colour,
            cos_outer,
            table,
            most_cosine,
            share,
            baked
        );
    }
}
