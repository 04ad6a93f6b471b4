//! What a bake did, for people and for `--report`.

use crate::cache::CacheReport;
use crate::memory::{self, MemoryReport};
use crate::params::{DENSITY_VOXELS, Params, Visibility};
use crate::samples::Placed;
use diaphane_formats::asset::{Asset, Certificate, encode};
use diaphane_formats::medium::Medium;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What refinement did: relative errors of ray integrals with exact light, on rays and lights of its own; infinite (null
/// in JSON) where no light leaves the object.
#[derive(Clone, Debug, Serialize, Deserialize)]
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

/// A level of detail.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LevelSize {
    /// The first so many of the asset's samples.
    pub samples: usize,
    /// Of their kernels, in disk radii.
    pub width_factor: f32,
    /// Root mean square error over that of the truth, where the bake measured it.
    pub error: Option<f64>,
}

/// The levels of an asset, that of all samples first.
pub fn levels(asset: &Asset) -> Vec<LevelSize> {
    let errors = asset.level_errors().into_iter();
    let size = |((samples, width_factor), error)| LevelSize { samples, width_factor, error };
    asset.level_sizes().into_iter().zip(errors).map(size).collect()
}

/// The report of one bake.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Stored samples.
    pub samples: usize,
    /// Levels of detail, that of all samples first.
    pub levels: Vec<LevelSize>,
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
    /// Points tested for being inside, each way; what a cache held was not tested again.
    pub inside_tests: Tested,
    /// What was mended in the mesh, in sentences.
    pub warnings: Vec<String>,
    /// What refinement did; `None` where it was not asked for.
    pub refinement: Option<Refinement>,
    /// How far the asset is from the truth; `None` if it was not measured.
    pub certificate: Option<Certificate>,
    /// What the bake could not do as asked, in sentences.
    pub shortfalls: Vec<String>,
    /// What the cache held; `None` without one.
    pub cache: Option<CacheReport>,
    /// Bytes that the bake took.
    pub memory: MemoryReport,
}

/// How many points were tested each way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tested {
    /// Along three lines each.
    pub by_majority: usize,
    /// By generalized winding numbers.
    pub by_winding_number: usize,
}

/// What the stages tell.
pub(crate) struct Facts<'a> {
    pub medium: &'a Medium,
    pub placed: &'a Placed,
    pub refinement: Option<Refinement>,
    pub layers: usize,
    pub dark_layers: usize,
    pub skipped_queries: usize,
    pub buried: usize,
    pub dark: usize,
    pub discarded: usize,
    pub visibility: Visibility,
    pub tested: Tested,
}

/// Coefficients that samples do not need, of as many as `order` bands for all would take.
fn unused_coefficients(params: &Params, asset: &Asset) -> usize {
    let all = asset.samples.depth.order.iter();
    all.map(|k| (params.order * params.order).saturating_sub(usize::from(*k).pow(2))).sum()
}

impl Report {
    pub(crate) fn new(
        params: &Params,
        facts: &Facts<'_>,
        asset: &Asset,
        stages: &[(&'static str, f64)],
        cache: Option<CacheReport>,
    ) -> Self {
        let mut seconds = BTreeMap::new();
        for (name, s) in stages {
            *seconds.entry((*name).to_owned()).or_insert(0.0) += s;
        }
        seconds.insert("total".to_owned(), stages.iter().map(|(_, s)| s).sum());
        let skipped = BTreeMap::from([
            ("distance_queries".to_owned(), facts.skipped_queries),
            ("layers_below_all_light".to_owned(), facts.dark_layers),
            ("density_voxels".to_owned(), if asset.density.is_none() { DENSITY_VOXELS.pow(3) } else { 0 }),
            ("dark_or_outside_candidates".to_owned(), facts.placed.dark),
            ("candidates_without_inside_tests".to_owned(), facts.placed.untested),
            ("samples_without_inside_tests".to_owned(), facts.buried),
            ("dark_directions".to_owned(), facts.dark),
            ("coefficients".to_owned(), unused_coefficients(params, asset)),
        ]);
        let (found, directions) = (asset.samples.len(), params.directions.next_multiple_of(2));
        let mut shortfalls = Vec::new();
        if found.abs_diff(params.samples) * 20 > params.samples {
            shortfalls.push(format!("{} samples were asked for, {found} found a place", params.samples));
        }
        if let Some(cache) = &cache {
            shortfalls.extend(cache.problems.iter().map(|p| format!("cache: {p}")));
        }
        let rays = facts.placed.samples.len() * params.points_per_sample * directions;
        Self {
            samples: found,
            levels: levels(asset),
            directions,
            sh_order: params.order,
            rays: rays as u64,
            visibility: if facts.visibility == Visibility::Trace { "trace" } else { "project" },
            seconds,
            bytes: encode(asset).map_or(0, |b| b.len()),
            seed: params.seed,
            discarded: facts.discarded,
            snapped: facts.placed.snapped,
            layers: facts.layers,
            skipped,
            inside_tests: facts.tested,
            refinement: facts.refinement.clone(),
            certificate: asset.info.certificate,
            shortfalls,
            warnings: asset.info.provenance.mesh_report.warnings(),
            cache,
            memory: memory::report(params, facts.medium, asset),
        }
    }
}
