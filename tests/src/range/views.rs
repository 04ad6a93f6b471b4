//! Where the rows look from.

use super::objects::Placed;
use diaphane_formats::scene::Camera;
use glam::DVec3;

/// A place for the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From outside, the object fills the picture.
    Whole,
    /// Outside, a twentieth of a diagonal from the surface: the object is far larger than the picture.
    Near,
    /// Within the medium.
    Inside,
}

/// From the object's middle towards the camera.
pub const TOWARDS_CAMERA: DVec3 = DVec3::new(0.40, 0.45, 0.80);

/// Diagonals from the object's middle to the camera outside.
const DISTANCE: f64 = 2.2;

/// Diagonals between surface and camera when near.
const NEAR: f64 = 0.05;

impl View {
    /// The camera.
    pub fn camera(self, placed: &Placed) -> Camera {
        let towards = TOWARDS_CAMERA.normalize();
        let (position, target, vertical_fov_degrees) = match self {
            Self::Whole => (placed.at(towards * DISTANCE), placed.centre, 21.0),
            Self::Near => {
                let eye = placed.beside(towards, NEAR);
                (eye, eye - towards, 50.0)
            }
            Self::Inside => {
                let eye = placed.at(placed.object.inner_point());
                (eye, eye + DVec3::new(0.8, 0.2, 0.5), 70.0)
            }
        };
        Camera { position, target, up: DVec3::Y, vertical_fov_degrees }
    }
}
