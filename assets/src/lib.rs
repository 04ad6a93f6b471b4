//! Meshes, materials and scenes that the project makes itself: what the demonstration and the tests run on.
//!
//! Meshes are made by code ([`shapes`]), materials and scenes are TOML files in this folder. [`write_all`] puts
//! everything into a folder as ordinary input files.

#![warn(clippy::unwrap_used, clippy::expect_used)]

pub mod shapes;

use diaphane_formats::files::write_atomically;
use diaphane_formats::{Error, Result};
use shapes::Triangles;
use std::path::{Path, PathBuf};

/// A built-in object: a mesh with its material and a scene that shows it.
#[derive(Clone, Copy, Debug)]
pub struct Object {
    /// Stem of its file names.
    pub name: &'static str,
    /// What it is, in a few words.
    pub title: &'static str,
    /// Makes the mesh.
    pub mesh: fn() -> Triangles,
    /// Material file.
    pub material: &'static str,
    /// Scene file.
    pub scene: &'static str,
}

/// The built-in objects.
pub const OBJECTS: [Object; 3] = [
    Object {
        name: "statue",
        title: "bird of jade on a plinth",
        mesh: shapes::bird,
        material: include_str!("../materials/statue.material.toml"),
        scene: include_str!("../scenes/statue.scene.toml"),
    },
    Object {
        name: "cube",
        title: "cube around an opaque torus, white and red light behind",
        mesh: || shapes::cuboid([0.577_350_27; 3], 20),
        material: include_str!("../materials/cube.material.toml"),
        scene: include_str!("../scenes/cube.scene.toml"),
    },
    Object {
        name: "block",
        title: "block of layers with two densities",
        mesh: || shapes::rounded_cuboid([0.7, 0.5, 0.5], 0.06, 18),
        material: include_str!("../materials/block.material.toml"),
        scene: include_str!("../scenes/block.scene.toml"),
    },
];

/// Where [`write_all`] put one object's files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// The object's name.
    pub name: &'static str,
    /// OBJ file.
    pub mesh: PathBuf,
    /// Material file.
    pub material: PathBuf,
    /// Scene file.
    pub scene: PathBuf,
}

/// Writes every object's mesh, material and scene to `folder`, which is made if it is missing.
///
/// # Errors
/// The folder or a file cannot be written.
pub fn write_all(folder: &Path) -> Result<Vec<Written>> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io("make the folder", folder, e))?;
    let put = |name: String, text: &str| {
        let path = folder.join(name);
        write_atomically(&path, text.as_bytes()).map(|()| path)
    };
    OBJECTS
        .iter()
        .map(|o| {
            Ok(Written {
                name: o.name,
                mesh: put(format!("{}.obj", o.name), &(o.mesh)().to_obj())?,
                material: put(format!("{}.material.toml", o.name), o.material)?,
                scene: put(format!("{}.scene.toml", o.name), o.scene)?,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::{material::parse_material, mesh::parse_obj, scene::parse_scene};

    #[test]
    fn every_object_loads_without_a_complaint() {
        for o in OBJECTS {
            let (mesh, report) = parse_obj((o.mesh)().to_obj().as_bytes()).unwrap();
            assert!(report.warnings().is_empty(), "{}: {:?}", o.name, report.warnings());
            assert_eq!(report.components, 1, "{}", o.name);
            assert!((1.5..2.5).contains(&mesh.diagonal()), "{}: {}", o.name, mesh.diagonal());
            assert!((2_000..20_000).contains(&mesh.triangles.len()), "{}: {}", o.name, mesh.triangles.len());
            parse_material(o.material, Path::new(".")).unwrap();
            let scene = parse_scene(o.scene, Path::new(".")).unwrap();
            assert!(scene.lights.len() >= 8, "{}", o.name);
            assert!(scene.image.width >= 128 && scene.image.height >= 128 && !scene.surface.reflection);
        }
    }

    #[test]
    fn files_are_the_objects() {
        let folder = std::env::temp_dir().join(format!("diaphane-assets-{}", std::process::id()));
        let written = write_all(&folder).unwrap();
        assert_eq!(written.len(), OBJECTS.len());
        for (w, o) in written.iter().zip(OBJECTS) {
            assert_eq!(std::fs::read_to_string(&w.mesh).unwrap(), (o.mesh)().to_obj());
            assert_eq!(std::fs::read_to_string(&w.scene).unwrap(), o.scene);
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
