//! One sample of the single-scattering formula of a pixel:
//!
//! L = ∫ exp(-τ_view) κs Σ_l p(cos_l) E_l ψ_l dt, with 1 - F at every crossing when the boundary is not matched.
//!
//! A sample is one camera ray, one position on it, and a shadow ray to every light (and one to the environment). All
//! in f64. Checked against the closed form of a homogeneous ball and against pictures of another renderer.

use super::along::{self, Marching, Position};
use super::density::Field;
use super::environment::Sky;
use super::rays::{Scratch, trace};
use super::sequence::DIMENSIONS;
use diaphane_formats::medium::Medium;
use diaphane_formats::scene::{Light, RayFrame, Scene};
use diaphane_formats::visibility::Accel;
use diaphane_formats::{Result, mesh::Mesh};
use glam::DVec3;

/// A light's distance is clamped from below at this fraction of the mesh's diagonal.
const LEAST_DISTANCE: f64 = 1e-3;

/// Everything that a sample depends on.
pub struct Integrator<'a> {
    accel: &'a Accel,
    medium: &'a Medium,
    field: Field<'a>,
    lights: &'a [Light],
    sky: Option<Sky>,
    frame: RayFrame,
    size: [f64; 2],
    least: f64,
}

/// Reusable memory of one worker.
#[derive(Default)]
pub struct Worker {
    view: Scratch,
    shadow: Scratch,
    march: Marching,
    /// Rays traced so far.
    pub rays: u64,
}

impl<'a> Integrator<'a> {
    /// Prepares a scene.
    ///
    /// # Errors
    /// A camera that makes no rays.
    pub fn new(mesh: &Mesh, accel: &'a Accel, medium: &'a Medium, scene: &'a Scene) -> Result<Self> {
        Ok(Self {
            accel,
            medium,
            field: Field::new(medium.density_field()),
            lights: &scene.lights,
            sky: scene.environment.as_ref().and_then(Sky::new),
            frame: scene.ray_frame()?,
            size: [scene.image.width.into(), scene.image.height.into()],
            least: LEAST_DISTANCE * mesh.diagonal(),
        })
    }

    /// Whether any light can reach the object.
    pub fn is_lit(&self) -> bool {
        self.sky.is_some() || !self.lights.is_empty()
    }

    /// Whether the ray through column `x`, row `y` (fractional) passes through the object.
    pub fn hits(&self, x: f64, y: f64, worker: &mut Worker) -> bool {
        let direction = self.frame.direction(x, y, self.size[0], self.size[1]);
        worker.rays += 1;
        trace(self.accel, 1.0, self.frame.origin, direction, f64::INFINITY, &mut worker.view);
        !worker.view.stretches.is_empty()
    }

    /// One estimate of the radiance of pixel (`column`, `row`), averaged over its area, from a point of the unit cube.
    pub fn sample(&self, column: usize, row: usize, p: [f64; DIMENSIONS], worker: &mut Worker) -> DVec3 {
        let (x, y) = (column as f64 + p[0], row as f64 + p[1]);
        let origin = self.frame.origin;
        let direction = self.frame.direction(x, y, self.size[0], self.size[1]);
        worker.rays += 1;
        trace(self.accel, self.medium.ior(), origin, direction, f64::INFINITY, &mut worker.view);
        if worker.view.stretches.is_empty() {
            return DVec3::ZERO;
        }
        let kappa = self.medium.extinction();
        let found = if self.medium.is_homogeneous() {
            let rho = self.medium.uniform_density();
            along::in_homogeneous(kappa, rho, &worker.view.stretches, p[2])
        } else {
            along::in_field((kappa, &self.field), origin, direction, &worker.view, &mut worker.march, p[2])
        };
        let Some(Position { t, density, view, boundary }) = found else {
            return DVec3::ZERO;
        };
        let at = origin + direction * t;
        let scattering = kappa * self.medium.albedo() * self.medium.density_and_scattering(at).1;
        if scattering == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let mut light = DVec3::ZERO;
        for l in self.lights {
            let (towards, distance, irradiance) = l.at(at, self.least);
            light += self.incoming(at, direction, towards, distance, irradiance, worker);
        }
        if let Some(sky) = &self.sky {
            let s = sky.sample([p[3], p[4]]);
            light += self.incoming(at, direction, s.direction, f64::INFINITY, s.irradiance, worker);
        }
        (-kappa * view).exp() * scattering * light * (boundary / density)
    }

    /// p E ψ of one light.
    fn incoming(
        &self,
        at: DVec3,
        view: DVec3,
        towards: DVec3,
        distance: f64,
        irradiance: DVec3,
        worker: &mut Worker,
    ) -> DVec3 {
        if irradiance == DVec3::ZERO {
            return DVec3::ZERO;
        }
        worker.rays += 1;
        trace(self.accel, self.medium.ior(), at, towards, distance, &mut worker.shadow);
        let mut depth = 0.0;
        for s in &worker.shadow.stretches {
            let memory = (&mut worker.march.cuts, &mut worker.march.crossings);
            depth += self.field.length(at, towards, s.start, s.end, memory);
        }
        let boundary = worker.shadow.stretches.last().map_or(1.0, |s| s.reached * s.leaving);
        // Light travels along -towards, the camera lies along -view.
        let phase = self.medium.phase().value(towards.dot(view));
        irradiance * (-self.medium.extinction() * depth).exp() * (phase * boundary)
    }
}
