//! A scene for an asset that comes without one.

use diaphane_formats::asset::Info;
use diaphane_formats::scene::{Camera, ImageSize, Light, Scene, Surface};
use glam::DVec3;

/// The whole object from 45 degrees above, 512 × 512 pixels, a warm key light from the right, a cool one from the
/// left and a white one from behind, which shows the translucency.
pub fn default_scene(info: &Info) -> Scene {
    let centre = DVec3::from(info.centre);
    let radius = 0.5 * f64::from(info.diagonal());
    let fov: f64 = 30.0;
    let view = DVec3::new(0.0, 1.0, 1.0).normalize();
    // From here every corner of the bounding box is within the picture; 8 % more leaves a margin.
    let up = view.cross(DVec3::X);
    let slope = (0.5 * fov.to_radians()).tan();
    let corner = |i: usize| DVec3::from_array([0, 1, 2].map(|k| f64::from(info.bounds[(i >> k) & 1][k])));
    let needed = |p: DVec3| p.dot(view) + p.x.abs().max(p.dot(up).abs()) / slope;
    let distance = 1.08 * (0..8).map(|i| needed(corner(i))).fold(radius, f64::max);
    let light = |direction: DVec3, colour: DVec3| {
        let away = 2.5 * radius;
        let position = centre + direction.normalize() * away;
        Light::Point { position, intensity: colour * (4.0 * away * away) }
    };
    Scene {
        camera: Camera {
            position: centre + view * distance,
            target: centre,
            up: DVec3::Y,
            vertical_fov_degrees: fov,
        },
        image: ImageSize { width: 512, height: 512, samples_per_pixel: 4 },
        surface: Surface { reflection: true, specular: 0.5, roughness: 0.3 },
        environment: None,
        exact: Vec::new(),
        lights: vec![
            light(DVec3::new(1.0, 0.6, 0.5), DVec3::new(1.0, 0.75, 0.5)),
            light(DVec3::new(-1.0, 0.3, 0.4), DVec3::new(0.3, 0.45, 0.8)),
            light(DVec3::new(0.1, 0.5, -1.0), DVec3::new(1.0, 1.0, 1.0)),
        ],
    }
}
