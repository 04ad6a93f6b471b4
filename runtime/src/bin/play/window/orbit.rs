//! A camera that turns around a point.
//!
//! position = target + distance (cos pitch (cos yaw z + sin yaw x) + sin pitch up), with z the horizontal direction
//! that the camera first stood in and x = up × z.

use diaphane_formats::scene::Camera;
use glam::DVec3;

/// Largest pitch: the view never meets `up`.
const STEEPEST: f64 = 1.55;

/// Orbit, pan and zoom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    target: DVec3,
    distance: f64,
    yaw: f64,
    pitch: f64,
    up: DVec3,
    z: DVec3,
    /// Field of view over the picture's height.
    pub fov_degrees: f64,
    nearest: f64,
}

impl Orbit {
    /// Starts at a camera. `scale` is the object's size; the camera comes no nearer to its target than a thousandth.
    pub fn new(camera: &Camera, scale: f64) -> Self {
        let back = camera.position - camera.target;
        let up = camera.up.normalize_or(DVec3::Y);
        let z = (back - up * back.dot(up)).normalize_or(up.any_orthonormal_vector());
        let sine = back.normalize_or(z).dot(up);
        Self {
            target: camera.target,
            distance: back.length(),
            yaw: 0.0,
            pitch: sine.clamp(-1.0, 1.0).asin().clamp(-STEEPEST, STEEPEST),
            up,
            z,
            fov_degrees: camera.vertical_fov_degrees,
            nearest: 1e-3 * scale,
        }
    }

    /// The camera now.
    pub fn camera(&self) -> Camera {
        Camera {
            position: self.target + self.back() * self.distance,
            target: self.target,
            up: self.up,
            vertical_fov_degrees: self.fov_degrees,
        }
    }

    /// Drags by fractions of the picture's height, to the right and down: the object follows the pointer.
    pub fn turn(&mut self, right: f64, down: f64) {
        self.yaw = (self.yaw - right * std::f64::consts::PI) % std::f64::consts::TAU;
        self.pitch = (self.pitch + down * std::f64::consts::PI).clamp(-STEEPEST, STEEPEST);
    }

    /// Shifts the picture by fractions of its height.
    pub fn pan(&mut self, right: f64, down: f64) {
        let back = self.back();
        let x = self.up.cross(back).normalize_or_zero();
        let y = back.cross(x);
        let height = 2.0 * self.distance * (0.5 * self.fov_degrees.to_radians()).tan();
        self.target += (y * down - x * right) * height;
    }

    /// Changes the distance by powers of 0.9; positive steps come nearer.
    pub fn zoom(&mut self, steps: f64) {
        self.distance = (self.distance * 0.9f64.powf(steps)).clamp(self.nearest, 1e6 * self.nearest);
    }

    fn back(&self) -> DVec3 {
        let x = self.up.cross(self.z);
        (self.z * self.yaw.cos() + x * self.yaw.sin()) * self.pitch.cos() + self.up * self.pitch.sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(0.5, 0.0, 0.0),
            up: DVec3::new(0.0, 2.0, 0.1),
            vertical_fov_degrees: 30.0,
        }
    }

    #[test]
    fn starts_at_the_camera() {
        let now = Orbit::new(&camera(), 1.0).camera();
        assert!(now.position.distance(camera().position) < 1e-12 && now.target == camera().target);
    }

    #[test]
    fn turning_keeps_the_distance_and_never_looks_along_up() {
        let mut orbit = Orbit::new(&camera(), 1.0);
        let distance = camera().position.distance(camera().target);
        for i in 0..100 {
            orbit.turn(0.3, if i < 50 { 0.2 } else { -0.2 });
            let now = orbit.camera();
            assert!((now.position.distance(now.target) - distance).abs() < 1e-9);
            assert!(now.frame(4, 3).is_ok());
        }
    }

    #[test]
    fn panning_by_a_height_shifts_the_target_by_the_picture() {
        let mut orbit = Orbit::new(&camera(), 1.0);
        let before = orbit.camera();
        orbit.pan(1.0, 0.0);
        let frame = before.frame(10, 10).unwrap();
        // The old middle now stands one picture height to the right of the new one.
        let seen = orbit.camera().target - before.position;
        let sideways = seen.dot(frame.right) / frame.right.length_squared() / seen.dot(frame.forward);
        assert!((sideways + 2.0).abs() < 1e-9, "{sideways}");
    }

    #[test]
    fn zoom_is_bounded() {
        let mut orbit = Orbit::new(&camera(), 1.0);
        orbit.zoom(1e4);
        assert!((orbit.camera().position.distance(camera().target) - 1e-3).abs() < 1e-9);
        orbit.zoom(-1e4);
        assert!(orbit.camera().position.is_finite());
    }
}
