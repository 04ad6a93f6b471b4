//! How much memory a bake takes: predicted before it begins, measured where the system tells.
//!
//! The peak is that of the stage that takes most. Their sizes follow from what they hold; the constants were measured, stage by
//! stage, on 50,000 to 1,000,000 samples and 10,000 to 2,000,000 triangles.

use crate::blocks;
use crate::params::Params;
use crate::{Error, Input, Result};
use diaphane_formats::asset::Asset;
use diaphane_formats::medium::Medium;
use serde::Serialize;

/// Memory of one bake, bytes.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MemoryReport {
    /// What was predicted.
    pub predicted: u64,
    /// The program's peak so far, other bakes included; `None` where the system does not tell.
    pub peak: Option<u64>,
    /// What was allowed.
    pub limit: Option<u64>,
}

/// Bytes of a triangle while its mesh is read from OBJ and mended, and from then on, with the box hierarchy.
const READ_TRIANGLE: u64 = 466;
const TRIANGLE: u64 = 175;
/// Bytes of a sample that every stage after the first takes for it.
const STANDING: u64 = 600;
/// Bytes of a sample while candidates are drawn, cells are projected, weights are solved (probes and what kernels make of
/// them), the certificate plays the asset.
const PLACING: u64 = 1_050;
const CELL: u64 = 1_000;
const WEIGHTS: u64 = 1_580;
const PLAYING: u64 = 1_710;
/// The program itself, and what stages take whatever the number of samples.
const PROGRAM: u64 = 60_000_000;
/// Bytes for each point that a thread projects, and the most of them at once.
const PROJECTED: u64 = 80;
const MOST_PROJECTED: u64 = 1 << 16;
/// Bytes of a voxel of a density field.
const VOXEL: u64 = 24;

/// Predicted peak of a bake, bytes.
pub fn predicted(params: &Params, medium: &Medium, triangles: usize) -> u64 {
    let samples = params.samples as u64;
    let block = samples.div_ceil(blocks::count(params.samples) as u64);
    let functions = if medium.ior() == 1.0 { 1 } else { 2 };
    // 16 bits for each direction.
    let directions = 2 * functions * params.directions as u64;
    let projected = (samples * params.points_per_sample as u64).min(MOST_PROJECTED);
    let threads = rayon::current_num_threads() as u64 * PROJECTED * projected;
    let stages = [
        PLACING * samples,
        STANDING * samples + block * (directions + CELL),
        // Refinement tries wider kernels, which overlap more.
        if params.refine == 0 { WEIGHTS * samples } else { WEIGHTS * samples * 7 / 2 },
        if params.certificate { PLAYING * samples } else { 0 },
    ];
    let most = stages.into_iter().max().unwrap_or(0);
    let voxels = if medium.is_homogeneous() { 0 } else { (crate::params::DENSITY_VOXELS as u64).pow(3) };
    let triangles = triangles as u64;
    PROGRAM + (READ_TRIANGLE * triangles).max(TRIANGLE * triangles + VOXEL * voxels + threads + most)
}

pub(crate) fn report(params: &Params, medium: &Medium, asset: &Asset) -> MemoryReport {
    MemoryReport {
        predicted: predicted(params, medium, asset.mesh_triangles.len()),
        peak: peak(),
        limit: params.memory_limit,
    }
}

/// What a bake will take, bytes.
///
/// # Errors
/// Parameters out of range, and a bake that would exceed the limit, with what would fit.
pub fn required(input: &Input<'_>, params: &Params) -> Result<u64> {
    params.validate()?;
    let needed = |samples: usize| {
        let params = Params { samples, ..params.clone() };
        predicted(&params, input.medium, input.mesh.triangles.len())
    };
    let whole = needed(params.samples);
    let Some(limit) = params.memory_limit.filter(|limit| whole > *limit) else {
        return Ok(whole);
    };
    // The largest number that fits: what is needed grows with it.
    let (mut fits, mut too_many) = (0, params.samples);
    while too_many - fits > 1 {
        let middle = usize::midpoint(fits, too_many);
        if needed(middle) > limit { too_many = middle } else { fits = middle }
    }
    let way_out = match fits {
        0 => "the mesh alone takes too much".to_owned(),
        fits => format!("about {fits} samples would fit"),
    };
    Err(Error::Parameter(format!(
        "the bake would take about {}, above --memory-limit {}: {way_out}",
        megabytes(whole),
        megabytes(limit)
    )))
}

/// Such as `220 MB`.
pub fn megabytes(bytes: u64) -> String {
    format!("{:.0} MB", bytes as f64 / 1e6)
}

/// The most memory that this program has had at once.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}
