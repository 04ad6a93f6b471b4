//! Everything into one asset.

use crate::fit::{Light, boundary_order};
use crate::params::Params;
use crate::samples::Candidate;
use crate::{Input, Result};
use diaphane_formats::asset::{Asset, DensityGrid, Info, Level, Provenance, Samples};
use diaphane_formats::medium::{Density, Medium, SampledDensity};
use glam::DVec3;
use half::f16;

/// Where the samples stand.
pub(crate) struct Stand<'a> {
    pub samples: &'a [Candidate],
    /// Where their values hold, as the asset stores it.
    pub offset: Vec<[i8; 4]>,
    /// Samples that were dropped.
    pub discarded: usize,
}

pub(crate) fn pack(
    input: &Input<'_>,
    sampled: Option<&SampledDensity>,
    params: &Params,
    placed: Stand<'_>,
    light: Light,
    (weight, levels): (Vec<f32>, Vec<Level>),
) -> Result<Asset> {
    let (low, high) = input.mesh.bounds();
    let centre = input.mesh.centre();
    let local = |p: DVec3| (p - centre).as_vec3().to_array();
    let medium = input.medium;
    let position_radius = placed
        .samples
        .iter()
        .map(|s| {
            let [x, y, z] = local(s.position);
            [x, y, z, s.radius as f32]
        })
        .collect();
    let info = Info {
        provenance: Provenance {
            program: concat!("diaphane-bake ", env!("CARGO_PKG_VERSION")).to_owned(),
            mesh_name: input.mesh_name.clone(),
            mesh_hash: input.mesh.content_hash(),
            material_name: input.material_name.clone(),
            seed: params.seed,
            directions: params.directions.next_multiple_of(2) as u32,
            mesh_report: input.mesh_report.clone(),
        },
        centre: centre.to_array(),
        bounds: [local(low), local(high)],
        extinction: medium.extinction().to_array(),
        albedo: medium.albedo().to_array(),
        phase: medium.phase(),
        ior: medium.ior(),
        uniform_density: medium.uniform_density(),
        samples: placed.samples.len() as u64,
        discarded: placed.discarded as u64,
        order: u32::from(light.depth.order.iter().copied().max().unwrap_or(0)),
        light_error: params.light_error,
        boundary_order: boundary_order(medium.ior(), params.order) as u32,
        encoding: light.encoding,
        reference_extinction: medium.reference_extinction(),
        width_factor: params.width_factor,
        certificate: None,
    };
    let asset = Asset {
        info,
        samples: Samples {
            position_radius,
            offset: placed.offset,
            weight,
            depth: light.depth,
            lobe: light.lobe,
            boundary: light.boundary,
        },
        levels,
        mesh_positions: input.mesh.positions.iter().map(|p| local(*p)).collect(),
        mesh_triangles: input.mesh.triangles.clone(),
        density: density_grid(medium, sampled, centre),
    };
    asset.validate()?;
    Ok(asset)
}

/// A grid is carried as it is; other fields as they were sampled over the mesh's box.
fn density_grid(medium: &Medium, sampled: Option<&SampledDensity>, centre: DVec3) -> Option<DensityGrid> {
    let half = |v: f32| f16::from_f32(v.min(65504.0));
    let local = |p: DVec3| (p - centre).as_vec3().to_array();
    if let Density::Grid(grid) = medium.density_field() {
        let (min, max) = grid.bounds();
        return Some(DensityGrid {
            size: grid.size().map(|n| n as u32),
            min: local(min),
            max: local(max),
            values: grid.values().iter().map(|v| [half(*v); 2]).collect(),
        });
    }
    let sampled = sampled?;
    let (min, max) = sampled.bounds();
    Some(DensityGrid {
        size: sampled.size().map(|n| n as u32),
        min: local(min),
        max: local(max),
        values: sampled.values().iter().map(|v| v.map(half)).collect(),
    })
}
