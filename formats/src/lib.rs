//! The shared ground of diaphane: the files it reads and writes, and the mathematics that gives them meaning.
//!
//! Symbols used throughout (see also the crates `diaphane-bake` and `diaphane-runtime`, which never meet):
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | κt | extinction coefficient, density × `extinction` | 1 / mesh unit |
//! | Ω | single-scattering albedo | - |
//! | τ(x,ω) | optical depth from x to infinity along ω, inside pieces only | - |
//! | m(x,ω) | density length, τ = `extinction` × m | mesh unit |
//! | ψ = exp(-τ) | transmittance | - |
//! | Φ(x) = ∫ψ dω | fluence | sr |

#![warn(clippy::unwrap_used, clippy::expect_used)]

pub mod approx;
pub mod asset;
pub mod directions;
pub mod encoding;
pub mod error;
pub mod files;
pub mod fresnel;
pub mod harmonics;
pub mod hits;
pub mod kernel;
pub mod lobe;
pub mod material;
pub mod medium;
pub mod mesh;
pub mod morton;
mod npy;
pub mod phase;
pub mod picture;
pub mod reconstruct;
pub mod scene;
pub mod sh;
pub mod slopes;
mod toml_keys;
pub mod visibility;

pub use error::{Error, Result, one_line, plain};
