//! Single measurements: an asset baked, a frame drawn a few times by one method, compared with the reference.

use super::case::Case;
use super::plan::Baked;
use super::references::Known;
use crate::metrics::{Metrics, compare};
use crate::rivals::grid::{self, Blend, Grid};
use crate::rivals::march::{Light, March};
use crate::rivals::object::Object;
use crate::rivals::thesis::{self, Thesis, best_scale, scaled};
use diaphane_bake::params::{Params, Placement};
use diaphane_bake::progress::{Progress, Silent};
use diaphane_bake::{Input, bake, report::Report};
use diaphane_formats::asset::{Asset, encode, section_sizes};
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::Scene;
use diaphane_runtime::Result;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::{LightMode, Player};
use std::sync::Arc;
use std::time::Instant;

/// Sections that do not grow with the samples.
const SHARED_SECTIONS: [&str; 4] = ["info", "mesh_positions", "mesh_triangles", "density"];

/// Sections that place a sample rather than hold its function of direction.
const PLACING_SECTIONS: [&str; 3] = ["place", "offset", "weight"];

/// Stages of the bake up to the samples' places: what any method at the same samples needs.
const PLACING_STAGES: [&str; 5] = ["distance field", "medium", "layers", "density", "samples"];

/// Frames beyond the first are drawn only while all together took less than this.
const PATIENCE_S: f64 = 4.0;

/// An asset as baked, and its cost.
pub struct Made {
    /// The asset.
    pub asset: Asset,
    /// Seconds of the whole bake.
    pub seconds: f64,
    /// Seconds until the samples had their places.
    pub placing_seconds: f64,
    /// Bytes of mesh, density and metadata.
    pub shared_bytes: usize,
    /// Bytes of a sample.
    pub sample_bytes: f64,
    /// Those of them that hold the function of direction: the bytes of a node of a grid.
    pub function_bytes: f64,
}

/// Bakes.
///
/// # Errors
/// As [`bake`].
pub fn make(case: &Case, baked: &Baked, seed: u64, progress: &dyn Progress) -> diaphane_bake::Result<Made> {
    make_with(case, &baked.params(seed), progress)
}

/// The samples' places as the thesis chooses them, and next to no light.
///
/// # Errors
/// As [`bake`].
pub fn place_as_published(case: &Case, samples: usize, seed: u64) -> diaphane_bake::Result<Made> {
    let params = Params {
        samples,
        seed,
        placement: Placement::Layers,
        directions: 32,
        points_per_sample: 1,
        order: 1,
        extra_bands: 0,
        certificate: false,
        ..Params::default()
    };
    make_with(case, &params, &Silent)
}

fn make_with(case: &Case, params: &Params, progress: &dyn Progress) -> diaphane_bake::Result<Made> {
    let input = Input {
        mesh: &case.mesh,
        mesh_report: &case.mesh_report,
        medium: &case.medium,
        mesh_name: case.name.clone(),
        material_name: case.name.clone(),
    };
    let begun = Instant::now();
    let (asset, report) = bake(&input, params, progress)?;
    let seconds = begun.elapsed().as_secs_f64();
    let sections = section_sizes(&encode(&asset)?)?;
    let sum = |wanted: &dyn Fn(&str) -> bool| -> usize {
        sections.iter().filter(|(name, _)| wanted(name)).map(|(_, bytes)| bytes).sum()
    };
    let n = asset.samples.len().max(1) as f64;
    let shared_bytes = sum(&|name| SHARED_SECTIONS.contains(&name));
    let all = sum(&|_| true) - shared_bytes;
    let placing = sum(&|name| PLACING_SECTIONS.contains(&name));
    Ok(Made {
        placing_seconds: placing_seconds(&report),
        seconds,
        shared_bytes,
        sample_bytes: all as f64 / n,
        function_bytes: (all - placing) as f64 / n,
        asset,
    })
}

fn placing_seconds(report: &Report) -> f64 {
    PLACING_STAGES.iter().filter_map(|name| report.seconds.get(*name)).sum()
}

/// A method's picture and what it cost.
pub struct Shot {
    /// Radiance.
    pub picture: Picture,
    /// Milliseconds: least, lower median, most.
    pub frame_ms: [f64; 3],
    /// Kernels on a ray.
    pub splats_per_ray: f64,
    /// What was chosen in favour of a rival.
    pub note: String,
}

/// Draws at most `frames` times, fewer when that takes long, at least once.
fn timed<T>(frames: usize, mut draw: impl FnMut() -> Result<T>) -> Result<(T, [f64; 3])> {
    let mut times = Vec::new();
    loop {
        let begun = Instant::now();
        let drawn = draw()?;
        times.push(begun.elapsed().as_secs_f64() * 1e3);
        if times.len() >= frames || times.iter().sum::<f64>() > 1e3 * PATIENCE_S {
            times.sort_unstable_by(f64::total_cmp);
            let last = times.len() - 1;
            return Ok((drawn, [times[0], times[last / 2], times[last]]));
        }
    }
}

/// Plays. The first frame on a GPU, which builds its pipelines, is not counted.
///
/// # Errors
/// The GPU failed, or the camera makes no rays.
pub fn splats(player: &mut Player, scene: &Scene, frames: usize) -> Result<Shot> {
    let frame = Frame::new(scene, player.info())?;
    if player.describe().0 == "gpu" {
        player.render(&frame, LightMode::Baked)?;
    }
    let (rendered, frame_ms) = timed(frames, || player.render(&frame, LightMode::Baked))?;
    let splats_per_ray = rendered.counters.splats_per_ray();
    let picture = Arc::unwrap_or_clone(rendered.picture);
    Ok(Shot { picture, frame_ms, splats_per_ray, note: String::new() })
}

/// Marches.
///
/// # Errors
/// None of its own.
pub fn march<L: Light>(march: &March<'_, L>, frame: &Frame, frames: usize) -> Result<Shot> {
    let (picture, frame_ms) = timed(frames, || Ok(march.draw(frame)))?;
    Ok(Shot { picture, frame_ms, splats_per_ray: 0.0, note: String::new() })
}

/// A grid with the bytes of an asset's samples; `None` where the object has no room for a node.
pub fn grid(object: &Object<'_>, made: &Made, baked: &Baked) -> Option<Grid> {
    let bytes = made.sample_bytes * made.asset.samples.len() as f64;
    let nodes = (bytes / made.function_bytes.max(1.0)) as usize;
    let settings = grid::Settings {
        nodes,
        order: baked.order,
        encoding: made.asset.info.encoding,
        directions: baked.directions,
    };
    Grid::new(object, settings)
}

/// Marches through a grid, interpolating what comes nearer to the reference.
///
/// # Errors
/// Pictures that cannot be compared.
pub fn through_grid(
    object: &Object<'_>,
    grid: &mut Grid,
    steps: usize,
    frame: &Frame,
    reference: &Known,
    frames: usize,
) -> Result<Shot> {
    let mut error_of = |blend: Blend| -> Result<f64> {
        grid.blend = blend;
        let picture = March { object, steps, light: &*grid }.draw(frame);
        Ok(judge(&picture, reference)?.rel_rmse)
    };
    let values = error_of(Blend::Values)?;
    let logarithms = error_of(Blend::Logarithms)?;
    let (blend, name) = if values <= logarithms {
        (Blend::Values, "coefficients interpolated")
    } else {
        (Blend::Logarithms, "logarithms interpolated")
    };
    grid.blend = blend;
    let shot = march(&March { object, steps, light: &*grid }, frame, frames)?;
    Ok(Shot { note: format!("{name}; {} nodes", grid.stored), ..shot })
}

/// The published recipe with its best width and scale.
///
/// # Errors
/// Pictures that cannot be compared.
pub fn recipe(thesis: &Thesis<'_>, frame: &Frame, reference: &Known, frames: usize) -> Result<Shot> {
    // One ray a pixel suffices to choose the width.
    let coarse = Frame { samples_per_pixel: 1, ..frame.clone() };
    let sources = thesis.sources(&coarse);
    let scale_of = |picture: &Picture| best_scale(picture, &reference.picture, &reference.coverage);
    let mut best = (f64::INFINITY, thesis::FACTORS[0]);
    for factor in thesis::FACTORS {
        let picture = thesis.splat(&coarse, &sources, factor).picture;
        let scale = scale_of(&picture);
        let error = judge(&scaled(picture, scale), reference)?.rel_rmse;
        if error < best.0 {
            best = (error, factor);
        }
    }
    let factor = best.1;
    let (drawn, frame_ms) = timed(frames, || Ok(thesis.splat(frame, &thesis.sources(frame), factor)))?;
    let scale = scale_of(&drawn.picture);
    Ok(Shot {
        picture: scaled(drawn.picture, scale),
        frame_ms,
        splats_per_ray: drawn.splats_per_ray,
        note: format!("width {factor}; scale {scale:.3}"),
    })
}

/// The metrics of a picture.
///
/// # Errors
/// As [`compare`].
pub fn judge(picture: &Picture, reference: &Known) -> Result<Metrics> {
    Ok(compare(picture, &reference.picture, &reference.coverage)?)
}
