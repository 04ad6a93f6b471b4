//! Bakes a translucent mesh: thesis chapter 3, algorithms 1 and 2.
//!
//! ```text
//! mesh ─ field ─ layers ─ density ─ samples ─ (refine) ─ fit (optical depth, harmonics) ─ levels (weights) ─ pack ─ certificate ─ asset
//! ```
//!
//! A stage imports only the stages before it; [`pipeline`] runs them, [`cache`] remembers what they made. Nothing here prints; progress and cancellation go through
//! [`progress::Progress`].

#![warn(clippy::unwrap_used, clippy::expect_used)]

mod blocks;
pub mod cache;
mod certificate;
mod density;
pub mod entries;
mod error;
mod field;
mod fit;
mod layers;
mod levels;
pub mod list;
mod measure;
pub mod memory;
mod pack;
pub mod params;
mod pipeline;
pub mod progress;
mod refine;
pub mod report;
mod samples;
mod visibility;

pub use error::{Error, Result};

use cache::Cache;
use certificate::Goal;
use diaphane_formats::asset::Asset;
use diaphane_formats::medium::{Density, Medium, SampledDensity};
use diaphane_formats::mesh::{Mesh, MeshReport};
use params::Params;
use pipeline::Pipeline;
use progress::{Progress, Timed};
use report::Report;

/// What is baked.
pub struct Input<'a> {
    /// Closed boundary mesh.
    pub mesh: &'a Mesh,
    /// What was mended in it, for the provenance.
    pub mesh_report: &'a MeshReport,
    /// What fills it.
    pub medium: &'a Medium,
    /// Name of the mesh for the provenance.
    pub mesh_name: String,
    /// Name of the material for the provenance.
    pub material_name: String,
}

/// The medium with what its integrals need.
pub(crate) struct Prepared<'a> {
    pub medium: &'a Medium,
    /// The density on voxels: for the bake where it has no closed form, for the player unless it is a grid already.
    pub sampled: Option<SampledDensity>,
}

impl<'a> Prepared<'a> {
    fn new(medium: &'a Medium, mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds();
        let carried = matches!(medium.density_field(), Density::Uniform(_) | Density::Grid(_));
        let needed = !carried || !medium.has_closed_form();
        let sampled = needed.then(|| SampledDensity::new(medium, low, high, params::DENSITY_VOXELS));
        Self { medium, sampled }
    }

    /// The sampled density if rays should use it.
    pub fn for_rays(&self) -> Option<&SampledDensity> {
        self.sampled.as_ref().filter(|_| !self.medium.has_closed_form())
    }
}

/// Bakes `input`; again with more samples or bands while the certificate exceeds the wanted error, if there is one.
/// The same input, parameters and version give the same asset, whatever the number of threads.
///
/// # Errors
/// Parameters out of range, a mesh that leaves no room for samples, an error that cannot be met, cancellation.
pub fn bake(input: &Input<'_>, params: &Params, progress: &dyn Progress) -> Result<(Asset, Report)> {
    memory::required(input, params)?;
    let cache = Cache::open(params.cache.as_deref())?;
    let timed = Timed::new(progress);
    let asked = params.visibility;
    let mut params = field::suited(input, params);
    let mut goal = Goal::default();
    loop {
        let baked = Pipeline::new(input, &params, &cache, &timed).run()?;
        match goal.next(&params, baked.0.info.certificate.as_ref())? {
            None => {
                let (asset, mut report) = baked;
                if params.visibility != asked {
                    report
                        .warnings
                        .push("shells overlap: depths are traced, which counts the medium once".to_owned());
                }
                return Ok((asset, report));
            }
            Some(next) => params = next,
        }
        memory::required(input, &params)?;
    }
}
