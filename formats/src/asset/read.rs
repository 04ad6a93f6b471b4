//! Bytes to asset. Survives any byte string; allocates no more than a small multiple of the file's size.

use super::container::{self, Kind, Section};
use super::{Asset, DensityGrid, FORMAT_VERSION, Samples, codec};
use crate::{Error, Result, files};
use half::f16;
use std::path::Path;

/// Reads an asset file.
///
/// # Errors
/// Unreadable, foreign, truncated, damaged or future file, in one clear line.
pub fn read(path: &Path) -> Result<Asset> {
    parse(&files::read(path)?).map_err(|e| e.in_file(path))
}

/// As [`read`], from the file's bytes.
pub fn parse(bytes: &[u8]) -> Result<Asset> {
    let sections = container::open(bytes, FORMAT_VERSION)?;
    let find = |kind: Kind| optional(&sections, kind);
    let need = |kind: Kind| {
        find(kind)?.ok_or_else(|| Error::invalid(format!("the asset lacks its section {}", kind as u32)))
    };
    let asset = Asset {
        info: codec::decode(need(Kind::Info)?)?,
        samples: Samples {
            position_radius: groups(&floats(need(Kind::PositionRadius)?)?)?,
            offset: groups(&signed(need(Kind::Offset)?))?,
            weight: floats(need(Kind::Weight)?)?,
            depth: halves(need(Kind::Depth)?)?,
            boundary: find(Kind::Boundary)?.map_or(Ok(Vec::new()), halves)?,
        },
        mesh_positions: groups(&floats(need(Kind::MeshPositions)?)?)?,
        mesh_triangles: groups(&words(need(Kind::MeshTriangles)?)?)?,
        density: find(Kind::Density)?.map(density).transpose()?,
    };
    asset.validate()?;
    Ok(asset)
}

/// Names and bytes of the sections of a file, in order.
///
/// # Errors
/// As [`read`].
pub fn section_sizes(bytes: &[u8]) -> Result<Vec<(&'static str, usize)>> {
    let sections = container::open(bytes, FORMAT_VERSION)?;
    let name = |kind: u32| Kind::ALL.iter().find(|(k, _)| *k as u32 == kind).map_or("unknown", |(_, n)| *n);
    Ok(sections.iter().map(|s| (name(s.kind), s.data.len())).collect())
}

fn optional<'a>(sections: &[Section<'a>], kind: Kind) -> Result<Option<&'a [u8]>> {
    let mut found = sections.iter().filter(|s| s.kind == kind as u32);
    let first = found.next();
    if found.next().is_some() {
        return Err(Error::invalid(format!("the asset has section {} twice", kind as u32)));
    }
    Ok(first.map(|s| s.data))
}

fn ragged() -> Error {
    Error::invalid("a section of the asset has a ragged length")
}

fn words(bytes: &[u8]) -> Result<Vec<u32>> {
    let (chunks, []) = bytes.as_chunks::<4>() else { return Err(ragged()) };
    Ok(chunks.iter().map(|c| u32::from_le_bytes(*c)).collect())
}

fn signed(bytes: &[u8]) -> Vec<i8> {
    bytes.iter().map(|b| *b as i8).collect()
}

fn floats(bytes: &[u8]) -> Result<Vec<f32>> {
    let (chunks, []) = bytes.as_chunks::<4>() else { return Err(ragged()) };
    Ok(chunks.iter().map(|c| f32::from_le_bytes(*c)).collect())
}

fn halves(bytes: &[u8]) -> Result<Vec<f32>> {
    let (chunks, []) = bytes.as_chunks::<2>() else { return Err(ragged()) };
    Ok(chunks.iter().map(|c| f16::from_le_bytes(*c).to_f32()).collect())
}

fn groups<T: Copy, const N: usize>(values: &[T]) -> Result<Vec<[T; N]>> {
    let (chunks, []) = values.as_chunks::<N>() else { return Err(ragged()) };
    Ok(chunks.to_vec())
}

fn density(bytes: &[u8]) -> Result<DensityGrid> {
    let (head, values) = bytes.split_at_checked(36).ok_or_else(ragged)?;
    let size = words(&head[..12])?;
    let bounds = floats(&head[12..])?;
    let (chunks, []) = values.as_chunks::<4>() else { return Err(ragged()) };
    Ok(DensityGrid {
        size: [size[0], size[1], size[2]],
        min: [bounds[0], bounds[1], bounds[2]],
        max: [bounds[3], bounds[4], bounds[5]],
        values: chunks
            .iter()
            .map(|c| [f16::from_le_bytes([c[0], c[1]]), f16::from_le_bytes([c[2], c[3]])])
            .collect(),
    })
}
