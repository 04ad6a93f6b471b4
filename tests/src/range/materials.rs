//! The media of the table.

use super::objects::Placed;
use diaphane_formats::Result;
use diaphane_formats::medium::{Density, Grid, Layers, Medium, Noise, Shape, Shapes, Solid};
use diaphane_formats::phase::Phase;
use glam::DVec3;

/// A material whose lengths are in diagonals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Extinction at density 1 times the diagonal, per channel.
    pub extinction: [f64; 3],
    /// Single-scattering albedo per channel.
    pub albedo: [f64; 3],
    /// Phase function.
    pub phase: Phase,
    /// Index of refraction.
    pub ior: f64,
    /// Density field.
    pub field: Field,
}

/// Density fields of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// 1 everywhere.
    Uniform,
    /// Sheets of density 1 and 0.2 in turn, a tenth of the diagonal a pair.
    Layers,
    /// Fractal noise between 0.1 and 1.9.
    Noise,
    /// A ring that only absorbs, twenty times as dense as what is around it.
    Ring,
    /// A grid of 24 × 24 × 24 voxels: dense blobs in a thin surrounding.
    Grid,
}

/// Albedo of all rows that do not say otherwise.
const ALBEDO: f64 = 0.8;

impl Material {
    /// A grey homogeneous medium with this extinction times diagonal; isotropic, index matched.
    pub const fn grey(extinction: f64) -> Self {
        Self {
            extinction: [extinction; 3],
            albedo: [ALBEDO; 3],
            phase: Phase::Isotropic,
            ior: 1.0,
            field: Field::Uniform,
        }
    }

    /// What a bake sees of it: albedo and phase function enter when the asset is played.
    pub const fn baked(self) -> Self {
        Self { albedo: [ALBEDO; 3], phase: Phase::Isotropic, ..self }
    }

    /// The medium inside an object.
    ///
    /// # Errors
    /// None for the materials of the table.
    pub fn medium(&self, placed: &Placed) -> Result<Medium> {
        let extinction = DVec3::from(self.extinction) / placed.diagonal;
        let density = self.field.density(placed)?;
        Medium::new(extinction, self.albedo.into(), self.phase, self.ior, density)
    }
}

impl Field {
    fn density(self, placed: &Placed) -> Result<Density> {
        let d = placed.diagonal;
        Ok(match self {
            Self::Uniform => Density::Uniform(1.0),
            Self::Layers => Density::Layers(Layers {
                axis: DVec3::new(0.3, 1.0, 0.15).normalize(),
                period: 0.1 * d,
                densities: vec![1.0, 0.2],
            }),
            Self::Noise => {
                Density::Noise(Noise { seed: 5, frequency: 6.0 / d, octaves: 3, range: [0.1, 1.9] })
            }
            Self::Ring => Density::Shapes(Shapes {
                base: 1.0,
                shapes: vec![Shape {
                    solid: Solid::Torus {
                        center: placed.centre,
                        axis: DVec3::new(0.25, 0.3, 1.0).normalize(),
                        radius: 0.15 * d,
                        tube: 0.05 * d,
                    },
                    density: 20.0,
                    absorb: true,
                }],
            }),
            Self::Grid => Density::Grid(blobs(placed)?),
        })
    }
}

/// Waves along the three axes whose product makes blobs of density 3 in surroundings of 0.1.
fn blobs(placed: &Placed) -> Result<Grid> {
    const VOXELS: usize = 24;
    let (low, high) = placed.mesh.bounds();
    let step = (high - low) / VOXELS as f64;
    let mut values = Vec::with_capacity(VOXELS.pow(3));
    for z in 0..VOXELS {
        for y in 0..VOXELS {
            for x in 0..VOXELS {
                let p = low + step * (DVec3::new(x as f64, y as f64, z as f64) + 0.5) - placed.centre;
                let wave = (p * (20.0 / placed.diagonal)).to_array().map(f64::cos);
                let blob = (wave[0] * wave[1] + wave[1] * wave[2] + wave[2] * wave[0]).clamp(0.0, 1.0);
                values.push((0.1 + 2.9 * blob) as f32);
            }
        }
    }
    Grid::new([VOXELS; 3], low, high, values)
}
