//! Assets.

use super::{Use, words};
use diaphane_formats::asset::{Asset, FORMAT_VERSION, encode, parse, parse_level, section_sizes};
use diaphane_formats::visibility::{Accel, inside_pieces};
use glam::{DVec3, Vec3};

/// Where an asset is looked into, relative to its box.
const PROBES: [DVec3; 3] = [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.1), DVec3::new(-9.0, 4.0, 2.0)];

/// A whole file.
pub(super) fn file(bytes: &[u8]) -> Result<Use, String> {
    let sizes = section_sizes(bytes);
    let level = parse_level(bytes, 1);
    match parse(bytes) {
        Ok(asset) => {
            assert!(sizes.is_ok_and(|sizes| sizes.iter().all(|(_, size)| *size <= bytes.len())));
            // The front of the file says the same as the whole.
            assert_eq!(level.ok(), asset.level(1).ok());
            Ok(Box::new(move || play(&asset)))
        }
        Err(e) => Err(words(e)),
    }
}

/// Sections one after the other (kind u8, part u8, length u16, that many bytes; the last one may be cut), from which a file
/// with right checksums is made.
pub(super) fn sections(mut bytes: &[u8]) -> Result<Use, String> {
    let mut sections = Vec::new();
    while let Some(([kind, part, low, high], rest)) = bytes.split_first_chunk() {
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(rest.len());
        let (data, rest) = rest.split_at(length);
        sections.push((u16::from(*kind), u16::from(*part), data));
        bytes = rest;
    }
    file(&assemble(&sections))
}

/// The container, see `formats/src/asset/container.rs`.
fn assemble(sections: &[(u16, u16, &[u8])]) -> Vec<u8> {
    let align = |n: usize| n.next_multiple_of(64);
    let head = align(32 + 24 * sections.len());
    let mut bytes = vec![0; head];
    for (i, (kind, part, data)) in sections.iter().enumerate() {
        let at = bytes.len();
        bytes.extend_from_slice(data);
        bytes.resize(align(bytes.len()), 0);
        let mut entry = Vec::with_capacity(24);
        entry.extend(kind.to_le_bytes());
        entry.extend(part.to_le_bytes());
        entry.extend(crc32fast::hash(&bytes[at..]).to_le_bytes());
        entry.extend((at as u64).to_le_bytes());
        entry.extend((data.len() as u64).to_le_bytes());
        bytes[32 + 24 * i..32 + 24 * (i + 1)].copy_from_slice(&entry);
    }
    let length = bytes.len() as u64;
    bytes[..8].copy_from_slice(b"DIAPHANE");
    bytes[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
    bytes[12..16].copy_from_slice(&(sections.len() as u32).to_le_bytes());
    bytes[16..24].copy_from_slice(&length.to_le_bytes());
    let sum = crc32fast::hash(&bytes[..head]);
    bytes[24..28].copy_from_slice(&sum.to_le_bytes());
    bytes
}

/// What a player does with an asset, without pictures.
fn play(asset: &Asset) {
    asset.validate().expect("what was read is valid");
    let again = parse(&encode(asset).expect("what was read can be written")).expect("and read again");
    assert_eq!((again.samples.len(), again.levels.len()), (asset.samples.len(), asset.levels.len()));
    for (level, (samples, _)) in asset.level_sizes().into_iter().enumerate() {
        assert_eq!(asset.level(level).expect("the level is there").samples.len(), samples);
    }
    for harmonics in [&asset.samples.depth, &asset.samples.boundary] {
        assert_eq!(harmonics.decoded().len(), harmonics.len());
    }
    assert!((0..asset.samples.len()).all(|i| !asset.samples.centroid(i).is_nan()));
    let medium = asset.medium().expect("its medium makes sense");
    let mesh = asset.mesh().expect("its mesh makes sense");
    let accel = Accel::new(&mesh);
    let (mut crossings, mut pieces) = (Vec::new(), Vec::new());
    let extent = f64::from(asset.info.diagonal());
    for probe in PROBES {
        let at = probe * extent;
        if let Some(grid) = &asset.density {
            assert!(grid.value(at.as_vec3()).iter().all(|v| v.is_finite() && *v >= 0.0));
        }
        assert!(medium.density(at) >= 0.0);
        let direction = DVec3::new(0.36, 0.48, 0.8);
        inside_pieces(&accel, asset.info.ior, at, direction, &mut crossings, &mut pieces);
        assert!(pieces.iter().all(|p| p.start <= p.end));
        accel.nearest(at, f64::INFINITY);
    }
    assert!(asset.info.ratio().cmpge(Vec3::ZERO).all());
}
