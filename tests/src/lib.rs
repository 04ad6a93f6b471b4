//! Checks diaphane against the truth: a ray-marched reference, metrics, and reports that show both.
//!
//! ```text
//! mesh, medium, scene ─> reference ─┐
//! asset, scene ─> play ─────────────┼─> metrics ─┬─> report (error map, HTML, JSON)
//! mesh, medium, asset ─> rivals ────┘            └─> sweep (table, summary, charts)
//! ```

#![warn(clippy::unwrap_used, clippy::expect_used)]

pub mod hostile;
pub mod metrics;
pub mod play;
pub mod range;
pub mod reference;
pub mod report;
pub mod rivals;
pub mod speed;
pub mod stress;
pub mod sweep;
