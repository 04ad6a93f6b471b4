//! Scenes of the cells.

use super::axes::{Lights, View};
use diaphane_formats::asset::Asset;
use diaphane_formats::directions::even_directions;
use diaphane_formats::mesh::Mesh;
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::{Camera, Environment, ImageSize, Light, Scene, Surface};
use glam::DVec3;

/// Columns and rows of most pictures.
const SIDE: u32 = 10;

/// Columns of the widest picture.
const PANORAMA: u32 = 8192;

/// Radiance of the furnace.
pub const FURNACE: f64 = 1.0;

/// Intensity of the brightest lights.
const GLARING: f64 = 1e30;

/// What scenes of a body need to know.
pub struct Stage {
    centre: DVec3,
    diagonal: f64,
    /// A point of the surface and the outward normal there.
    surface: (DVec3, DVec3),
    /// A sample's centre.
    sample: DVec3,
    /// Another one, deepest under the surface.
    inner: DVec3,
}

impl Stage {
    /// Of a baked body.
    pub fn new(mesh: &Mesh, asset: &Asset) -> Self {
        let centre = DVec3::from(asset.info.centre);
        let largest = (0..mesh.triangles.len())
            .max_by(|a, b| mesh.area_normal(*a).length().total_cmp(&mesh.area_normal(*b).length()))
            .unwrap_or(0);
        let corners = mesh.corners(largest);
        let normal = mesh.area_normal(largest).normalize_or(DVec3::Y);
        let count = asset.samples.len();
        let sample = |i: usize| centre + asset.samples.position(i.min(count.max(1) - 1)).as_dvec3();
        let nearest =
            |p: DVec3| mesh.positions.iter().map(|q| q.distance_squared(p)).fold(f64::MAX, f64::min);
        let step = (count / 256).max(1);
        let deepest = (0..count)
            .step_by(step)
            .max_by(|a, b| nearest(sample(*a)).total_cmp(&nearest(sample(*b))))
            .unwrap_or(0);
        Self {
            centre,
            diagonal: mesh.diagonal(),
            surface: ((corners[0] + corners[1] + corners[2]) / 3.0, normal),
            sample: if count == 0 { centre } else { sample(count / 2) },
            inner: if count == 0 { centre } else { sample(deepest) + DVec3::splat(1e-3 * mesh.diagonal()) },
        }
    }

    /// The scene of a cell.
    pub fn scene(&self, lights: Lights, view: View) -> Scene {
        let (width, height) = match view {
            View::OnePixel => (1, 1),
            View::Panorama => (PANORAMA, 1),
            _ => (SIDE, SIDE),
        };
        let mut scene = Scene {
            camera: self.camera(view),
            image: ImageSize { width, height, samples_per_pixel: 1 },
            surface: Surface { reflection: false, specular: 0.5, roughness: 0.3 },
            environment: None,
            lights: Vec::new(),
            exact: Vec::new(),
        };
        self.light(lights, &mut scene);
        scene
    }

    fn camera(&self, view: View) -> Camera {
        let towards = DVec3::new(0.4, 0.45, 0.8).normalize();
        let at = |distance: f64| self.centre + towards * (distance * self.diagonal);
        let aside = DVec3::new(0.8, 0.2, 0.5) * self.diagonal;
        let (position, target, vertical_fov_degrees) = match view {
            View::Whole | View::OnePixel => (at(2.0), self.centre, 26.0),
            View::OnSurface => (self.surface.0, self.surface.0 - self.surface.1 * self.diagonal, 60.0),
            View::Inside => (self.inner, self.inner + aside, 70.0),
            View::AtSample => (self.sample, self.sample + aside, 70.0),
            View::Far => (at(1e3), self.centre, 0.05),
            View::Away => (at(2.0), self.centre + towards * (9.0 * self.diagonal), 40.0),
            // One row: a field of view that leaves the picture's width about as wide as the object.
            View::Panorama => (at(2.0), self.centre, 0.005),
            View::Narrow => (at(2.0), self.centre, 0.1),
            View::Wide => (at(2.0), self.centre, 179.0),
        };
        let along = (target - position).normalize_or_zero();
        let up = if along.y.abs() < 0.999 { DVec3::Y } else { DVec3::X };
        Camera { position, target, up, vertical_fov_degrees }
    }

    fn light(&self, lights: Lights, scene: &mut Scene) {
        let side = DVec3::new(0.9, 0.35, -0.1).normalize();
        let away = |distance: f64| self.centre + side * (distance * self.diagonal);
        // As bright at the object's centre as a light of intensity 3 W/sr at distance 1.
        let point = |position: DVec3, distance: f64| Light::Point {
            position,
            intensity: DVec3::splat(3.0 * (distance * self.diagonal).powi(2)),
        };
        let glaring = |position: DVec3| Light::Point { position, intensity: DVec3::splat(GLARING) };
        let sun = |towards: DVec3, irradiance: f64| Light::Directional {
            direction: -towards,
            irradiance: DVec3::splat(irradiance),
        };
        match lights {
            Lights::Point => scene.lights.push(point(away(1.5), 1.5)),
            Lights::Directional => scene.lights.push(sun(side, 3.0)),
            Lights::Spot => scene.lights.push(Light::Spot {
                position: away(1.5),
                direction: -side,
                intensity: DVec3::splat(3.0 * (1.5 * self.diagonal).powi(2)),
                cos_inner: 5f64.to_radians().cos(),
                cos_outer: 12f64.to_radians().cos(),
            }),
            Lights::OnSurface => scene.lights.push(point(self.surface.0, 0.3)),
            Lights::Inside => scene.lights.push(point(self.inner, 0.3)),
            Lights::AtSample => scene.lights.push(point(self.sample, 0.3)),
            Lights::Distant => scene.lights.push(point(away(1e6), 1e6)),
            Lights::Furnace => {
                let mut picture = Picture::new(64, 32);
                picture.pixels.fill([FURNACE as f32; 3]);
                scene.environment = Some(Environment { picture, scale: 1.0 });
            }
            Lights::Forty => scene.lights.extend(even_directions(40, 3).into_iter().map(|d| sun(d, 0.3))),
            Lights::Dark => {
                scene.lights.push(Light::Point { position: away(1.5), intensity: DVec3::ZERO });
            }
            Lights::Glaring => scene.lights.push(glaring(away(1.5))),
            Lights::GlaringInside => scene.lights.push(glaring(self.inner)),
        }
    }
}
