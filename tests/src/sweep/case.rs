//! What is drawn: mesh, medium and scene, under a name, with a hash of everything that a result depends on.

use super::lights::with_lights;
use diaphane_formats::directions::hash;
use diaphane_formats::medium::Medium;
use diaphane_formats::mesh::{Mesh, MeshReport};
use diaphane_formats::scene::Scene;
use glam::DVec3;

/// An object to sweep over.
pub struct Case {
    /// Short name, unique within a sweep.
    pub name: String,
    /// Boundary.
    pub mesh: Mesh,
    /// What was mended in it.
    pub mesh_report: MeshReport,
    /// What fills it.
    pub medium: Medium,
    /// Camera and lights, at the sweep's picture size.
    pub scene: Scene,
}

/// Picture of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Longer side, pixels.
    pub side: u32,
    /// Sub-pixel rays.
    pub samples_per_pixel: u32,
}

/// Places at which the medium is hashed.
const PROBES: u64 = 4096;

impl Case {
    /// A case whose picture has the sweep's size and no surface reflection.
    pub fn new(name: String, mesh: (Mesh, MeshReport), medium: Medium, scene: Scene, size: Size) -> Self {
        let mut scene = scene;
        let (width, height) = (f64::from(scene.image.width), f64::from(scene.image.height));
        let factor = f64::from(size.side) / width.max(height).max(1.0);
        scene.image.width = (width * factor).round().max(1.0) as u32;
        scene.image.height = (height * factor).round().max(1.0) as u32;
        scene.image.samples_per_pixel = size.samples_per_pixel;
        scene.surface.reflection = false;
        Self { name, mesh: mesh.0, mesh_report: mesh.1, medium, scene }
    }

    /// The scene with `lights` lights ([`super::lights`]).
    pub fn scene(&self, lights: usize, seed: u64) -> Scene {
        with_lights(&self.scene, &self.mesh, lights, seed)
    }

    /// Hash of mesh, medium (its parameters, and its density at many places) and scene, with `more` mixed in.
    pub fn hash(&self, more: &str) -> String {
        let mut hasher = blake3::Hasher::new();
        let mut number = |v: f64| {
            hasher.update(&v.to_le_bytes());
        };
        self.mesh.positions.iter().flat_map(|p| p.to_array()).for_each(&mut number);
        let (low, high) = self.mesh.bounds();
        for i in 0..PROBES {
            let unit = |axis: u64| hash(i, axis) as f64 / 2f64.powi(64);
            let place = low + (high - low) * DVec3::new(unit(0), unit(1), unit(2));
            let (density, scattering) = self.medium.density_and_scattering(place);
            number(density);
            number(scattering);
        }
        let medium = &self.medium;
        for v in [medium.extinction(), medium.albedo()] {
            v.to_array().into_iter().for_each(&mut number);
        }
        number(medium.phase().mean_cosine());
        number(medium.ior());
        self.mesh.triangles.iter().flatten().for_each(|i| number(f64::from(*i)));
        // The environment, which may be large, plays no part.
        let scene = Scene { environment: None, ..self.scene.clone() };
        hasher.update(format!("{scene:?} {more}").as_bytes());
        hasher.finalize().to_hex()[..16].to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::material::parse_material;
    use diaphane_formats::mesh::parse_obj;
    use diaphane_formats::scene::parse_scene;
    use std::path::Path;

    #[test]
    fn the_hash_tells_cases_apart() {
        let o = diaphane_assets::OBJECTS[1];
        let case = |material: &str, side: u32| {
            let mesh = parse_obj((o.mesh)().to_obj().as_bytes()).unwrap();
            let scene = parse_scene(o.scene, Path::new(".")).unwrap();
            let medium = parse_material(material, Path::new(".")).unwrap();
            Case::new(o.name.to_owned(), mesh, medium, scene, Size { side, samples_per_pixel: 4 })
        };
        let first = case(o.material, 48);
        assert_eq!((first.scene.image.width, first.scene.image.height), (48, 48));
        assert_eq!(first.hash("a"), case(o.material, 48).hash("a"));
        let moved = o.material.replace("center = [0, 0, 0]", "center = [0.02, 0, 0]");
        assert_ne!(moved, o.material);
        let others = [first.hash("b"), case(o.material, 64).hash("a"), case(&moved, 48).hash("a")];
        assert!(others.iter().all(|h| *h != first.hash("a")), "{others:?}");
    }
}
