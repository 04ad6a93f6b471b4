//! Meshes of the bodies and their bakes.

use super::axes::Shape;
use super::plan::Body;
use diaphane_assets::shapes::{Triangles, cuboid, icosphere, torus};
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::Progress;
use diaphane_bake::{Input, bake};
use diaphane_formats::asset::{self, Asset};
use diaphane_formats::medium::{Density, Layers, Medium};
use diaphane_formats::mesh::Mesh;
use diaphane_formats::phase::Phase;
use glam::DVec3;

/// A body's mesh and what a bake made of it.
pub struct Baked {
    /// World mesh.
    pub mesh: Mesh,
    /// As it comes back from a file's bytes.
    pub asset: Asset,
}

/// Directions of the bakes: as few as ten bands can do with.
const DIRECTIONS: usize = 128;

/// Directions of bodies with so many samples that these decide how long a bake takes.
const FEW_DIRECTIONS: usize = 16;

/// The mesh of a body in world coordinates.
///
/// # Errors
/// None for the shapes of the matrix.
pub fn mesh(body: &Body) -> diaphane_formats::Result<(Mesh, diaphane_formats::mesh::MeshReport)> {
    let Triangles { mut positions, triangles } = match body.shape {
        Shape::Ball => icosphere(0.5, 3),
        Shape::Box => cuboid([0.4, 0.3, 0.2], 3),
        Shape::Ring => torus(0.35, 0.12, 24, 12),
        Shape::Needle => stretched(icosphere(0.5, 2), DVec3::new(1.0, 0.005, 0.005)),
        Shape::Sliver => sliver(),
        Shape::Coincident => coincident(),
    };
    let first = positions.first().copied().unwrap_or_default();
    let (low, high) = positions.iter().fold((first, first), |(a, b), p| (a.min(*p), b.max(*p)));
    let away = DVec3::new(0.6, -0.64, 0.48) * (body.offset * (high - low).length());
    positions.iter_mut().for_each(|p| *p = (*p + away) * body.scale);
    Mesh::from_triangles(positions, triangles)
}

fn stretched(mut shape: Triangles, factor: DVec3) -> Triangles {
    shape.positions.iter_mut().for_each(|p| *p *= factor);
    shape
}

/// A plate whose grid of vertices is squeezed to 1e-5 cells next to one edge.
fn sliver() -> Triangles {
    let mut shape = cuboid([0.5, 0.005, 0.5], 6);
    let width = 1.0 / 6.0;
    for p in &mut shape.positions {
        // The second column of vertices moves next to the first.
        if (p.x + 0.5 - width).abs() < 0.1 * width {
            p.x = -0.5 + 1e-5 * width;
        }
    }
    shape
}

/// Two boxes side by side, the face between them twice, turned both ways.
fn coincident() -> Triangles {
    let mut shape = cuboid([0.25; 3], 3);
    let count = shape.positions.len() as u32;
    let other = cuboid([0.25; 3], 3);
    shape.positions.extend(other.positions.iter().map(|p| *p + DVec3::X * 0.5));
    shape.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + count)));
    shape
}

/// Bakes a body, and gives the asset back as its file would hold it.
///
/// # Errors
/// What the bake refuses, in its own words.
pub fn bake_body(body: &Body, progress: &dyn Progress) -> diaphane_bake::Result<Baked> {
    let (mesh, mesh_report) = mesh(body)?;
    let diagonal = mesh.diagonal();
    let channels = if body.uneven { DVec3::new(0.5, 1.0, 2.0) } else { DVec3::ONE };
    let density = if body.uneven {
        let layers = Layers { axis: DVec3::Y, period: 0.2 * diagonal, densities: vec![1.0, 0.2] };
        Density::Layers(layers)
    } else {
        Density::Uniform(1.0)
    };
    let extinction = channels * (body.extinction / diagonal);
    let medium = Medium::new(extinction, DVec3::ONE, Phase::Isotropic, body.ior, density)?;
    let many = body.samples > 100_000;
    let params = Params {
        samples: body.samples,
        directions: if many { FEW_DIRECTIONS } else { DIRECTIONS },
        points_per_sample: if many { 1 } else { 4 },
        order: body.order,
        extra_bands: 0,
        certificate: false,
        ..Params::preset(Preset::Draft)
    };
    let input = Input {
        mesh: &mesh,
        mesh_report: &mesh_report,
        medium: &medium,
        mesh_name: "stress.obj".to_owned(),
        material_name: "stress.material.toml".to_owned(),
    };
    let (baked, _) = bake(&input, &params, progress)?;
    let asset = asset::parse(&asset::encode(&baked)?)?;
    Ok(Baked { mesh, asset })
}
