//! Run time against error: the player over its parameters, and its rivals, on the same pictures.
//!
//! ```text
//! plan (axes -> jobs) ─┐
//! case, lights ────────┼─> measure ─> store (one line a measurement, resumable) ─> analysis ─> csv, plots, summary
//! references (cached) ─┘
//! ```

pub mod analysis;
pub mod case;
pub mod figures;
pub mod lights;
pub mod measure;
pub mod plan;
pub mod record;
pub mod references;
pub mod store;
pub mod summary;
pub mod table;
