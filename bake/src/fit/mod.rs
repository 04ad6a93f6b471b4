//! What every sample carries: optical depth over all directions as spherical harmonics, and the kernel's weight.

mod cells;
mod depths;
mod gauss_newton;
mod harmonics;
mod weights;

pub(crate) use depths::{Lit, depths};
pub(crate) use harmonics::{Harmonics, harmonics};
pub(crate) use weights::weights;
