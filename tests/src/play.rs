//! Plays an asset for a measurement: no surface reflection, linear radiance, timed.

use diaphane_formats::asset::Asset;
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::Scene;
use diaphane_runtime::Result;
use diaphane_runtime::edit::Edit;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::{Backend, LightMode, Player};
use std::sync::Arc;
use std::time::Instant;

/// A picture as the player drew it.
#[derive(Clone, Debug)]
pub struct Played {
    /// Linear radiance and coverage.
    pub picture: Picture,
    /// "gpu" or "cpu".
    pub backend: String,
    /// What did the work.
    pub adapter: String,
    /// Milliseconds of a whole frame, every pass anew; the lower median if several were drawn.
    pub frame_ms: f64,
    /// Mean number of kernels that a ray through the object meets.
    pub splats_per_ray: f64,
    /// Sentences that a user should read.
    pub warnings: Vec<String>,
}

/// Draws `asset` as `scene` shows it, `frames` times (at least once).
///
/// # Errors
/// A camera that makes no rays, a GPU that is demanded but missing or fails.
pub fn play(
    asset: &Asset,
    scene: &Scene,
    backend: Backend,
    light: LightMode,
    frames: usize,
) -> Result<Played> {
    play_edited(asset, &Edit::default(), scene, backend, light, frames)
}

/// As [`play`], with another material.
///
/// # Errors
/// As [`play`]; an edit that is out of range.
pub fn play_edited(
    asset: &Asset,
    edit: &Edit,
    scene: &Scene,
    backend: Backend,
    light: LightMode,
    frames: usize,
) -> Result<Played> {
    let mut scene = scene.clone();
    let mut warnings = Vec::new();
    if scene.surface.reflection {
        scene.surface.reflection = false;
        warnings.push("the scene's surface reflection is off here: the reference has none".to_owned());
    }
    let frame = Frame::new(&scene, &asset.info)?;
    let inside = frame.lights_inside(&asset.info).len();
    if inside > 0 && light == LightMode::Baked {
        warnings.push(format!(
            "{inside} lights stand inside the object's bounding box, where baked light runs past them; try --light auto"
        ));
    }
    let mut player = Player::new(asset, backend)?;
    warnings.extend(player.note().map(str::to_owned));
    player.edit(edit)?;
    warnings.extend(edit.warning());
    let (backend, adapter) = player.describe();
    let (backend, adapter) = (backend.to_owned(), adapter);
    let mut times = Vec::new();
    let rendered = loop {
        let start = Instant::now();
        let rendered = player.render(&frame, light)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
        if times.len() >= frames {
            break rendered;
        }
    };
    times.sort_unstable_by(f64::total_cmp);
    Ok(Played {
        picture: Arc::unwrap_or_clone(rendered.picture),
        backend,
        adapter,
        frame_ms: times[(times.len() - 1) / 2],
        splats_per_ray: rendered.counters.splats_per_ray(),
        warnings,
    })
}
