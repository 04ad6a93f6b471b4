//! Everything into one asset.

use crate::fit::{Harmonics, Lit};
use crate::params::Params;
use crate::{Input, Result};
use diaphane_formats::asset::{Asset, DensityGrid, Info, Provenance, Samples};
use diaphane_formats::medium::{Density, Medium};
use diaphane_formats::mesh::Mesh;
use glam::DVec3;
use half::f16;
use rayon::prelude::*;

/// Voxels along the longest axis when a procedural density is sampled for the player.
const GRID_SIDE: f64 = 112.0;
/// Density is averaged over this many points along each axis of a voxel.
const SUBVOXELS: usize = 3;

pub(crate) fn pack(
    input: &Input<'_>,
    params: &Params,
    lit: &Lit,
    harmonics: Harmonics,
    weight: Vec<f32>,
) -> Result<Asset> {
    let (low, high) = input.mesh.bounds();
    let centre = 0.5 * (low + high);
    let local = |p: DVec3| (p - centre).as_vec3().to_array();
    let medium = input.medium;
    let position_radius = lit
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
            mesh_hash: mesh_hash(input.mesh),
            material_name: input.material_name.clone(),
            seed: params.seed,
            directions: params.directions as u32,
            mesh_report: input.mesh_report.clone(),
        },
        centre: centre.to_array(),
        bounds: [local(low), local(high)],
        extinction: medium.extinction().to_array(),
        albedo: medium.albedo().to_array(),
        phase: medium.phase(),
        ior: medium.ior(),
        uniform_density: medium.uniform_density(),
        samples: lit.samples.len() as u64,
        discarded: lit.discarded as u64,
        order: params.order as u32,
        encoding: params.encoding,
        reference_extinction: medium.reference_extinction(),
        width_factor: params.width_factor,
    };
    let asset = Asset {
        info,
        samples: Samples { position_radius, weight, depth: harmonics.depth, boundary: harmonics.boundary },
        mesh_positions: input.mesh.positions.iter().map(|p| local(*p)).collect(),
        mesh_triangles: input.mesh.triangles.clone(),
        density: density_grid(medium, low, high, centre),
    };
    asset.validate()?;
    Ok(asset)
}

fn mesh_hash(mesh: &Mesh) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    for p in &mesh.positions {
        for c in p.to_array() {
            hasher.update(&c.to_le_bytes());
        }
    }
    for t in &mesh.triangles {
        for i in t {
            hasher.update(&i.to_le_bytes());
        }
    }
    *hasher.finalize().as_bytes()
}

/// A grid is carried as it is; other fields are sampled over the mesh's box, averaged over each voxel.
fn density_grid(medium: &Medium, low: DVec3, high: DVec3, centre: DVec3) -> Option<DensityGrid> {
    let half = |v: f64| f16::from_f64(v.min(65504.0));
    match medium.density_field() {
        Density::Uniform(_) => None,
        Density::Grid(grid) => {
            let (min, max) = grid.bounds();
            Some(DensityGrid {
                size: grid.size().map(|n| n as u32),
                min: (min - centre).as_vec3().to_array(),
                max: (max - centre).as_vec3().to_array(),
                values: grid.values().iter().map(|v| [half(f64::from(*v)); 2]).collect(),
            })
        }
        _ => {
            let voxel = (high - low).max_element() / GRID_SIDE;
            let size = ((high - low) / voxel).ceil().max(DVec3::ONE);
            let max = low + size * voxel;
            let [nx, ny, nz] = size.to_array().map(|n| n as usize);
            let values = (0..nx * ny * nz)
                .into_par_iter()
                .map(|v| {
                    let corner = DVec3::new((v % nx) as f64, (v / nx % ny) as f64, (v / (nx * ny)) as f64);
                    let mut sum = (0.0, 0.0);
                    for s in 0..SUBVOXELS.pow(3) {
                        let part = [s % SUBVOXELS, s / SUBVOXELS % SUBVOXELS, s / (SUBVOXELS * SUBVOXELS)];
                        let offset = DVec3::from(part.map(|p| (p as f64 + 0.5) / SUBVOXELS as f64));
                        let (rho, scattering) = medium.density_and_scattering(low + (corner + offset) * voxel);
                        sum = (sum.0 + rho, sum.1 + scattering);
                    }
                    let count = SUBVOXELS.pow(3) as f64;
                    [half(sum.0 / count), half(sum.1 / count)]
                })
                .collect();
            Some(DensityGrid {
                size: [nx as u32, ny as u32, nz as u32],
                min: (low - centre).as_vec3().to_array(),
                max: (max - centre).as_vec3().to_array(),
                values,
            })
        }
    }
}
