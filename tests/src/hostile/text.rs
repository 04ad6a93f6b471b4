//! Materials, scenes and lists of bakes.

use super::{Use, words};
use diaphane_bake::list;
use diaphane_formats::material::parse_material;
use diaphane_formats::picture::{Picture, write_exr};
use diaphane_formats::scene::parse_scene;
use glam::DVec3;
use std::path::Path;
use std::sync::LazyLock;

/// Where relative names start: one file of each kind that a material or scene may name.
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = |name: &str| folder.path().join(name);
    let write =
        |name: &str, bytes: &[u8]| std::fs::write(path(name), bytes).expect("a small file can be written");
    write("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 1), }";
    let head = [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..]].concat();
    let values: Vec<u8> = [0.5f32, 2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    write("g.npy", &[&head, header.as_bytes(), &values].concat());
    write_exr(&path("e.exr"), &Picture::new(4, 2)).expect("a small picture can be written");
    folder
});

fn utf8(bytes: &[u8]) -> Result<&str, String> {
    str::from_utf8(bytes).map_err(words)
}

/// A material, and the files that it names.
pub(super) fn material(bytes: &[u8]) -> Result<Use, String> {
    let medium = parse_material(utf8(bytes)?, FOLDER.path()).map_err(words)?;
    Ok(Box::new(move || {
        let least = medium.least_density();
        assert!(least >= 0.0 && least.is_finite());
        medium.optical_hash();
        for scale in [1.0, 1e-9, 1e9] {
            let at = DVec3::new(0.31, -0.24, 0.17) * scale;
            let (density, scattering) = medium.density_and_scattering(at);
            assert!(density >= 0.0 && density.is_finite() && scattering <= density, "{density} {scattering}");
            let length = medium.density_length(at, DVec3::new(0.36, 0.48, 0.8), -scale, 2.0 * scale);
            assert!(length.is_finite(), "{length}");
        }
    }))
}

/// A scene, and the picture that it names.
pub(super) fn scene(bytes: &[u8]) -> Result<Use, String> {
    let scene = parse_scene(utf8(bytes)?, FOLDER.path()).map_err(words)?;
    Ok(Box::new(move || {
        let rays = scene.ray_frame().expect("a scene that was read has rays");
        let (width, height) = (f64::from(scene.image.width), f64::from(scene.image.height));
        for at in [0.0, 0.5, 1.0] {
            assert!(rays.direction(at * width, at * height, width, height).is_finite());
        }
        for light in &scene.lights {
            let (to, distance, irradiance) = light.at(DVec3::new(0.1, 0.2, 0.3), 1e-3);
            assert!(to.is_finite() && distance >= 0.0);
            assert!(irradiance.is_finite() && irradiance.min_element() >= 0.0, "{irradiance}");
        }
    }))
}

/// A list of bakes.
pub(super) fn list(bytes: &[u8]) -> Result<Use, String> {
    let lines = list::command_lines(utf8(bytes)?, Path::new("")).map_err(words)?;
    Ok(Box::new(move || {
        for line in &lines {
            assert!(!line[1].starts_with('-'), "the mesh became an option: {line:?}");
        }
    }))
}
