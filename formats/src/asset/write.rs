//! Asset to bytes.

use super::container::{self, Draft, Kind, SHARED};
use super::{Asset, FORMAT_VERSION, HAS_LOBE, Places, Samples, codec};
use crate::harmonics::Harmonics;
use crate::mesh::Mending;
use crate::{Result, files, lobe};
use glam::Vec3;
use half::f16;
use std::ops::Range;
use std::path::Path;

/// The file's bytes: the same for the same asset, always.
///
/// # Errors
/// Parts that do not fit together.
pub fn encode(asset: &Asset) -> Result<Vec<u8>> {
    asset.validate()?;
    let mut sections = shared(asset)?;
    let coarsest_first = asset.levels.iter().rev().map(|l| &l.weight).chain([&asset.samples.weight]);
    let starts = [&asset.samples.depth, &asset.samples.boundary].map(ends);
    let mut from = 0;
    for (part, weight) in (1..).zip(coarsest_first) {
        let range = from..weight.len();
        from = range.end;
        let own = samples(&asset.samples, &Places::new(asset.info.bounds), &starts, range, weight);
        sections.extend(own.into_iter().map(|(kind, data)| Draft { kind, part, data }));
    }
    Ok(container::assemble(FORMAT_VERSION, &sections))
}

fn halves(values: impl Iterator<Item = f16>) -> Vec<u8> {
    values.flat_map(f16::to_le_bytes).collect()
}

fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

/// Where each function's codes start, and where the last one's end.
fn ends(harmonics: &Harmonics) -> Vec<usize> {
    let mut starts = harmonics.starts();
    starts.push(harmonics.codes.len());
    starts
}

/// What every level needs.
fn shared(asset: &Asset) -> Result<Vec<Draft>> {
    let s = &asset.samples;
    let mut sections = vec![(Kind::Info, codec::encode(&asset.info)?)];
    if !asset.levels.is_empty() {
        sections.push((Kind::LevelWidth, floats(asset.levels.iter().rev().map(|l| l.width_factor))));
    }
    let errors: Vec<f32> = asset.levels.iter().rev().filter_map(|l| l.error).collect();
    if !errors.is_empty() && errors.len() == asset.levels.len() {
        sections.push((Kind::LevelError, floats(errors.into_iter())));
    }
    sections.push((Kind::DepthProfile, floats(s.depth.profile.iter().copied())));
    if !s.boundary.is_empty() {
        sections.push((Kind::BoundaryProfile, floats(s.boundary.profile.iter().copied())));
    }
    sections.push((Kind::MeshPositions, floats(asset.mesh_positions.iter().flatten().copied())));
    let corners = asset.mesh_triangles.iter().flatten();
    sections.push((Kind::MeshTriangles, corners.flat_map(|i| i.to_le_bytes()).collect()));
    if let Some(grid) = &asset.density {
        let mut bytes: Vec<u8> = grid.size.iter().flat_map(|n| n.to_le_bytes()).collect();
        bytes.extend(floats(grid.min.iter().chain(&grid.max).copied()));
        bytes.extend(halves(grid.values.iter().flatten().copied()));
        sections.push((Kind::Density, bytes));
    }
    let mending = &asset.info.provenance.mesh_report.mending;
    if *mending != Mending::default() {
        sections.push((Kind::Mending, mending.counts().into_iter().flat_map(u64::to_le_bytes).collect()));
    }
    Ok(sections.into_iter().map(|(kind, data)| Draft { kind, part: SHARED, data }).collect())
}

/// The samples of `range`, and the weights of all samples of the level that ends with them. `starts` are those of the
/// depth's and the boundary's codes.
fn samples(
    s: &Samples,
    places: &Places,
    [depth, boundary]: &[Vec<usize>; 2],
    range: Range<usize>,
    weight: &[f32],
) -> Vec<(Kind, Vec<u8>)> {
    let place = |p: &[f32; 4]| {
        let [x, y, z] = places.code(Vec3::new(p[0], p[1], p[2]).as_dvec3());
        [x, y, z, places.radius_code(f64::from(p[3])).to_bits()].map(u16::to_le_bytes)
    };
    let lobe_of = |i: usize| s.lobe.get(i).map_or(0, |a| lobe::code(*a));
    let offset = |i: usize| {
        let (o, mark) = (s.offset[i], if lobe_of(i) == 0 { 0 } else { HAS_LOBE });
        [o[0] as u8, o[1] as u8, o[2] as u8, s.depth.order[i] | mark]
    };
    let codes = |h: &Harmonics, starts: &[usize]| h.codes[starts[range.start]..starts[range.end]].to_vec();
    let mut sections = vec![
        (Kind::Place, s.position_radius[range.clone()].iter().flat_map(place).flatten().collect()),
        (Kind::Offset, range.clone().flat_map(offset).collect()),
        (Kind::Weight, halves(weight.iter().map(|w| f16::from_f32(*w)))),
        (Kind::DepthScale, halves(s.depth.scale[range.clone()].iter().copied())),
        (Kind::Depth, codes(&s.depth, depth)),
    ];
    if !s.lobe.is_empty() {
        let codes = range.clone().map(lobe_of).filter(|code| *code != 0);
        sections.push((Kind::Lobe, codes.flat_map(u32::to_le_bytes).collect()));
    }
    if !s.boundary.is_empty() {
        sections.push((Kind::BoundaryScale, halves(s.boundary.scale[range.clone()].iter().copied())));
        sections.push((Kind::Boundary, codes(&s.boundary, boundary)));
    }
    sections
}

/// Writes the asset; the file appears only when complete.
///
/// # Errors
/// Parts that do not fit together, or the file cannot be written.
pub fn write(path: &Path, asset: &Asset) -> Result<()> {
    files::write_atomically(path, &encode(asset)?)
}
