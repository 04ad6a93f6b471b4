//! Bakes a translucent mesh: thesis chapter 3, algorithms 1 and 2.
//!
//! ```text
//! mesh ─ field ─ layers ─ density ─ samples ─ (refine) ─ fit (optical depth, harmonics, weights) ─ pack ─ certificate ─ asset
//! ```
//!
//! A stage imports only the stages before it. Nothing here prints; progress and cancellation go through
//! [`progress::Progress`].

mod certificate;
mod density;
mod error;
mod field;
mod fit;
mod layers;
mod measure;
mod pack;
pub mod params;
pub mod progress;
mod refine;
pub mod report;
mod samples;
mod visibility;

pub use error::{Error, Result};

use certificate::Goal;
use diaphane_formats::asset::Asset;
use diaphane_formats::medium::{Density, Medium, SampledDensity};
use diaphane_formats::mesh::{Mesh, MeshReport};
use pack::Stand;
use params::Params;
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
    params.validate()?;
    let mut timed = Timed::new(progress);
    let mut params = params.clone();
    let mut goal = Goal::default();
    loop {
        let baked = bake_once(input, &params, &mut timed)?;
        match goal.next(&params, baked.0.info.certificate.as_ref())? {
            None => return Ok(baked),
            Some(next) => params = next,
        }
    }
}

fn bake_once(input: &Input<'_>, params: &Params, timed: &mut Timed<'_>) -> Result<(Asset, Report)> {
    let shape = timed.stage("distance field", |p| field::Shape::new(input.mesh, params, p))?;
    let medium = timed.stage("medium", |_| Ok(Prepared::new(input.medium, input.mesh)))?;
    let layers = timed.stage("layers", |p| layers::build(&shape, input.medium, params.placement, p))?;
    let density = timed.stage("density", |p| density::evaluate(&shape, &layers, &medium, params, p))?;
    let (offered, placed) = timed.stage("samples", |p| {
        let offered = samples::offer(&shape, &layers, &density, input.medium, params)?;
        let placed = samples::place(&shape, &offered, params.samples, |_| 1.0, p)?;
        Ok((offered, placed))
    })?;
    let bench = refine::Bench { input, shape: &shape, medium: &medium, offered: &offered, params };
    let (placed, width_factor, refined) = match params.refine {
        0 => (placed, params.width_factor, None),
        rounds => timed.stage("refinement", |p| refine::refine(&bench, placed, rounds, p))?,
    };
    let params = &Params { width_factor, ..params.clone() };
    let lit = timed.stage("optical depth", |p| fit::depths(&shape, &medium, placed, params, p))?;
    let harmonics = timed.stage("harmonics", |p| fit::harmonics(&lit, params, p))?;
    let weights = timed.stage("weights", |p| fit::weights(&lit.samples, &lit.probes, width_factor, p))?;
    let stand = Stand { samples: &lit.samples, cells: &lit.cells, discarded: lit.discarded };
    let mut asset = timed.stage("packing", |_| {
        pack::pack(input, medium.sampled.as_ref(), params, &stand, harmonics, weights)
    })?;
    if params.certificate {
        let measured = timed.stage("certificate", |p| {
            certificate::measure(&shape, &medium, &lit.cells, &asset, params.seed, p)
        })?;
        asset.info.certificate = Some(measured);
    }
    let report =
        Report { refinement: refined, ..Report::new(params, &shape, &layers, &lit, &asset, &timed.seconds) };
    Ok((asset, report))
}
