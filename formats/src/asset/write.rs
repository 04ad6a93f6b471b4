//! Asset to bytes.

use super::container::{self, Kind};
use super::{Asset, FORMAT_VERSION, codec};
use crate::{Result, files};
use half::f16;
use std::path::Path;

/// The file's bytes: the same for the same asset, always.
///
/// # Errors
/// Parts that do not fit together.
pub fn encode(asset: &Asset) -> Result<Vec<u8>> {
    asset.validate()?;
    let halves = |values: &[f32]| -> Vec<u8> {
        values.iter().flat_map(|v| f16::from_f32(v.clamp(-65504.0, 65504.0)).to_le_bytes()).collect()
    };
    let floats =
        |values: &mut dyn Iterator<Item = f32>| -> Vec<u8> { values.flat_map(f32::to_le_bytes).collect() };
    let s = &asset.samples;
    let mut sections = vec![
        (Kind::Info, codec::encode(&asset.info)?),
        (Kind::PositionRadius, floats(&mut s.position_radius.iter().flatten().copied())),
        (Kind::Offset, s.offset.iter().flatten().map(|v| *v as u8).collect()),
        (Kind::Weight, floats(&mut s.weight.iter().copied())),
        (Kind::Depth, halves(&s.depth)),
    ];
    if !s.boundary.is_empty() {
        sections.push((Kind::Boundary, halves(&s.boundary)));
    }
    sections.push((Kind::MeshPositions, floats(&mut asset.mesh_positions.iter().flatten().copied())));
    sections.push((
        Kind::MeshTriangles,
        asset.mesh_triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect(),
    ));
    if let Some(grid) = &asset.density {
        let mut bytes: Vec<u8> = grid.size.iter().flat_map(|n| n.to_le_bytes()).collect();
        bytes.extend(floats(&mut grid.min.iter().chain(&grid.max).copied()));
        bytes.extend(grid.values.iter().flatten().flat_map(|v| v.to_le_bytes()));
        sections.push((Kind::Density, bytes));
    }
    Ok(container::assemble(FORMAT_VERSION, &sections))
}

/// Writes the asset; the file appears only when complete.
///
/// # Errors
/// Parts that do not fit together, or the file cannot be written.
pub fn write(path: &Path, asset: &Asset) -> Result<()> {
    files::write_atomically(path, &encode(asset)?)
}
