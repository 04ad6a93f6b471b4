//! Optical depth of points through a mesh: by rays through a box hierarchy ([`Accel`]), or for many points along one
//! direction at once by projecting the mesh ([`project`]).

mod accel;
mod along;
mod project;
mod rays;
mod trace;

pub use accel::{Accel, Crossing, Nearest};
pub use project::{project, project_with};
pub use rays::{Depth, InsidePiece, depth_along, inside_pieces};
pub use trace::trace;

/// Depths of all points along one direction.
#[derive(Clone, Debug)]
pub struct DepthRows {
    /// m of each point along ω.
    pub forward: Vec<f32>,
    /// m of each point along -ω.
    pub backward: Vec<f32>,
    /// Fresnel transmittance products along ω and -ω; empty when the boundary is index matched.
    pub boundary: [Vec<f32>; 2],
    /// Winding number seen along ω and along -ω: 1 for points inside a clean mesh.
    pub winding: [Vec<i8>; 2],
}

impl DepthRows {
    /// m of each point along ω (side 0) or -ω (side 1).
    pub fn lengths(&self, side: usize) -> &[f32] {
        if side == 0 { &self.forward } else { &self.backward }
    }

    /// No rows yet, with room for so many points; no boundary where it is index matched.
    fn with_capacity(points: usize, matched: bool) -> Self {
        let through = if matched { 0 } else { points };
        Self {
            forward: Vec::with_capacity(points),
            backward: Vec::with_capacity(points),
            boundary: [Vec::with_capacity(through), Vec::with_capacity(through)],
            winding: [Vec::with_capacity(points), Vec::with_capacity(points)],
        }
    }
}
