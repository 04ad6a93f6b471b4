//! Ray integrals of packed samples against the truth: what refinement and certificate are made of.
//!
//! ```text
//! views (rays) ─┬─ truth (quadrature, exact transmittance) ─┐
//!               └─ play (samples along the rays) ───────────┴─ errors
//! cells ─ exact ─┘
//! ```

pub(crate) mod exact;
pub(crate) mod play;
pub(crate) mod truth;
pub(crate) mod views;
