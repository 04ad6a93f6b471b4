//! The medium: extinction, albedo, phase function, index of refraction and a density field.

mod field;
mod grid;
mod noise;
mod sampled;
mod shapes;

pub use field::{Density, Layers};
pub use grid::Grid;
pub use noise::Noise;
pub use sampled::{RunningIntegral, SampledDensity};
pub use shapes::{Shape, Shapes, Solid};

use crate::phase::Phase;
use crate::{Error, Result};
use glam::DVec3;

/// What fills the mesh. κt(x) = ρ(x) · `extinction`, κs = Ω κt (0 where the field absorbs only).
#[derive(Debug)]
pub struct Medium {
    extinction: DVec3,
    albedo: DVec3,
    phase: Phase,
    ior: f64,
    density: Density,
}

impl Medium {
    /// A medium from its parts.
    ///
    /// # Errors
    /// Negative or non-finite extinction, albedo outside 0..1, |g| ≥ 1, `ior` below 1 or above 10.
    pub fn new(extinction: DVec3, albedo: DVec3, phase: Phase, ior: f64, density: Density) -> Result<Self> {
        if !extinction.is_finite() || extinction.min_element() < 0.0 {
            return Err(Error::invalid(format!(
                "extinction must be finite and not negative, not {extinction}"
            )));
        }
        if !albedo.is_finite() || albedo.min_element() < 0.0 || albedo.max_element() > 1.0 {
            return Err(Error::invalid(format!(
                "albedo must lie within 0..1 in every channel, not {albedo}"
            )));
        }
        let g = phase.mean_cosine();
        if !(g.abs() < 1.0) {
            return Err(Error::invalid(format!("phase: g must lie between -1 and 1 (exclusive), not {g}")));
        }
        if !(1.0..=10.0).contains(&ior) {
            return Err(Error::invalid(format!("ior must lie within 1..10, not {ior}")));
        }
        Ok(Self { extinction, albedo, phase, ior, density })
    }

    /// The same medium with another extinction (1 / mesh unit) and albedo (0..1).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_material(self, extinction: DVec3, albedo: DVec3) -> Result<Self> {
        Self::new(extinction, albedo, self.phase, self.ior, self.density)
    }

    /// Extinction at density 1, per channel, 1 / mesh unit.
    pub fn extinction(&self) -> DVec3 {
        self.extinction
    }

    /// Single-scattering albedo per channel, 0..1.
    pub fn albedo(&self) -> DVec3 {
        self.albedo
    }

    /// The phase function.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Index of refraction of the boundary, 1 when matched.
    pub fn ior(&self) -> f64 {
        self.ior
    }

    /// The density field.
    pub fn density_field(&self) -> &Density {
        &self.density
    }

    /// A hash (BLAKE3) of all that decides how light fades: everything but albedo and phase function.
    pub fn optical_hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        let mut text = |part: &dyn std::fmt::Debug| _ = hasher.update(format!("{part:?};").as_bytes());
        text(&(self.extinction, self.ior));
        match &self.density {
            Density::Grid(grid) => {
                text(&(grid.size(), grid.bounds()));
                hasher.update(bytemuck::cast_slice(grid.values()));
            }
            Density::Shapes(shapes) => {
                text(&(shapes.base, &shapes.shapes));
                for shape in &shapes.shapes {
                    if let Solid::Mesh(mesh) = &shape.solid {
                        hasher.update(&mesh.0.content_hash());
                    }
                }
            }
            plain => text(plain),
        }
        *hasher.finalize().as_bytes()
    }

    /// Mean of the channels' extinction: the reference for optical depths that stand for all channels.
    pub fn reference_extinction(&self) -> f64 {
        self.extinction.element_sum() / 3.0
    }

    /// Whether ρ is the same everywhere.
    pub fn is_homogeneous(&self) -> bool {
        matches!(self.density, Density::Uniform(_))
    }

    /// ρ of a homogeneous medium (1 otherwise).
    pub fn uniform_density(&self) -> f64 {
        if let Density::Uniform(rho) = self.density { rho } else { 1.0 }
    }

    /// Whether ∫ρ along a ray is cheap: a closed form, not a march.
    pub fn has_closed_form(&self) -> bool {
        match &self.density {
            Density::Uniform(_) | Density::Layers(_) => true,
            Density::Grid(grid) => grid.is_column(),
            Density::Noise(_) | Density::Shapes(_) => false,
        }
    }

    /// ρ at a point.
    pub fn density(&self, x: DVec3) -> f64 {
        self.density.value(x).0
    }

    /// What ρ is nowhere below.
    pub fn least_density(&self) -> f64 {
        self.density.least()
    }

    /// ρ and the part of it that scatters, at a point.
    pub fn density_and_scattering(&self, x: DVec3) -> (f64, f64) {
        self.density.value(x)
    }

    /// ∫ρ dt along `origin` + t · `direction` (unit) from `start` to `end`, whatever the mesh.
    pub fn density_length(&self, origin: DVec3, direction: DVec3, start: f64, end: f64) -> f64 {
        self.density.integral(origin, direction, start, end)
    }
}
