//! Scatter charts on logarithmic axes as SVG, written by hand: panels side by side, a legend, a front.
//!
//! ```text
//! Chart -> axis (range, ticks) -> svg (elements) -> text
//! ```

mod axis;
mod chart;
mod svg;

pub use axis::Unit;
pub use chart::{Chart, Joined, Panel, Point, Series, render};

#[cfg(test)]
mod tests;
