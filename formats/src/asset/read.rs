//! Bytes to asset. Survives any byte string; allocates no more than a small multiple of the file's size.

use super::container::{self, Kind, Section};
use super::{Asset, DensityGrid, FORMAT_VERSION, HAS_LOBE, Info, Places, Samples, codec};
use crate::harmonics::Harmonics;
use crate::{Error, Result, files, lobe};
use glam::Vec3;
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
    let info: Info = codec::decode(need(Kind::Info)?)?;
    let places = Places::new(info.bounds);
    let (offset, bands): (Vec<[i8; 4]>, Vec<u8>) = groups(need(Kind::Offset)?)?
        .into_iter()
        .map(|[x, y, z, bands]: [u8; 4]| ([x as i8, y as i8, z as i8, 0], bands))
        .unzip();
    let lobes = find(Kind::Lobe)?.map(words).transpose()?;
    let halves_of = |kind: Kind| find(kind)?.map_or(Ok(Vec::new()), halves);
    let floats_of = |kind: Kind| find(kind)?.map_or(Ok(Vec::new()), floats);
    let boundary_scale = halves_of(Kind::BoundaryScale)?;
    let boundary_order = u8::try_from(info.boundary_order).unwrap_or(u8::MAX);
    let asset = Asset {
        samples: Samples {
            position_radius: place(need(Kind::Place)?, &places)?,
            offset,
            weight: halves(need(Kind::Weight)?)?.into_iter().map(f16::to_f32).collect(),
            depth: Harmonics {
                order: bands.iter().map(|b| b & !HAS_LOBE).collect(),
                scale: halves(need(Kind::DepthScale)?)?,
                profile: floats(need(Kind::DepthProfile)?)?,
                codes: need(Kind::Depth)?.to_vec(),
            },
            lobe: lobes.map_or(Ok(Vec::new()), |codes| spread(&codes, &bands))?,
            boundary: Harmonics {
                order: vec![boundary_order; boundary_scale.len()],
                scale: boundary_scale,
                profile: floats_of(Kind::BoundaryProfile)?,
                codes: find(Kind::Boundary)?.map_or(Vec::new(), <[u8]>::to_vec),
            },
        },
        info,
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

fn place(bytes: &[u8], places: &Places) -> Result<Vec<[f32; 4]>> {
    let (chunks, []) = bytes.as_chunks::<8>() else { return Err(ragged()) };
    let word = |c: &[u8; 8], k: usize| u16::from_le_bytes([c[2 * k], c[2 * k + 1]]);
    let one = |c: &[u8; 8]| {
        let [x, y, z] = places.position([0, 1, 2].map(|k| word(c, k))).to_array();
        [x, y, z, places.radius(f16::from_bits(word(c, 3)))]
    };
    Ok(chunks.iter().map(one).collect())
}

/// The lobe of every sample, from the codes of those that have one.
fn spread(codes: &[u32], bands: &[u8]) -> Result<Vec<Vec3>> {
    let mut next = codes.iter();
    let one = |bands: &u8| match bands & HAS_LOBE {
        0 => Ok(Vec3::ZERO),
        _ => next.next().map(|code| lobe::vector(*code)).ok_or_else(ragged),
    };
    let lobes = bands.iter().map(one).collect::<Result<_>>()?;
    if next.next().is_some() { Err(ragged()) } else { Ok(lobes) }
}

fn floats(bytes: &[u8]) -> Result<Vec<f32>> {
    let (chunks, []) = bytes.as_chunks::<4>() else { return Err(ragged()) };
    Ok(chunks.iter().map(|c| f32::from_le_bytes(*c)).collect())
}

fn halves(bytes: &[u8]) -> Result<Vec<f16>> {
    let (chunks, []) = bytes.as_chunks::<2>() else { return Err(ragged()) };
    Ok(chunks.iter().map(|c| f16::from_le_bytes(*c)).collect())
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
