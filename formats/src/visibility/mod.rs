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
#[derive(Clone, Debug, Default)]
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

    /// Adds the depths of more points.
    fn append(&mut self, more: Self) {
        self.forward.extend(more.forward);
        self.backward.extend(more.backward);
        self.boundary.iter_mut().zip(more.boundary).for_each(|(own, more)| own.extend(more));
        self.winding.iter_mut().zip(more.winding).for_each(|(own, more)| own.extend(more));
    }
}
