//! What lights the rows.

use super::objects::Placed;
use super::views::TOWARDS_CAMERA;
use diaphane_formats::directions::even_directions;
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::{Environment, Light, Scene};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Lights around an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lights {
    /// One point light, from the camera's right.
    Side,
    /// One point light, from above the camera.
    Front,
    /// One point light behind the object.
    Back,
    /// One point light on the right at this many diagonals from the surface.
    At(f64),
    /// This many coloured point lights all around.
    Many(usize),
    /// One spot from the right whose cone covers a part of the object.
    Spot,
    /// One directional light from the right.
    Directional,
    /// A small synthetic sky: dark ground, blue above, a wide warm light.
    Environment,
}

/// Diagonals from the object's middle to the lights that are neither near nor far.
const DISTANCE: f64 = 1.5;

/// From the object's middle to the light on the right.
const TOWARDS_RIGHT: DVec3 = DVec3::new(0.9, 0.35, -0.1);

/// The same seen from the surface, for lights at a given distance from it: out of every bounding box.
const STRAIGHT_RIGHT: DVec3 = DVec3::X;

/// Irradiance that every single light gives the object's middle.
const IRRADIANCE: f64 = 3.0;

impl Lights {
    /// Puts the lights, and the environment, into a scene.
    pub fn place(self, placed: &Placed, scene: &mut Scene) {
        let towards = TOWARDS_CAMERA.normalize();
        match self {
            Self::Side => scene.lights.push(far(placed, TOWARDS_RIGHT.normalize(), DVec3::ONE)),
            Self::Front => {
                scene.lights.push(far(placed, (towards + DVec3::Y * 0.3).normalize(), DVec3::ONE));
            }
            Self::Back => {
                let behind = (DVec3::Y * 0.35 - towards).normalize();
                scene.lights.push(far(placed, behind, DVec3::ONE));
            }
            Self::At(gap) => {
                let position = placed.beside(STRAIGHT_RIGHT, gap);
                scene.lights.push(point(placed, position, DVec3::ONE));
            }
            Self::Many(count) => {
                let share = 1.0 / (count as f64).sqrt();
                let lights = even_directions(count, 3).into_iter().enumerate();
                scene.lights.extend(lights.map(|(i, d)| far(placed, d, tint(i) * share)));
            }
            Self::Spot => {
                let towards = TOWARDS_RIGHT.normalize();
                scene.lights.push(Light::Spot {
                    position: placed.at(towards * DISTANCE),
                    direction: -towards,
                    intensity: DVec3::splat(IRRADIANCE * (DISTANCE * placed.diagonal).powi(2)),
                    cos_inner: 5f64.to_radians().cos(),
                    cos_outer: 12f64.to_radians().cos(),
                });
            }
            Self::Directional => scene.lights.push(Light::Directional {
                direction: -TOWARDS_RIGHT.normalize(),
                irradiance: DVec3::splat(IRRADIANCE),
            }),
            Self::Environment => scene.environment = Some(Environment { picture: sky(), scale: 1.0 }),
        }
    }
}

fn far(placed: &Placed, towards: DVec3, colour: DVec3) -> Light {
    point(placed, placed.at(towards * DISTANCE), colour)
}

/// A point light that gives the object's middle its share of irradiance.
fn point(placed: &Placed, position: DVec3, colour: DVec3) -> Light {
    let intensity = colour * (IRRADIANCE * position.distance_squared(placed.centre));
    Light::Point { position, intensity }
}

/// White, warm, cool and green in turn.
fn tint(i: usize) -> DVec3 {
    [DVec3::ONE, DVec3::new(1.0, 0.6, 0.3), DVec3::new(0.3, 0.6, 1.0), DVec3::new(0.5, 1.0, 0.5)][i % 4]
}

/// A latitude-longitude picture of 48 × 24 pixels.
fn sky() -> Picture {
    let mut picture = Picture::new(48, 24);
    let sun = TOWARDS_RIGHT.normalize();
    for row in 0..picture.height {
        let theta = PI * (row as f64 + 0.5) / picture.height as f64;
        for column in 0..picture.width {
            let phi = TAU * ((column as f64 + 0.5) / picture.width as f64 - 0.5);
            let d = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            let above = if d.y > 0.0 { DVec3::new(0.15, 0.25, 0.45) } else { DVec3::splat(0.05) };
            let warm = DVec3::new(3.0, 2.2, 1.4) * (12.0 * (d.dot(sun) - 1.0)).exp();
            picture.pixels[row * picture.width + column] = (above + warm).as_vec3().to_array();
        }
    }
    picture
}
