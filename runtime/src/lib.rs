//! Plays baked translucent assets: a wgpu renderer and its CPU twin.
//!
//! ```text
//! Asset ─┬─ Frame (camera, lights as plain data, relative to the asset's centre)
//!        ├─ cpu: lighting -> segments -> splat -> picture      (rayon; fallback and oracle)
//!        └─ gpu: surface -> lighting -> splat -> resolve       (wgpu; one module and one shader per pass)
//! ```
//!
//! Apart from the player: `gpu::rivals` (a ray marcher and a 3D grid to compare with) and `plot` (charts as SVG).

#![warn(clippy::unwrap_used, clippy::expect_used)]

pub mod cpu;
pub mod detail;
pub mod edit;
pub mod exact;
pub mod fold;
pub mod frame;
pub mod framing;
pub mod gpu;
pub mod placement;
pub mod player;
pub mod plot;
pub mod rendered;
pub mod usable;

mod canvas;
mod error;

pub use error::{Error, Result};
pub use wgpu;
