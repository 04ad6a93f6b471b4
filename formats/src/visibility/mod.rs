//! Optical depth of points through a mesh: by rays through a box hierarchy ([`Accel`]), or for many points along one
//! direction at once by projecting the mesh ([`project`]).

mod accel;
mod project;
mod rays;

pub use accel::{Accel, Crossing, Nearest};
pub use project::{DepthRows, project, project_with};
pub use rays::{Depth, InsidePiece, depth_along, inside_pieces};
