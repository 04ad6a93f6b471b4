//! The numerical stress suite: a matrix of extreme meshes, media, lights and cameras, every cell of which is drawn and
//! checked.
//!
//! ```text
//! axes ─> plan (bodies × lights × views) ─> body (mesh, bake) ─> stage (scene) ─┬─> player, f32 ─┐
//!                                                                               ├─> twin, f64 ───┼─> check ─> table
//!                                                                               └─> energy ──────┘
//! ```
//!
//! A body is baked once and serves all its cells. What is checked in each cell, and where the bounds come from:
//!
//! - finite: every value of the picture is finite and not negative;
//! - energy: no value exceeds what the lights put in ([`energy`]);
//! - twin: every ray agrees with the same sum in double precision within a running error bound ([`twin`]);
//! - gpu: rays that have the twin's bound agree between GPU and CPU within 1e-4 of the picture's peak, or twice that
//!   bound where it is larger; a software adapter draws a part of the cells.
//!
//! A panic anywhere in a cell counts as a failure of that cell.

pub mod axes;
pub mod body;
pub mod check;
pub mod energy;
mod gpu;
pub mod plan;
pub mod run;
pub mod stage;
pub mod table;
pub mod twin;

pub use plan::{Cell, Plan};
pub use run::{Settings, run};
