//! What a backend hands back for one frame: the same for both.

use crate::exact::ExactReport;
use crate::fold::LightCounts;
use diaphane_formats::picture::Picture;
use serde::Serialize;
use std::sync::Arc;

/// Most inside pieces of one ray that are drawn; further ones are counted.
pub const MAX_PIECES: usize = 4;

/// A frame as drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// Linear radiance; the coverage is the fraction of each pixel's rays that hit the mesh, 0..1. Shared with the renderer, which
    /// draws on it again once nobody else holds it, and with frames that are the same.
    pub picture: Arc<Picture>,
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
    /// Of these, the ones too far beside the object's bounding box to be looked at.
    pub rays_skipped: u64,
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
    /// What of the object was worth drawing.
    pub census: Census,
}

/// Who is in the picture, summed over views. A view is one ray of every pixel of the picture, or of a part of it where it is drawn
/// in parts. Every sample belongs to one of six classes in every view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Census {
    /// Views.
    pub views: u64,
    /// Samples without weight.
    pub samples_dark: u64,
    /// Samples whose kernels are behind the camera or beside the picture.
    pub samples_out_of_view: u64,
    /// Samples whose kernels are so small that they lie between the rays.
    pub samples_between_rays: u64,
    /// Samples whose kernels no ray meets inside the object, as far as squares of 8 × 8 pixels tell: beside its outline, or cut off
    /// by it.
    pub samples_apart: u64,
    /// Samples that lie 16 optical depths or more behind where rays enter: none of their light is seen.
    pub samples_hidden: u64,
    /// All other samples.
    pub samples_shown: u64,
    /// Batches of 64 samples, summed over the pieces that a view has; only where kernels are drawn by quads.
    pub batches: u64,
    /// Of these, the ones with a sample that the piece may show: only they are drawn.
    pub batches_drawn: u64,
    /// Squares of 16 × 16 pixels.
    pub tiles: u64,
    /// Of these, the ones where no ray is inside the object: nothing is gathered there.
    pub tiles_empty: u64,
    /// Pieces of rays, [`MAX_PIECES`] a view.
    pub pieces: u64,
    /// Of these, the ones that no ray has: nothing is done for them.
    pub pieces_empty: u64,
}

impl Census {
    /// Counts views of a picture of `size` pixels: samples by class in the order above, then for each piece in how many squares
    /// of 16 × 16 pixels it is, and in how many views.
    pub fn add(
        &mut self,
        views: u64,
        size: [u32; 2],
        samples: [u64; 6],
        tiles: [u64; MAX_PIECES],
        pieces: [u64; MAX_PIECES],
    ) {
        let [dark, out_of_view, between_rays, apart, hidden, shown] = samples;
        self.views += views;
        self.samples_dark += dark;
        self.samples_out_of_view += out_of_view;
        self.samples_between_rays += between_rays;
        self.samples_apart += apart;
        self.samples_hidden += hidden;
        self.samples_shown += shown;
        let all_tiles = views * size.map(|n| u64::from(n.div_ceil(16))).iter().product::<u64>();
        self.tiles += all_tiles;
        self.tiles_empty += all_tiles.saturating_sub(tiles[0]);
        let all_pieces = views * MAX_PIECES as u64;
        self.pieces += all_pieces;
        self.pieces_empty += all_pieces.saturating_sub(pieces.iter().sum());
    }
}

impl Counters {
    /// Mean number of kernels over the rays that hit the mesh; 0 when none does.
    pub fn splats_per_ray(&self) -> f64 {
        if self.rays_hit == 0 { 0.0 } else { self.splats as f64 / self.rays_hit as f64 }
    }

    /// The sum of two counts of rays; `samples_drawn` and `census` are kept, they belong to the frame.
    pub fn merge(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            rays_skipped: self.rays_skipped + other.rays_skipped,
            rays_hit: self.rays_hit + other.rays_hit,
            pieces_dropped: self.pieces_dropped + other.pieces_dropped,
            splats: self.splats + other.splats,
            uncovered: self.uncovered + other.uncovered,
            samples_drawn: self.samples_drawn.max(other.samples_drawn),
            census: self.census,
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
