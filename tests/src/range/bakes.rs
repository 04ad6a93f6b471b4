//! Bakes of the table's bodies.

use super::materials::Material;
use super::objects::Placed;
use super::rows::Body;
use diaphane_bake::params::Params;
use diaphane_bake::progress::Progress;
use diaphane_bake::{Input, Result, bake};
use diaphane_formats::asset::{self, Asset};
use std::time::Instant;

/// A baked body.
pub struct Baked {
    /// The asset as it comes back from its file's bytes.
    pub asset: Asset,
    /// Size of the file.
    pub bytes: usize,
    /// Seconds that the bake took.
    pub seconds: f64,
    /// What the bake could not do as asked.
    pub shortfalls: Vec<String>,
}

/// Bakes `body`; `placed` is its object.
///
/// # Errors
/// Parameters out of range, no room for samples, cancellation.
pub fn bake_body(body: &Body, placed: &Placed, params: &Params, progress: &dyn Progress) -> Result<Baked> {
    let medium = body.material.medium(placed)?;
    let input = Input {
        mesh: &placed.mesh,
        mesh_report: &placed.report,
        medium: &medium,
        mesh_name: format!("{}.obj", body.object.name()),
        material_name: "range.material.toml".to_owned(),
    };
    let begun = Instant::now();
    let (baked, report) = bake(&input, params, progress)?;
    let seconds = begun.elapsed().as_secs_f64();
    // What is played is what a file would hold.
    let bytes = asset::encode(&baked)?;
    Ok(Baked { asset: asset::parse(&bytes)?, bytes: bytes.len(), seconds, shortfalls: report.shortfalls })
}

/// Gives an asset the albedo and the phase function of `material`: a bake depends on neither.
pub fn dye(asset: &mut Asset, material: &Material) {
    asset.info.albedo = material.albedo;
    asset.info.phase = material.phase;
    // They were measured with another material.
    asset.info.certificate = None;
    asset.levels.iter_mut().for_each(|level| level.error = None);
}
