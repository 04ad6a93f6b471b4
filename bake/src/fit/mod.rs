//! What every sample carries: optical depth over all directions as spherical harmonics, and the kernel's weight.

mod boundary;
mod cells;
mod decoded;
mod depths;
mod harmonics;
mod ladder;
mod least_squares;
mod levels;
mod product;
mod rounding;
mod weights;

pub(crate) use boundary::boundary_order;
pub(crate) use cells::{Cells, buried, nearest};
pub(crate) use depths::{Lit, Task, depths, method};
pub(crate) use harmonics::{Fits, Light, fits, quantised};
pub(crate) use ladder::{FirstFits, first_fits, first_order};
pub(crate) use weights::weights;
