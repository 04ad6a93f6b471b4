//! Whole bakes against each other.

use super::Line;
use diaphane_bake::params::{Params, Visibility};
use diaphane_bake::progress::Progress;
use diaphane_bake::report::Report;
use diaphane_bake::{Input, Result, bake};
use diaphane_formats::medium::{Density, Grid, Medium};
use diaphane_formats::mesh::{Mesh, MeshReport};
use diaphane_formats::phase::Phase;
use glam::DVec3;

/// Voxels along each axis of the heterogeneous medium.
const VOXELS: usize = 128;

/// Bakes the mesh with this medium.
///
/// # Errors
/// As [`bake`].
pub fn timed(mesh: &Mesh, medium: &Medium, params: &Params, progress: &dyn Progress) -> Result<Report> {
    let mesh_report = MeshReport::default();
    let input = Input {
        mesh,
        mesh_report: &mesh_report,
        medium,
        mesh_name: "mesh".to_owned(),
        material_name: "material".to_owned(),
    };
    bake(&input, params, progress).map(|(_, report)| report)
}

/// Seconds of a stage, or of all with `total`.
pub fn seconds(report: &Report, stage: &str) -> f64 {
    report.seconds.get(stage).copied().unwrap_or(0.0)
}

/// A line for each stage: seconds and share of the whole.
pub fn stages(report: &Report) -> Vec<Line> {
    let total = seconds(report, "total");
    let line = |(name, s): (&String, &f64)| {
        Line::new(format!("  {name}"), format!("{s:.2} s, {:.0} %", 100.0 * s / total))
    };
    report.seconds.iter().map(line).collect()
}

/// The same parameters by another method.
pub fn by(params: &Params, visibility: Visibility) -> Params {
    Params { visibility, ..params.clone() }
}

/// Extinction 8 per diagonal, even or on a grid of waves.
///
/// # Errors
/// None that a sound mesh could cause.
pub fn medium(mesh: &Mesh, heterogeneous: bool) -> diaphane_formats::Result<Medium> {
    let extinction = DVec3::splat(8.0 / mesh.diagonal());
    let (low, high) = mesh.bounds();
    let density = if heterogeneous {
        let value = |v: usize| {
            let p = [v % VOXELS, v / VOXELS % VOXELS, v / (VOXELS * VOXELS)];
            p.iter().fold(1.0, |a, k| a * (1.0 + 0.3 * (*k as f32 * 0.2).sin()))
        };
        Density::Grid(Grid::new([VOXELS; 3], low, high, (0..VOXELS.pow(3)).map(value).collect())?)
    } else {
        Density::Uniform(1.0)
    };
    Medium::new(extinction, DVec3::splat(0.9), Phase::Isotropic, 1.0, density)
}
