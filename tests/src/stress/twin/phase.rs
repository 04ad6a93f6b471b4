//! Henyey-Greenstein's function of two directions, as well conditioned as it can be.
//!
//! With s the sign of g, D = s ω_in - ω_out and cos = ω_in·ω_out the denominator (1-g)² + 2g(1-cos) is
//! (1-|g|)² + |g| |D|²: no difference of nearly equal numbers at either peak.

use super::{Bounded, U};
use glam::DVec3;
use std::f64::consts::PI;

/// p of light that travels along `travels` towards `towards` (unit vectors or 0), each known up to `error`.
pub fn phase(g: f64, travels: DVec3, towards: DVec3, error: f64) -> Bounded {
    let size = g.abs();
    let value = |d2: f64| {
        let base = (1.0 - size).powi(2) + size * d2;
        (1.0 - size * size) / (4.0 * PI * base * base.sqrt())
    };
    let d2 = (g.signum() * travels - towards).length_squared();
    let d = d2.sqrt();
    let off = d + error;
    let (low, high) = ((d - error).max(0.0).powi(2) * (1.0 - 4.0 * U), off * off * (1.0 + 4.0 * U));
    let p = value(d2);
    let range = (value(low) - p).max(p - value(high));
    // 1 - |g| carries the rounding of g.
    Bounded { value: p, error: range + p * U * (10.0 + 4.0 * size / (1.0 - size)) }
}
