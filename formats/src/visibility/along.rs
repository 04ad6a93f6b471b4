//! Integrals of the density along one direction from many points.

use crate::medium::{Medium, RunningIntegral};
use glam::DVec3;

/// Integrals of the density along ω from one of the points.
pub(super) struct Along<'a> {
    medium: &'a Medium,
    direction: DVec3,
    points: &'a [DVec3],
    running: Option<&'a RunningIntegral>,
    /// The running integral at each point.
    at_point: Vec<f64>,
}

impl<'a> Along<'a> {
    /// With the running integral along this direction where there is one, else with the medium's own integrals.
    pub fn new(
        medium: &'a Medium,
        running: Option<&'a RunningIntegral>,
        points: &'a [DVec3],
        direction: DVec3,
    ) -> Self {
        let at_point = running.iter().flat_map(|r| points.iter().map(|p| r.at(*p))).collect();
        Self { medium, direction, points, running, at_point }
    }

    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    pub fn ior(&self) -> f64 {
        self.medium.ior()
    }

    /// ∫ρ from point `i` to `distance`, both of any sign.
    pub fn integral(&self, i: usize, distance: f64) -> f64 {
        let origin = self.points[i];
        if let Some(running) = self.running {
            return running.at(origin + self.direction * distance) - self.at_point[i];
        }
        let towards = self.direction * distance.signum();
        distance.signum() * self.medium.density_length(origin, towards, 0.0, distance.abs())
    }
}
