//! Exact optical depths from the samples to chosen lights: rays through the mesh instead of spherical harmonics.
//!
//! For point and spot lights the depth ends at the light, so that lights inside the object are right; the baked
//! depth runs to infinity.
//!
//! [`DepthTracer`] computes all depths of a light at once. [`Spread`] does so in portions, a few milliseconds a frame
//! ([`pace`]), for lights at rest or marked exact; [`schedule`] decides which and when. Meanwhile baked depths serve. Once a
//! light's depths are known its transmittance goes from baked to exact in equal steps,
//!
//!   ψβ = ψβ_baked + s d,   d = ψβ_exact - ψβ_baked (a number per sample and channel),   s = 0 .. 1,
//!
//! and with s = 1 the depths themselves serve. Where the light moves its depths no longer hold; d goes on as a correction of
//! the baked transmittance at the new place (clamped to 0..1), and s goes back to 0 in the same steps. A correction is as
//! small as the error of the harmonics, where depths of the old place would leave the old shadow behind.

pub mod pace;
pub mod report;
pub mod schedule;
pub mod spread;
mod table;
mod tracer;

pub use report::ExactReport;
pub use schedule::Settings;
pub use spread::Spread;
pub use table::Table;
pub use tracer::DepthTracer;

use half::f16;
use std::sync::Arc;

/// [density length m (mesh units), Fresnel transmittance of the boundary (0..1)] of every sample towards a light.
pub type Depths = Table<[f32; 2]>;

/// d of every sample towards a light: red, green and blue, then 0; each -1..1.
pub type Corrections = Table<[f16; 4]>;

/// What replaces or corrects the baked depths of a light.
#[derive(Clone, Debug, PartialEq)]
pub enum Known {
    /// Depths that take the place of the baked ones.
    Exact(Arc<Depths>),
    /// Baked depths serve; a share s of the corrections, above 0 and below 1, is added to their transmittance.
    Corrected {
        /// d.
        by: Arc<Corrections>,
        /// s.
        share: f32,
    },
}

/// What is known of some of a frame's lights beyond the baked depths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExactDepths {
    lights: Vec<Option<Known>>,
}

impl ExactDepths {
    /// Of a frame's lights, in order; lights beyond the end are baked.
    pub fn new(lights: Vec<Option<Known>>) -> Self {
        Self { lights }
    }

    /// What is known of light `index` of the frame; `None` where the baked depths serve alone.
    pub fn known(&self, index: usize) -> Option<&Known> {
        self.lights.get(index)?.as_ref()
    }

    /// The depths of all samples towards light `index` of the frame; `None` where baked ones serve, corrected or not.
    pub fn light(&self, index: usize) -> Option<&[[f32; 2]]> {
        match self.known(index)? {
            Known::Exact(depths) => Some(depths.values()),
            Known::Corrected { .. } => None,
        }
    }

    /// How exact light `index` is: 0 baked, 1 exact.
    pub fn share(&self, index: usize) -> f32 {
        match self.known(index) {
            None => 0.0,
            Some(Known::Exact(_)) => 1.0,
            Some(Known::Corrected { share, .. }) => *share,
        }
    }

    /// Whether baked depths serve all lights alone.
    pub fn is_empty(&self) -> bool {
        self.lights.iter().all(Option::is_none)
    }
}
