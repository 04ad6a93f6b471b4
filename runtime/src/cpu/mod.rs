//! The CPU twin of every pass.

pub mod surface;
