//! The asset file: what is written is read again, and no damaged file passes or panics.

#[path = "support/workbench.rs"]
mod workbench;

use diaphane_formats::asset::{Asset, encode, parse, parse_level, section_sizes};
use diaphane_formats::medium::{Density, Grid, Medium};
use diaphane_formats::mesh::Mending;
use diaphane_formats::phase::Phase;
use glam::DVec3;
use proptest::prelude::*;

/// An asset with every kind of section: a density column and a boundary that refracts.
fn asset() -> Asset {
    let values = vec![1.0, 0.2, 0.2, 1.5];
    let grid = Grid::new([1, 4, 1], DVec3::splat(-1.0), DVec3::splat(1.0), values).unwrap();
    let phase = Phase::HenyeyGreenstein { g: 0.3 };
    let medium = Medium::new(DVec3::splat(2.0), DVec3::splat(0.9), phase, 1.3, Density::Grid(grid)).unwrap();
    workbench::small_asset(&medium, 40)
}

#[test]
fn round_trip() {
    let asset = asset();
    let bytes = encode(&asset).unwrap();
    let sections = section_sizes(&bytes).unwrap();
    for name in [
        "info",
        "place",
        "offset",
        "weight",
        "depth",
        "depth_scale",
        "boundary",
        "boundary_scale",
        "mesh_positions",
        "mesh_triangles",
        "density",
    ] {
        assert!(sections.iter().any(|(n, size)| *n == name && *size > 0), "{name} is missing");
    }
    let read = parse(&bytes).unwrap();
    assert_eq!(read.info, asset.info);
    assert_eq!((&read.mesh_positions, &read.mesh_triangles), (&asset.mesh_positions, &asset.mesh_triangles));
    assert_eq!(read.samples.position_radius, asset.samples.position_radius);
    // A bake rounds to what the file holds: nothing is lost by writing.
    assert_eq!(read, asset);
    assert_eq!(encode(&read).unwrap(), bytes);
}

#[test]
fn rare_repairs_of_the_mesh_have_a_section_of_their_own() {
    let mut asset = asset();
    let has = |bytes: &[u8]| section_sizes(bytes).unwrap().iter().any(|(n, _)| *n == "mending");
    assert!(!has(&encode(&asset).unwrap()));
    let counts = [1, 2, 3, 4, 5, 6];
    asset.info.provenance.mesh_report.mending = Mending::from_counts(counts);
    let bytes = encode(&asset).unwrap();
    assert!(has(&bytes));
    let read = parse(&bytes).unwrap();
    assert_eq!(read, asset);
    assert_eq!(read.info.provenance.mesh_report.mending.counts(), counts);
}

#[test]
fn every_truncation_is_an_error() {
    let bytes = encode(&asset()).unwrap();
    for length in 0..bytes.len() {
        assert!(parse(&bytes[..length]).is_err(), "the first {length} bytes passed");
    }
}

#[test]
fn every_flipped_byte_is_an_error() {
    let bytes = encode(&asset()).unwrap();
    let mut damaged = bytes.clone();
    for i in 0..bytes.len() {
        for mask in [0x01, 0x80, 0xff] {
            damaged[i] = bytes[i] ^ mask;
            assert!(parse(&damaged).is_err(), "byte {i} ^ {mask:#x} passed");
        }
        damaged[i] = bytes[i];
    }
    assert!(parse(&damaged).is_ok());
}

#[test]
fn extra_bytes_are_an_error() {
    let mut bytes = encode(&asset()).unwrap();
    bytes.push(0);
    assert!(parse(&bytes).is_err());
}

proptest! {
    #[test]
    fn any_bytes_are_survived(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(parse(&bytes).is_err());
        let mut headed = b"DIAPHANE\x04\x00\x00\x00".to_vec();
        headed.extend(&bytes);
        prop_assert!(parse(&headed).is_err());
        prop_assert!(parse_level(&headed, 1).is_err());
    }
}
