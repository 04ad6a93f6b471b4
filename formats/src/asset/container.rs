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
//! table   32  for each section: kind u16, part u16, CRC-32 u32, offset u64, length u64
//! section     at multiples of 64, in the table's order; its CRC-32 covers the zero padding after it too
//! ```
//!
//! So every byte of a file is covered by one checksum. A reader skips sections of kinds that it does not know.
//!
//! Part 0 is what every level of detail needs; parts 1, 2, ... are what the levels add, the coarsest first. Parts follow
//! each other in the file, so that its front is enough for the coarser levels.

use crate::{Error, Result};

pub(crate) const MAGIC: &[u8; 8] = b"DIAPHANE";
const HEADER: usize = 32;
const ENTRY: usize = 24;
const ALIGNMENT: usize = 64;
const MAX_SECTIONS: usize = 96;
/// Part of the sections that every level needs.
pub(super) const SHARED: u16 = 0;

/// What a section holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub(super) enum Kind {
    /// Metadata (see `codec`).
    Info = 1,
    /// u16 × 3: position in the bounding box; f16: radius.
    Place = 2,
    /// f16: weights of all samples of the level that ends with this part.
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
    /// f32 a level but the finest, the coarsest first: width factor.
    LevelWidth = 15,
    /// u64 each: counts of rarer repairs of the mesh; absent where all are 0.
    Mending = 16,
    /// f32 a level but the finest, the coarsest first: measured error; absent where nothing was measured.
    LevelError = 17,
}

impl Kind {
    pub(super) const ALL: [(Self, &'static str); 17] = [
        (Self::Info, "info"),
        (Self::LevelWidth, "level_width"),
        (Self::LevelError, "level_error"),
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
        (Self::Mending, "mending"),
    ];
}

/// A section found in a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section<'a> {
    pub kind: u16,
    pub part: u16,
    pub data: &'a [u8],
}

/// A section to be written.
pub(super) struct Draft {
    pub kind: Kind,
    pub part: u16,
    pub data: Vec<u8>,
}

fn align(n: usize) -> usize {
    n.div_ceil(ALIGNMENT) * ALIGNMENT
}

/// Assembles a file.
pub(super) fn assemble(version: u32, sections: &[Draft]) -> Vec<u8> {
    let mut at = align(HEADER + ENTRY * sections.len());
    let mut bytes = vec![0u8; at];
    let mut table = Vec::new();
    for Draft { kind, part, data } in sections {
        let end = align(at + data.len());
        bytes.extend_from_slice(data);
        bytes.resize(end, 0);
        table.extend_from_slice(&(*kind as u16).to_le_bytes());
        table.extend_from_slice(&part.to_le_bytes());
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

/// One line of the table; its range lies within the length that the header tells.
struct Entry {
    kind: u16,
    part: u16,
    crc: u32,
    start: usize,
    length: usize,
    /// After the padding.
    end: usize,
}

/// Where a file's sections are.
pub(super) struct Table {
    entries: Vec<Entry>,
    /// Of the whole file.
    length: usize,
}

fn cut() -> Error {
    Error::invalid("the asset is cut short; copy or bake it again")
}

impl Table {
    /// Bytes at the front of a file that hold every table.
    pub const MOST: usize = (HEADER + ENTRY * MAX_SECTIONS).next_multiple_of(ALIGNMENT);

    /// Reads and checks the table at the front of a file, of which `bytes` may hold no more than [`Self::MOST`].
    pub fn read(bytes: &[u8], version: u32) -> Result<Self> {
        if bytes.len() < 8 || &bytes[..8] != MAGIC {
            return Err(Error::invalid("is not a diaphane asset"));
        }
        if bytes.len() < HEADER {
            return Err(cut());
        }
        let u16_at = |i: usize| u16::from_le_bytes([bytes[i], bytes[i + 1]]);
        let u32_at = |i: usize| u32::from(u16_at(i)) | u32::from(u16_at(i + 2)) << 16;
        let u64_at = |i: usize| u64::from(u32_at(i)) | u64::from(u32_at(i + 4)) << 32;
        known(u32_at(8), version)?;
        let damaged = || Error::invalid("the asset's section table is damaged");
        let count = u32_at(12) as usize;
        if count > MAX_SECTIONS {
            return Err(damaged());
        }
        let head = align(HEADER + ENTRY * count);
        if head > bytes.len() {
            return Err(cut());
        }
        let mut header = bytes[..head].to_vec();
        header[24..28].fill(0);
        if crc32fast::hash(&header) != u32_at(24) {
            return Err(Error::invalid("the asset's header is damaged (checksum)"));
        }
        let length = usize::try_from(u64_at(16)).map_err(|_| damaged())?;
        let mut entries = Vec::with_capacity(count);
        let mut at = head;
        for i in 0..count {
            let entry = HEADER + ENTRY * i;
            let size = usize::try_from(u64_at(entry + 16)).ok().filter(|size| *size <= length);
            let size = size.ok_or_else(damaged)?;
            let end = at.checked_add(size).and_then(|e| e.checked_next_multiple_of(ALIGNMENT));
            let end = end.filter(|e| *e <= length && u64_at(entry + 8) == at as u64).ok_or_else(damaged)?;
            entries.push(Entry {
                kind: u16_at(entry),
                part: u16_at(entry + 2),
                crc: u32_at(entry + 4),
                start: at,
                length: size,
                end,
            });
            at = end;
        }
        if at != length {
            return Err(Error::invalid("the asset has bytes that no section owns"));
        }
        Ok(Self { entries, length })
    }

    /// The last part.
    pub fn parts(&self) -> u16 {
        self.entries.iter().map(|e| e.part).max().unwrap_or(SHARED)
    }

    /// Length of the front of the file that holds all parts up to `last`.
    pub fn front(&self, last: u16) -> usize {
        self.entries.iter().filter(|e| e.part <= last).map(|e| e.end).max().unwrap_or(0)
    }

    /// Checks that `bytes` are as many as the header tells.
    pub fn require_whole(&self, bytes: &[u8]) -> Result<()> {
        match bytes.len() {
            n if n < self.length => Err(cut()),
            n if n > self.length => Err(Error::invalid("the asset has bytes after its end")),
            _ => Ok(()),
        }
    }

    /// The sections of all parts up to `last`, each byte checked. `bytes` are at least the [`Self::front`] of them.
    pub fn sections<'a>(&self, bytes: &'a [u8], last: u16) -> Result<Vec<Section<'a>>> {
        let wanted = self.entries.iter().filter(|e| e.part <= last);
        let section = |e: &Entry| {
            let whole = bytes.get(e.start..e.end).ok_or_else(cut)?;
            if crc32fast::hash(whole) != e.crc {
                return Err(Error::invalid(format!("section {} of the asset is damaged (checksum)", e.kind)));
            }
            Ok(Section { kind: e.kind, part: e.part, data: &whole[..e.length] })
        };
        wanted.map(section).collect()
    }
}

/// Whether this build reads files of version `found`.
fn known(found: u32, version: u32) -> Result<()> {
    if found > version {
        return Err(Error::invalid(format!(
            "has format version {found}, newer than {version}, the newest that this program reads; update diaphane"
        )));
    }
    if found != version {
        return Err(Error::invalid(format!("has the unknown format version {found}")));
    }
    Ok(())
}
