//! Checks diaphane against the truth: a ray-marched reference, metrics, and reports that show both.
//!
//! ```text
//! mesh, medium, scene ─> reference ─┐
//! asset, scene ─> play ─────────────┴─> metrics ─> error map, report
//! ```

pub mod metrics;
pub mod reference;
