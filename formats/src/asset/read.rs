//! Bytes to asset. Survives any byte string; allocates no more than a small multiple of the file's size.

use super::container::{Kind, SHARED, Section, Table};
use super::levels::no_level;
use super::{Asset, DensityGrid, FORMAT_VERSION, HAS_LOBE, Info, Level, Places, Samples, codec};
use crate::harmonics::Harmonics;
use crate::mesh::Mending;
use crate::{Error, Result, files, lobe};
use glam::Vec3;
use half::f16;
use std::path::Path;

/// Reads an asset file.
///
/// # Errors
/// Unreadable, foreign, truncated, damaged or future file, in one clear line.
pub fn read(path: &Path) -> Result<Asset> {
    parse(&files::read(path, files::Kind::Asset)?).map_err(|e| e.in_file(path))
}

/// As [`read`], from the file's bytes.
pub fn parse(bytes: &[u8]) -> Result<Asset> {
    let table = Table::read(bytes, FORMAT_VERSION)?;
    table.require_whole(bytes)?;
    let all = table.parts();
    Parts { sections: table.sections(bytes, all)?, last: all, all }.asset()
}

/// Reads one level of detail, the same as [`Asset::level`] of the whole, from no more of the file's front than it needs.
/// What comes after that is neither read nor checked and may be missing.
///
/// # Errors
/// As [`read`]; no such level.
pub fn read_level(path: &Path, level: usize) -> Result<Asset> {
    let in_file = |e: Error| e.in_file(path);
    let head = files::read_front(path, files::Kind::Asset, Table::MOST)?;
    let (table, last) = find_level(&head, level).map_err(in_file)?;
    let front = files::read_front(path, files::Kind::Asset, table.front(last))?;
    parse_level(&front, level).map_err(in_file)
}

/// As [`read_level`], from the file's bytes or from those at its front.
///
/// # Errors
/// As [`read_level`].
pub fn parse_level(bytes: &[u8], level: usize) -> Result<Asset> {
    let (table, last) = find_level(bytes, level)?;
    let parts = Parts { sections: table.sections(bytes, last)?, last, all: table.parts() };
    Ok(Asset { levels: Vec::new(), ..parts.asset()? })
}

/// The table, and the last part of a level.
fn find_level(bytes: &[u8], level: usize) -> Result<(Table, u16)> {
    let table = Table::read(bytes, FORMAT_VERSION)?;
    let all = table.parts();
    let part =
        u16::try_from(level).ok().and_then(|level| all.checked_sub(level)).filter(|part| *part > SHARED);
    part.map(|part| (table, part)).ok_or_else(|| no_level(level, usize::from(all)))
}

/// Bytes of the sections of each kind, in order of their first one.
///
/// # Errors
/// As [`read`].
pub fn section_sizes(bytes: &[u8]) -> Result<Vec<(&'static str, usize)>> {
    let table = Table::read(bytes, FORMAT_VERSION)?;
    table.require_whole(bytes)?;
    let name = |kind: u16| Kind::ALL.iter().find(|(k, _)| *k as u16 == kind).map_or("unknown", |(_, n)| *n);
    let mut sizes: Vec<(&str, usize)> = Vec::new();
    for section in table.sections(bytes, table.parts())? {
        let name = name(section.kind);
        match sizes.iter_mut().find(|(n, _)| *n == name) {
            Some((_, size)) => *size += section.data.len(),
            None => sizes.push((name, section.data.len())),
        }
    }
    Ok(sizes)
}

/// Bytes of a sample's place.
const PLACE: usize = 8;

/// Sections of some parts of a file.
struct Parts<'a> {
    sections: Vec<Section<'a>>,
    /// The last of these parts.
    last: u16,
    /// The last one of the file.
    all: u16,
}

impl<'a> Parts<'a> {
    fn find(&self, kind: Kind, part: u16) -> Result<Option<&'a [u8]>> {
        let mut found = self.sections.iter().filter(|s| s.kind == kind as u16 && s.part == part);
        let first = found.next();
        if found.next().is_some() {
            return Err(Error::invalid(format!("the asset has section {} twice", kind as u16)));
        }
        Ok(first.map(|s| s.data))
    }

    fn need(&self, kind: Kind, part: u16) -> Result<&'a [u8]> {
        let lacks = || Error::invalid(format!("the asset lacks its section {}", kind as u16));
        self.find(kind, part)?.ok_or_else(lacks)
    }

    /// All parts of samples one after the other; nothing where none has such a section. All or none must have it, so that
    /// each level can be read alone.
    fn joined(&self, kind: Kind) -> Result<Vec<u8>> {
        let parts = (1..=self.last).filter_map(|part| self.find(kind, part).transpose());
        let parts = parts.collect::<Result<Vec<_>>>()?;
        if parts.is_empty() || parts.len() == usize::from(self.last) {
            Ok(parts.concat())
        } else {
            Err(Error::invalid(format!("some parts of the asset lack section {}", kind as u16)))
        }
    }

    fn weight(&self, part: u16) -> Result<Vec<f32>> {
        Ok(halves(self.need(Kind::Weight, part)?)?.into_iter().map(f16::to_f32).collect())
    }

    /// The coarser ones of the levels that end with these parts, the finest of them first.
    fn levels(&self, widths: &[f32], errors: Option<&[f32]>) -> Result<Vec<Level>> {
        let mut samples = 0;
        let mut levels = Vec::new();
        for (part, (k, width_factor)) in (1..self.last).zip(widths.iter().enumerate()) {
            let weight = self.weight(part)?;
            samples += self.need(Kind::Place, part)?.len() / PLACE;
            if samples != weight.len() {
                return Err(Error::invalid("the asset's levels of detail and samples do not fit together"));
            }
            levels.push(Level { width_factor: *width_factor, weight, error: errors.map(|e| e[k]) });
        }
        levels.reverse();
        Ok(levels)
    }

    fn samples(&self, info: &Info) -> Result<Samples> {
        let (offset, bands): (Vec<[i8; 4]>, Vec<u8>) = groups(&self.joined(Kind::Offset)?)?
            .into_iter()
            .map(|[x, y, z, bands]: [u8; 4]| ([x as i8, y as i8, z as i8, 0], bands))
            .unzip();
        let has_lobes = self.find(Kind::Lobe, self.last)?.is_some();
        let lobes = words(&self.joined(Kind::Lobe)?)?;
        let boundary_scale = halves(&self.joined(Kind::BoundaryScale)?)?;
        let boundary_order = u8::try_from(info.boundary_order).unwrap_or(u8::MAX);
        let boundary_profile = self.find(Kind::BoundaryProfile, SHARED)?;
        Ok(Samples {
            position_radius: place(&self.joined(Kind::Place)?, &Places::new(info.bounds))?,
            offset,
            weight: self.weight(self.last)?,
            depth: Harmonics {
                order: bands.iter().map(|b| b & !HAS_LOBE).collect(),
                scale: halves(&self.joined(Kind::DepthScale)?)?,
                profile: floats(self.need(Kind::DepthProfile, SHARED)?)?,
                codes: self.joined(Kind::Depth)?,
            },
            lobe: if has_lobes { spread(&lobes, &bands)? } else { Vec::new() },
            boundary: Harmonics {
                order: vec![boundary_order; boundary_scale.len()],
                scale: boundary_scale,
                profile: boundary_profile.map_or(Ok(Vec::new()), floats)?,
                codes: self.joined(Kind::Boundary)?,
            },
        })
    }

    fn asset(&self) -> Result<Asset> {
        let mut info: Info = codec::decode(self.need(Kind::Info, SHARED)?)?;
        let widths = self.find(Kind::LevelWidth, SHARED)?.map_or(Ok(Vec::new()), floats)?;
        if widths.len() + 1 != usize::from(self.all) {
            return Err(Error::invalid("the asset's levels of detail and their widths do not fit together"));
        }
        let errors = self.find(Kind::LevelError, SHARED)?.map(floats).transpose()?;
        if errors.as_ref().is_some_and(|e| e.len() != widths.len()) {
            return Err(Error::invalid("the asset's levels of detail and their errors do not fit together"));
        }
        if let Some(bytes) = self.find(Kind::Mending, SHARED)? {
            info.provenance.mesh_report.mending = mending(bytes)?;
        }
        let samples = self.samples(&info)?;
        // A coarser level: the metadata are those of all samples.
        if let Some(width_factor) = widths.get(usize::from(self.last) - 1) {
            info.samples = samples.len() as u64;
            info.width_factor = *width_factor;
            info.certificate = None;
        }
        let asset = Asset {
            info,
            samples,
            levels: self.levels(&widths, errors.as_deref())?,
            mesh_positions: groups(&floats(self.need(Kind::MeshPositions, SHARED)?)?)?,
            mesh_triangles: groups(&words(self.need(Kind::MeshTriangles, SHARED)?)?)?,
            density: self.find(Kind::Density, SHARED)?.map(density).transpose()?,
        };
        asset.validate()?;
        Ok(asset)
    }
}

fn ragged() -> Error {
    Error::invalid("a section of the asset has a ragged length")
}

fn words(bytes: &[u8]) -> Result<Vec<u32>> {
    let (chunks, []) = bytes.as_chunks::<4>() else { return Err(ragged()) };
    Ok(chunks.iter().map(|c| u32::from_le_bytes(*c)).collect())
}

fn place(bytes: &[u8], places: &Places) -> Result<Vec<[f32; 4]>> {
    let (chunks, []) = bytes.as_chunks::<PLACE>() else { return Err(ragged()) };
    let word = |c: &[u8; PLACE], k: usize| u16::from_le_bytes([c[2 * k], c[2 * k + 1]]);
    let one = |c: &[u8; PLACE]| {
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

fn mending(bytes: &[u8]) -> Result<Mending> {
    let (chunks, []) = bytes.as_chunks::<8>() else { return Err(ragged()) };
    let counts: [u64; 6] = std::array::from_fn(|k| chunks.get(k).map_or(0, |c| u64::from_le_bytes(*c)));
    if chunks.len() == counts.len() { Ok(Mending::from_counts(counts)) } else { Err(ragged()) }
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
