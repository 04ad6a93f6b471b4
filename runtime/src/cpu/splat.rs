//! Sums the samples along a ray's inside pieces.
//!
//! Each piece is normalised by itself ([`Hits::piece_radiance`]) and attenuated by what lies before it:
//! L = Σ_k B_k Π_{j<k} T_j L_k, with B_k the boundary factor of [`super::segments`] and T_j the transmittance of
//! piece j.

use super::segments::Segments;
use diaphane_formats::asset::DensityGrid;
use diaphane_formats::hits::Hits;
use diaphane_formats::reconstruct::{Along, Profile};
use glam::Vec3;

/// The medium along camera rays.
#[derive(Clone, Copy, Debug)]
pub struct RayMedium<'a> {
    /// κ per channel: of the homogeneous medium, or at density 1 when there is a grid.
    pub extinction: Vec3,
    /// The density field.
    pub density: Option<&'a DensityGrid>,
}

impl RayMedium<'_> {
    /// How the medium attenuates along `start..end` of a ray.
    pub fn along(&self, origin: Vec3, direction: Vec3, start: f32, end: f32) -> Along {
        match self.density {
            None => Along::Uniform(self.extinction),
            Some(grid) => {
                let profile = Profile::march(grid, origin, direction, start, end);
                Along::Profile(self.extinction, Box::new(profile))
            }
        }
    }
}

/// Radiance of a ray's samples, given the kernels that its line meets, and the number that contributed.
pub fn ray(
    hits: &Hits,
    medium: RayMedium,
    origin: Vec3,
    direction: Vec3,
    segments: &Segments,
) -> (Vec3, u32) {
    let (mut radiance, mut splats, mut before) = (Vec3::ZERO, 0, Vec3::ONE);
    for piece in segments.pieces().iter().filter(|p| p.end > p.start) {
        let along = medium.along(origin, direction, piece.start, piece.end);
        let sum = hits.piece_radiance(piece.start, piece.end, &along);
        radiance += before * piece.boundary * sum.radiance;
        splats += sum.splats;
        before *= along.transmittance(piece.start, piece.end);
    }
    (radiance, splats)
}
