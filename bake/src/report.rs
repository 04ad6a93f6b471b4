//! What a bake did, for people and for `--report`.

use crate::field::Shape;
use crate::fit::Lit;
use crate::layers::Layer;
use crate::params::Params;
use diaphane_formats::asset::{Asset, Certificate, encode};
use serde::Serialize;
use std::collections::BTreeMap;

/// What refinement did: relative errors of ray integrals with exact light, on rays and lights of its own; infinite (null
/// in JSON) where no light leaves the object.
#[derive(Clone, Debug, Serialize)]
pub struct Refinement {
    /// Before.
    pub before: f64,
    /// After.
    pub after: f64,
    /// Times that all samples were placed anew, the last of which may have been taken back.
    pub moves: usize,
    /// Width of the kernels that was found, in disk radii.
    pub width_factor: f32,
}

/// The report of one bake.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Stored samples.
    pub samples: usize,
    /// Directions for each sample.
    pub directions: usize,
    /// Bands of spherical harmonics.
    pub sh_order: usize,
    /// Depths computed for the samples.
    pub rays: u64,
    /// How they were found: `project` or `trace`.
    pub visibility: &'static str,
    /// Seconds of each stage, over all bakes that a wanted error took, in order of name; `total` is their sum.
    pub seconds: BTreeMap<String, f64>,
    /// Size of the asset file.
    pub bytes: usize,
    /// Seed of all random choices.
    pub seed: u64,
    /// Samples dropped after placing because they turned out dark or outside.
    pub discarded: usize,
    /// Samples moved onto the boundary.
    pub snapped: usize,
    /// Offset layers.
    pub layers: usize,
    /// What was skipped because nothing needed it.
    pub skipped: BTreeMap<String, usize>,
    /// What was mended in the mesh, in sentences.
    pub warnings: Vec<String>,
    /// What refinement did; `None` where it was not asked for.
    pub refinement: Option<Refinement>,
    /// How far the asset is from the truth; `None` if it was not measured.
    pub certificate: Option<Certificate>,
    /// What the bake could not do as asked, in sentences.
    pub shortfalls: Vec<String>,
}

/// Coefficients that samples do not need, of as many as `order` bands for all would take.
fn unused_coefficients(params: &Params, asset: &Asset) -> usize {
    let all = asset.samples.depth.order.iter();
    all.map(|k| (params.order * params.order).saturating_sub(usize::from(*k).pow(2))).sum()
}

impl Report {
    pub(crate) fn new(
        params: &Params,
        shape: &Shape<'_>,
        layers: &[Layer],
        lit: &Lit,
        asset: &Asset,
        stages: &[(&'static str, f64)],
    ) -> Self {
        let mut seconds = BTreeMap::new();
        for (name, s) in stages {
            *seconds.entry((*name).to_owned()).or_insert(0.0) += s;
        }
        seconds.insert("total".to_owned(), stages.iter().map(|(_, s)| s).sum());
        let skipped = BTreeMap::from([
            ("distance_queries".to_owned(), shape.skipped_nodes),
            ("dark_or_outside_candidates".to_owned(), lit.dark_candidates),
            ("samples_without_inside_tests".to_owned(), lit.buried),
            ("coefficients".to_owned(), unused_coefficients(params, asset)),
        ]);
        let found = lit.samples.len();
        let mut shortfalls = Vec::new();
        if found.abs_diff(params.samples) * 20 > params.samples {
            shortfalls.push(format!("{} samples were asked for, {found} found a place", params.samples));
        }
        Self {
            samples: lit.samples.len(),
            directions: lit.directions.len(),
            sh_order: params.order,
            rays: lit.rays,
            visibility: lit.visibility,
            seconds,
            bytes: encode(asset).map_or(0, |b| b.len()),
            seed: params.seed,
            discarded: lit.discarded,
            snapped: lit.snapped,
            layers: layers.len(),
            skipped,
            refinement: None,
            certificate: asset.info.certificate,
            shortfalls,
            warnings: asset.info.provenance.mesh_report.warnings(),
        }
    }
}
