//! What exact depths cost and what they are good for, in numbers.

use serde::Serialize;

/// Of one frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ExactReport {
    /// Lights whose exact depths serve.
    pub exact: usize,
    /// Lights on their way from baked to exact depths or back.
    pub fading: usize,
    /// Lights whose depths are being computed or wait for it.
    pub waiting: usize,
    /// Lights that would be waiting if there were memory for more depths.
    pub crowded: usize,
    /// All others: moving, or not asked for.
    pub baked: usize,
    /// Milliseconds spent on depths in this frame.
    pub milliseconds: f64,
    /// Samples times lights traced in this frame.
    pub rays: u64,
    /// Whether a GPU traced.
    pub on_gpu: bool,
    /// Speed of the latest portions; 0 before the first one.
    pub rays_per_second: f64,
    /// Memory of the depths that are kept.
    pub bytes: u64,
    /// Depths of lights that went to make room for others, since the start.
    pub evicted: u64,
    /// Error of the baked depths of each light that is exact now.
    pub errors: Vec<LightError>,
}

/// Error of the baked depths of one light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LightError {
    /// Number of the light in the scene, from 0.
    pub light: usize,
    /// sqrt(Σ w (E d)² / Σ w (E ψβ)²) over samples and channels: w the samples' weights, E the light's irradiance, ψβ
    /// the exact transmittance and d the baked one's difference from it. 0 where no light arrives.
    pub relative: f32,
}

impl ExactReport {
    /// Largest error of the baked depths of a light that is exact now; 0 without one.
    pub fn worst(&self) -> f32 {
        self.errors.iter().map(|e| e.relative).fold(0.0, f32::max)
    }
}

/// The two sums of [`LightError::relative`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Squares {
    /// Σ w (E d)².
    pub difference: f64,
    /// Σ w (E ψβ)².
    pub exact: f64,
}

impl Squares {
    /// The sums over both parts.
    pub fn plus(self, other: Self) -> Self {
        Self { difference: self.difference + other.difference, exact: self.exact + other.exact }
    }

    /// The quotient's root.
    pub fn relative(self) -> f32 {
        if self.exact > 0.0 { (self.difference / self.exact).sqrt() as f32 } else { 0.0 }
    }
}
