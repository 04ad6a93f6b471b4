//! What a backend hands back for one frame: the same for both.

use crate::exact::ExactReport;
use crate::fold::LightCounts;
use diaphane_formats::picture::Picture;
use serde::Serialize;

/// Most inside pieces of one ray that are drawn; further ones are counted.
pub const MAX_PIECES: usize = 4;

/// A frame as drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// Linear radiance; the coverage is the fraction of each pixel's rays that hit the mesh, 0..1.
    pub picture: Picture,
    /// What was counted on the way.
    pub counters: Counters,
    /// What became of the lights.
    pub lights: LightCounts,
    /// Exact depths: what they cost and what they are good for.
    pub exact: ExactReport,
    /// Name and milliseconds of every pass that ran, in order; passes that were reused are absent.
    pub passes: Vec<(&'static str, f64)>,
}

/// Sums over all sub-pixel rays of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counters {
    /// Sub-pixel rays.
    pub rays: u64,
    /// Rays that run through the inside of the mesh.
    pub rays_hit: u64,
    /// Inside pieces beyond the fourth of their ray: not drawn.
    pub pieces_dropped: u64,
    /// Kernels that contributed, summed over rays and pieces.
    pub splats: u64,
    /// Rays that hit the mesh but no kernel: they are black.
    pub uncovered: u64,
    /// Samples that can contribute to a picture (positive weight).
    pub samples_drawn: u64,
}

impl Counters {
    /// Mean number of kernels over the rays that hit the mesh; 0 when none does.
    pub fn splats_per_ray(&self) -> f64 {
        if self.rays_hit == 0 { 0.0 } else { self.splats as f64 / self.rays_hit as f64 }
    }

    /// The sum of two counts of rays; `samples_drawn` is kept, it belongs to the frame.
    pub fn merge(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            rays_hit: self.rays_hit + other.rays_hit,
            pieces_dropped: self.pieces_dropped + other.pieces_dropped,
            splats: self.splats + other.splats,
            uncovered: self.uncovered + other.uncovered,
            samples_drawn: self.samples_drawn.max(other.samples_drawn),
        }
    }
}

/// What one sub-pixel ray saw, for comparing backends with each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayResult {
    /// Start and end of the inside pieces, mesh units along the ray; the first `count` are valid.
    pub pieces: [(f32, f32); MAX_PIECES],
    /// Product of the Fresnel transmittances in front of each piece: where the boundary refracts, a ray through an
    /// edge of the mesh depends on which of the two faces it is said to meet.
    pub boundary: [f32; MAX_PIECES],
    /// Number of pieces, at most [`MAX_PIECES`].
    pub count: u32,
    /// Radiance of the samples, without surface reflection.
    pub radiance: [f32; 3],
}
