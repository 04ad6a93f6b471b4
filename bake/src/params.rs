//! What a user can choose about a bake.

use crate::{Error, Result};
use diaphane_formats::sh::MAX_ORDER;
use serde::Serialize;
use std::path::PathBuf;

/// Parameters of a bake. [`Params::default`] is the preset `standard`.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Stored samples, met within 5 %.
    pub samples: usize,
    /// Directions in which the optical depth of each sample is computed; an odd number is rounded up, because opposite
    /// directions share one projection.
    pub directions: usize,
    /// Points around each sample that a direction sees; the next directions see others, sixteen in all.
    pub points_per_sample: usize,
    /// Most bands of spherical harmonics of all samples, 1..=14.
    pub order: usize,
    /// Bands beyond `order` of the samples that need them most, as many as the bytes allow that others leave; never beyond
    /// 14 bands.
    pub extra_bands: usize,
    /// A sample gets no more bands once the root mean square error of its transmittance is below this; 0: all get
    /// all.
    pub light_error: f64,
    /// Seed of all random choices.
    pub seed: u64,
    /// Where samples may stand.
    pub placement: Placement,
    /// How depths towards all directions are found.
    pub visibility: Visibility,
    /// What the harmonics represent.
    pub representation: Representation,
    /// Full width at half maximum of a kernel in disk radii.
    pub width_factor: f32,
    /// Most times that refinement places the samples anew; 0: no refinement.
    pub refine: usize,
    /// Whether the bake measures its own error.
    pub certificate: bool,
    /// Largest certified relative error; samples or bands are added until it is met.
    pub max_error: Option<f64>,
    /// Folder where results of stages are kept and found again ([`crate::cache`]).
    pub cache: Option<PathBuf>,
    /// Bytes that the bake may take, as predicted ([`crate::memory`]).
    pub memory_limit: Option<u64>,
}

/// Directions used to estimate the fluence on the layers.
pub const DENSITY_DIRECTIONS: usize = 64;

/// Voxels along the longest edge of the box when a density field without closed form is sampled.
pub const DENSITY_VOXELS: usize = 112;

/// Samples whose fluence, over 4π, stays below this are not stored.
pub const DARK: f64 = 5e-3;

/// The disk radius follows (κt Φ)^-EXPONENT.
pub const RADIUS_EXPONENT: f64 = 0.3;

/// Samples closer to the boundary than this many radii are moved onto it.
pub const BOUNDARY_SNAP: f64 = 0.3;

/// The function of optical depth that is expanded in spherical harmonics, see [`diaphane_formats::encoding`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Representation {
    /// ψ, the thesis' choice.
    Transmittance,
    /// τ.
    Depth,
    /// 1/(τ + ε); the bake chooses ε.
    Reciprocal,
    /// The same, with a lobe towards the nearest surface where that comes nearer for the same bytes.
    Lobe,
}

/// How the optical depth of many points along one direction is found; the result is the same. Where shells of the mesh
/// overlap a bake traces, whatever was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Visibility {
    /// Whichever should be faster for so many points and triangles.
    Auto,
    /// Every triangle is projected onto the points ([`diaphane_formats::visibility::project()`]).
    Project,
    /// Rays through a box hierarchy ([`diaphane_formats::visibility::trace`]): the oracle.
    Trace,
}

/// Where samples may stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Placement {
    /// On the boundary and anywhere under it.
    Boundary,
    /// On layers at a constant offset, the first one an offset under the boundary: the thesis' choice (section 3.2.1),
    /// the documented baseline.
    Layers,
}

/// Named sets of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Seconds; for trying things out.
    Draft,
    /// The default.
    Standard,
    /// More directions and bands, samples moved and resized to lower the error of rays.
    Fine,
}

impl Params {
    /// The parameters of a preset.
    pub fn preset(preset: Preset) -> Self {
        let (samples, directions, points_per_sample, order, light_error) = match preset {
            Preset::Draft => (5_000, 96, 4, 6, 0.03),
            Preset::Standard => (50_000, 1024, 2, 10, 0.01),
            Preset::Fine => (50_000, 1_536, 4, 14, 0.003),
        };
        Self {
            samples,
            directions,
            points_per_sample,
            order,
            extra_bands: if preset == Preset::Draft { 2 } else { 4 },
            light_error,
            seed: 1,
            placement: Placement::Boundary,
            visibility: Visibility::Auto,
            representation: Representation::Lobe,
            width_factor: 1.35,
            refine: if preset == Preset::Fine { 4 } else { 0 },
            certificate: true,
            max_error: None,
            cache: None,
            memory_limit: None,
        }
    }

    /// Most bands of any sample.
    pub(crate) fn peak_order(&self) -> usize {
        self.order.saturating_add(self.extra_bands).min(MAX_ORDER)
    }

    pub(crate) fn validate(&self) -> Result<()> {
        let fail = |message: String| Err(Error::Parameter(message));
        if !(1..=20_000_000).contains(&self.samples) {
            return fail(format!("--samples must lie within 1..20000000, not {}", self.samples));
        }
        if !(1..=65_536).contains(&self.directions) {
            return fail(format!("--directions must lie within 1..65536, not {}", self.directions));
        }
        if !(1..=256).contains(&self.points_per_sample) {
            return fail(format!(
                "the points for each sample must lie within 1..256, not {}",
                self.points_per_sample
            ));
        }
        if !(1..=MAX_ORDER).contains(&self.order) {
            return fail(format!("--sh-order must lie within 1..{MAX_ORDER}, not {}", self.order));
        }
        if !(0.0..=1.0).contains(&self.light_error) {
            return fail(format!("--light-error must lie within 0..1, not {}", self.light_error));
        }
        if self.refine > 100 {
            return fail(format!("--refine must lie within 0..100, not {}", self.refine));
        }
        if !(0.5..=4.0).contains(&self.width_factor) {
            return fail(format!("the width factor must lie within 0.5..4, not {}", self.width_factor));
        }
        match self.max_error {
            Some(error) if !(error > 0.0 && error.is_finite()) => {
                fail(format!("--max-error must be above 0, not {error}"))
            }
            Some(_) if !self.certificate => fail("--max-error needs the certificate".to_owned()),
            _ => Ok(()),
        }
    }
}

impl Default for Params {
    fn default() -> Self {
        Self::preset(Preset::Standard)
    }
}
