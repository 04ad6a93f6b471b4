//! A scene with any number of lights: its own first, further ones around the object, the sum of their light constant.
//!
//! Light is counted as irradiance at the centre of the object's bounding box without any medium (a light that misses
//! the centre, by its cone, counts nothing). Further lights are points at 1.5 diagonals from the centre, in seeded
//! uniform directions, each as bright as the mean of the scene's own. All intensities are then scaled by one factor, so
//! that pictures with 1, 8 and 64 lights are about equally bright. An environment is left out: it is no light to count.

use diaphane_formats::directions::{hash, random_rotation};
use diaphane_formats::mesh::Mesh;
use diaphane_formats::scene::{Light, Scene};
use glam::DVec3;

/// Distance of further lights from the centre, diagonals.
const DISTANCE: f64 = 1.5;

/// `scene` with `count` lights.
pub fn with_lights(scene: &Scene, mesh: &Mesh, count: usize, seed: u64) -> Scene {
    let (low, high) = mesh.bounds();
    let centre = 0.5 * (low + high);
    let distance = DISTANCE * mesh.diagonal();
    let least = 1e-3 * mesh.diagonal();
    let sum_of = |lights: &[Light]| -> DVec3 { lights.iter().map(|l| l.at(centre, least).2).sum() };
    let whole = sum_of(&scene.lights);
    // A scene without light of its own gets white light of irradiance 1.
    let whole = if whole.element_sum() > 0.0 { whole } else { DVec3::ONE };
    let each = whole / scene.lights.len().max(1) as f64;
    let mut lights: Vec<Light> = scene.lights.iter().take(count).copied().collect();
    for i in lights.len()..count {
        let direction = random_rotation(hash(seed, i as u64)) * DVec3::Z;
        lights.push(Light::Point {
            position: centre + direction * distance,
            intensity: each * distance * distance,
        });
    }
    let now = sum_of(&lights).element_sum();
    let factor = if now > 0.0 { whole.element_sum() / now } else { 1.0 };
    for light in &mut lights {
        match light {
            Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity *= factor,
            Light::Directional { irradiance, .. } => *irradiance *= factor,
        }
    }
    Scene { lights, exact: Vec::new(), environment: None, ..scene.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::mesh::parse_obj;
    use diaphane_formats::scene::parse_scene;
    use std::path::Path;

    #[test]
    fn the_light_stays_the_same() {
        let (mesh, _) = parse_obj(diaphane_assets::shapes::icosphere(1.0, 1).to_obj().as_bytes()).unwrap();
        for object in diaphane_assets::OBJECTS {
            let scene = parse_scene(object.scene, Path::new(".")).unwrap();
            let sum =
                |s: &Scene| -> f64 { s.lights.iter().map(|l| l.at(DVec3::ZERO, 1e-3).2.element_sum()).sum() };
            for count in [1, 3, 8, 64] {
                let s = with_lights(&scene, &mesh, count, 1);
                assert_eq!(s.lights.len(), count);
                assert!((sum(&s) / sum(&scene) - 1.0).abs() < 1e-9, "{} {count}", object.name);
            }
            let far = with_lights(&scene, &mesh, 64, 1).lights[40].position().unwrap().length();
            assert!((far - 1.5 * mesh.diagonal()).abs() < 1e-6, "{far}");
        }
    }
}
