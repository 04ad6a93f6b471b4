//! Asset to bytes.

use super::container::{self, Kind};
use super::{Asset, FORMAT_VERSION, HAS_LOBE, Places, codec};
use crate::{Result, files, lobe};
use glam::Vec3;
use half::f16;
use std::path::Path;

/// The file's bytes: the same for the same asset, always.
///
/// # Errors
/// Parts that do not fit together.
pub fn encode(asset: &Asset) -> Result<Vec<u8>> {
    asset.validate()?;
    let halves = |values: &[f16]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let floats =
        |values: &mut dyn Iterator<Item = f32>| -> Vec<u8> { values.flat_map(f32::to_le_bytes).collect() };
    let s = &asset.samples;
    let places = Places::new(asset.info.bounds);
    let place = |p: &[f32; 4]| {
        let [x, y, z] = places.code(Vec3::new(p[0], p[1], p[2]).as_dvec3());
        [x, y, z, places.radius_code(f64::from(p[3])).to_bits()].map(u16::to_le_bytes)
    };
    let lobes: Vec<u32> = s.lobe.iter().map(|a| lobe::code(*a)).collect();
    let mark = |i: usize| if lobes.get(i).is_some_and(|code| *code != 0) { HAS_LOBE } else { 0 };
    let offset =
        |(i, (o, order)): (usize, (&[i8; 4], &u8))| [o[0] as u8, o[1] as u8, o[2] as u8, *order | mark(i)];
    let weight: Vec<f16> = s.weight.iter().map(|w| f16::from_f32(*w)).collect();
    let mut sections = vec![
        (Kind::Info, codec::encode(&asset.info)?),
        (Kind::Place, s.position_radius.iter().flat_map(place).flatten().collect()),
        (Kind::Offset, s.offset.iter().zip(&s.depth.order).enumerate().flat_map(offset).collect()),
        (Kind::Weight, halves(&weight)),
        (Kind::DepthProfile, floats(&mut s.depth.profile.iter().copied())),
        (Kind::DepthScale, halves(&s.depth.scale)),
        (Kind::Depth, s.depth.codes.clone()),
    ];
    if !s.lobe.is_empty() {
        let codes = lobes.iter().filter(|code| **code != 0);
        sections.push((Kind::Lobe, codes.flat_map(|code| code.to_le_bytes()).collect()));
    }
    if !s.boundary.is_empty() {
        sections.push((Kind::BoundaryProfile, floats(&mut s.boundary.profile.iter().copied())));
        sections.push((Kind::BoundaryScale, halves(&s.boundary.scale)));
        sections.push((Kind::Boundary, s.boundary.codes.clone()));
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
