//! Cameras and lights around the objects, whose centre is at (10, -20, 5).

use diaphane_formats::directions::even_directions;
use diaphane_formats::scene::{Camera, ImageSize, Light, Scene, Surface};
use glam::DVec3;

const CENTRE: DVec3 = DVec3::new(10.0, -20.0, 5.0);

pub fn outside() -> Camera {
    Camera {
        position: CENTRE + DVec3::new(0.7, 1.1, 3.4),
        target: CENTRE,
        up: DVec3::Y,
        vertical_fov_degrees: 36.0,
    }
}

/// The same from far away.
pub fn far() -> Camera {
    Camera { position: CENTRE + 4.0 * DVec3::new(0.7, 1.1, 3.4), vertical_fov_degrees: 9.0, ..outside() }
}

/// Looks along the plane of the torus.
pub fn level() -> Camera {
    Camera { position: CENTRE + DVec3::new(0.4, 0.2, 3.0), ..outside() }
}

pub fn inside() -> Camera {
    Camera {
        position: CENTRE + DVec3::new(0.2, -0.3, 0.4),
        target: CENTRE + DVec3::new(0.4, 0.0, -0.4),
        up: DVec3::Y,
        vertical_fov_degrees: 70.0,
    }
}

/// One light of every kind.
pub fn scene(camera: Camera) -> Scene {
    Scene {
        camera,
        image: ImageSize { width: 112, height: 96, samples_per_pixel: 1 },
        surface: Surface { reflection: false, specular: 0.5, roughness: 0.3 },
        environment: None,
        exact: Vec::new(),
        lights: vec![
            Light::Point {
                position: CENTRE + DVec3::new(2.2, 1.2, 1.0),
                intensity: DVec3::new(30.0, 10.0, 6.0),
            },
            Light::Directional {
                direction: DVec3::new(0.6, -0.8, 0.0),
                irradiance: DVec3::new(0.5, 1.0, 2.0),
            },
            Light::Spot {
                position: CENTRE + DVec3::new(-1.0, 2.5, 2.0),
                direction: DVec3::new(1.0, -2.5, -2.0).normalize(),
                intensity: DVec3::new(20.0, 20.0, 20.0),
                cos_inner: 8f64.to_radians().cos(),
                cos_outer: 14f64.to_radians().cos(),
            },
        ],
    }
}

/// Adds a light where only exact depths are right.
pub fn put_light_inside(scene: &mut Scene) {
    let position = CENTRE + DVec3::new(0.1, 0.3, 0.2);
    scene.lights.push(Light::Point { position, intensity: DVec3::new(0.3, 0.2, 0.1) });
}

/// Point lights in even directions, close enough for each to differ.
pub fn crowd(count: usize) -> Vec<Light> {
    let light = |(k, direction): (usize, DVec3)| Light::Point {
        position: CENTRE + 3.0 * direction,
        intensity: DVec3::new((k % 7) as f64, 5.0 + 4.0 * direction.y, 3.0) * (3.0 / count as f64),
    };
    even_directions(count, 5).into_iter().enumerate().map(light).collect()
}

/// Adds directional lights in even directions.
pub fn add_suns(scene: &mut Scene, count: usize) {
    for (k, direction) in even_directions(count, 3).into_iter().enumerate() {
        let irradiance = DVec3::new(0.02 * k as f64, 0.5 + 0.4 * direction.y, 0.3) / count as f64;
        scene.lights.push(Light::Directional { direction, irradiance });
    }
}
