//! The range of media and lights: a table of cases that shows where pictures are good and where they are not.
//!
//! ```text
//! rows ─ body (object, material) ─> bakes ─> play ─┐
//!     └─ view, lights ─> scene ─┬──────────────────┴─> metrics ─> table
//!                               └─> reference (cache)
//! ```
//!
//! Everything is given in diagonals of the object's bounding box, so that a row means the same on every object.

pub mod bakes;
pub mod cache;
pub mod lights;
pub mod materials;
pub mod objects;
pub mod rows;
pub mod table;
pub mod views;

pub use rows::{Row, rows};
