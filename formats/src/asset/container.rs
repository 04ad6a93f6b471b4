//! The container: header, section table, sections.
//!
//! All numbers little-endian.
//!
//! ```text
//! header   0  magic "DIAPHANE"     8 bytes
//!          8  format version       u32
//!         12  number of sections   u32
//!         16  length of the file   u64
//!         24  CRC-32 of header and table, computed with these four bytes zero
//!         28  zero                 u32
//! table   32  for each section: kind u32, CRC-32 u32, offset u64, length u64
//! section     at multiples of 64, in the table's order; its CRC-32 covers the zero padding after it too
//! ```
//!
//! So every byte of a file is covered by one checksum. A reader skips sections of kinds that it does not know.

use crate::{Error, Result};

pub(super) const MAGIC: &[u8; 8] = b"DIAPHANE";
const HEADER: usize = 32;
const ENTRY: usize = 24;
const ALIGNMENT: usize = 64;
const MAX_SECTIONS: usize = 64;

/// What a section holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Kind {
    /// Metadata (see `codec`).
    Info = 1,
    /// u16 × 3: position in the bounding box; f16: radius.
    Place = 2,
    /// f16.
    Weight = 3,
    /// Codes of the depth's harmonics.
    Depth = 4,
    /// Codes of the boundary's harmonics.
    Boundary = 5,
    /// f32 × 3.
    MeshPositions = 6,
    /// u32 × 3.
    MeshTriangles = 7,
    /// u32 × 3 size, f32 × 6 bounds, then f16 × 2 a voxel.
    Density = 8,
    /// i8 × 3: from the position to the centroid; u8: order of the depth's harmonics.
    Offset = 9,
    /// f16: scale of the depth's harmonics.
    DepthScale = 10,
    /// f16: scale of the boundary's harmonics.
    BoundaryScale = 11,
    /// f32 a band: profile of the depth's harmonics.
    DepthProfile = 12,
    /// f32 a band: profile of the boundary's harmonics.
    BoundaryProfile = 13,
    /// f16 × 3: lobe.
    Lobe = 14,
}

impl Kind {
    pub(super) const ALL: [(Self, &'static str); 14] = [
        (Self::Info, "info"),
        (Self::Place, "place"),
        (Self::Offset, "offset"),
        (Self::Weight, "weight"),
        (Self::Depth, "depth"),
        (Self::DepthScale, "depth_scale"),
        (Self::DepthProfile, "depth_profile"),
        (Self::Lobe, "lobe"),
        (Self::Boundary, "boundary"),
        (Self::BoundaryScale, "boundary_scale"),
        (Self::BoundaryProfile, "boundary_profile"),
        (Self::MeshPositions, "mesh_positions"),
        (Self::MeshTriangles, "mesh_triangles"),
        (Self::Density, "density"),
    ];
}

/// A section found in a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section<'a> {
    pub kind: u32,
    pub data: &'a [u8],
}

fn align(n: usize) -> usize {
    n.div_ceil(ALIGNMENT) * ALIGNMENT
}

/// Assembles a file.
pub(super) fn assemble(version: u32, sections: &[(Kind, Vec<u8>)]) -> Vec<u8> {
    let mut at = align(HEADER + ENTRY * sections.len());
    let mut bytes = vec![0u8; at];
    let mut table = Vec::new();
    for (kind, data) in sections {
        let end = align(at + data.len());
        bytes.extend_from_slice(data);
        bytes.resize(end, 0);
        table.extend_from_slice(&(*kind as u32).to_le_bytes());
        table.extend_from_slice(&crc32fast::hash(&bytes[at..end]).to_le_bytes());
        table.extend_from_slice(&(at as u64).to_le_bytes());
        table.extend_from_slice(&(data.len() as u64).to_le_bytes());
        at = end;
    }
    bytes[..8].copy_from_slice(MAGIC);
    bytes[8..12].copy_from_slice(&version.to_le_bytes());
    bytes[12..16].copy_from_slice(&(sections.len() as u32).to_le_bytes());
    bytes[16..24].copy_from_slice(&(at as u64).to_le_bytes());
    bytes[HEADER..HEADER + table.len()].copy_from_slice(&table);
    let head = align(HEADER + table.len());
    let crc = crc32fast::hash(&bytes[..head]);
    bytes[24..28].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Splits a file into its sections after checking every byte.
pub(super) fn open(bytes: &[u8], version: u32) -> Result<Vec<Section<'_>>> {
    let cut = || Error::invalid("the asset is cut short; copy or bake it again");
    if bytes.len() < 8 || &bytes[..8] != MAGIC {
        return Err(Error::invalid("is not a diaphane asset"));
    }
    if bytes.len() < HEADER {
        return Err(cut());
    }
    let u32_at = |i: usize| u32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
    let u64_at = |i: usize| u64::from(u32_at(i)) | u64::from(u32_at(i + 4)) << 32;
    let found = u32_at(8);
    if found > version {
        return Err(Error::invalid(format!(
            "has format version {found}, newer than {version}, the newest that this program reads; update diaphane"
        )));
    }
    if found != version {
        return Err(Error::invalid(format!("has the unknown format version {found}")));
    }
    let length = u64_at(16);
    if length > bytes.len() as u64 {
        return Err(cut());
    }
    if length != bytes.len() as u64 {
        return Err(Error::invalid("the asset has bytes after its end"));
    }
    let count = u32_at(12) as usize;
    let head = align(HEADER + ENTRY * count.min(MAX_SECTIONS + 1));
    if count > MAX_SECTIONS || head > bytes.len() {
        return Err(Error::invalid("the asset's section table is damaged"));
    }
    let mut header = bytes[..head].to_vec();
    header[24..28].fill(0);
    if crc32fast::hash(&header) != u32_at(24) {
        return Err(Error::invalid("the asset's header is damaged (checksum)"));
    }
    let mut sections = Vec::with_capacity(count);
    let mut at = head;
    for i in 0..count {
        let entry = HEADER + ENTRY * i;
        let (kind, crc, offset, length) =
            (u32_at(entry), u32_at(entry + 4), u64_at(entry + 8), u64_at(entry + 16));
        let damaged = || Error::invalid(format!("section {kind} of the asset is damaged (checksum)"));
        let length = usize::try_from(length).map_err(|_| damaged())?;
        let end = at.checked_add(length).map(align).filter(|&e| e <= bytes.len()).ok_or_else(damaged)?;
        if offset != at as u64 || crc32fast::hash(&bytes[at..end]) != crc {
            return Err(damaged());
        }
        sections.push(Section { kind, data: &bytes[at..at + length] });
        at = end;
    }
    if at != bytes.len() {
        return Err(Error::invalid("the asset has bytes that no section owns"));
    }
    Ok(sections)
}
