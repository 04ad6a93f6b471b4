//! The inside pieces of a camera ray.

use crate::rendered::MAX_PIECES;
use diaphane_formats::visibility::{Accel, Crossing, InsidePiece, inside_pieces};
use glam::Vec3;

/// One inside piece as the splat pass needs it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Piece {
    /// Where it starts, mesh units along the ray (0 when the camera is inside).
    pub start: f32,
    /// Where it ends.
    pub end: f32,
    /// Product of the Fresnel transmittances of all crossings between the camera and this piece's inside, 0..1.
    pub boundary: f32,
}

/// The inside pieces of one ray, in order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segments {
    /// The first `count` are valid.
    pub pieces: [Piece; MAX_PIECES],
    /// Number of pieces.
    pub count: usize,
    /// Pieces beyond the last one kept.
    pub dropped: u32,
    /// Triangle of the first entry; `None` when the ray misses or starts inside.
    pub entry: Option<u32>,
}

impl Segments {
    /// The valid pieces.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces[..self.count]
    }
}

/// Working memory of a thread.
#[derive(Default)]
pub struct Scratch {
    crossings: Vec<Crossing>,
    pieces: Vec<InsidePiece>,
}

/// Pieces of the ray `origin` + t · `direction` (unit). Pieces too short for single precision keep their place with
/// equal ends and emit nothing.
pub fn trace(accel: &Accel, ior: f64, origin: Vec3, direction: Vec3, scratch: &mut Scratch) -> Segments {
    let Scratch { crossings, pieces } = scratch;
    inside_pieces(accel, ior, origin.as_dvec3(), direction.as_dvec3(), crossings, pieces);
    let mut segments = Segments::default();
    let mut passed = 1.0;
    for piece in pieces.iter().take(MAX_PIECES) {
        let inside = passed * piece.boundary[0];
        segments.pieces[segments.count] =
            Piece { start: piece.start as f32, end: piece.end as f32, boundary: inside as f32 };
        segments.count += 1;
        passed = inside * piece.boundary[1];
    }
    segments.dropped = pieces.len().saturating_sub(MAX_PIECES) as u32;
    segments.entry = pieces.first().map(|p| p.entry).filter(|&t| t != u32::MAX);
    segments
}
