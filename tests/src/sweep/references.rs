//! Ray-marched references, rendered once for each case and number of lights and kept beside the measurements.

use crate::reference::{Progress, Settings, render};
use diaphane_formats::medium::Medium;
use diaphane_formats::mesh::Mesh;
use diaphane_formats::picture::{Picture, read_exr, write_exr};
use diaphane_formats::scene::Scene;
use diaphane_formats::{Error, Result, files};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A reference and its noise.
pub struct Known {
    /// Radiance.
    pub picture: Picture,
    /// Fraction of each pixel that the mesh covers.
    pub coverage: Vec<f32>,
    /// Estimated relative error.
    pub noise: f64,
}

/// What stands beside the picture.
#[derive(Serialize, Deserialize)]
struct About {
    noise: f64,
}

/// What is rendered, and how well.
pub struct Wanted<'a> {
    /// Boundary.
    pub mesh: &'a Mesh,
    /// What fills it.
    pub medium: &'a Medium,
    /// Camera and lights.
    pub scene: &'a Scene,
    /// Noise at which to stop, and seed.
    pub settings: Settings,
}

/// The reference `name` of `folder`, from its files if they are whole, otherwise rendered and kept. Also says whether
/// files were there but of no use.
///
/// # Errors
/// The scene makes no rays, or the files cannot be written.
pub fn obtain(
    folder: &Path,
    name: &str,
    wanted: &Wanted<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<(Known, Option<String>)> {
    let picture_path = folder.join(format!("{name}.exr"));
    let about_path = folder.join(format!("{name}.json"));
    let mut warning = None;
    if picture_path.exists() && about_path.exists() {
        match read(&picture_path, &about_path) {
            Ok(known) => return Ok((known, None)),
            Err(e) => warning = Some(format!("{e}; the reference is rendered again")),
        }
    }
    let made = render(wanted.mesh, wanted.medium, wanted.scene, &wanted.settings, progress)?;
    write_exr(&picture_path, &made.picture)?;
    let about = serde_json::to_vec(&About { noise: made.error })
        .map_err(|e| Error::invalid(format!("the reference's noise cannot be written: {e}")))?;
    files::write_atomically(&about_path, &about)?;
    let coverage = made.picture.coverage.clone().unwrap_or_default();
    Ok((Known { picture: made.picture, coverage, noise: made.error }, warning))
}

fn read(picture_path: &Path, about_path: &Path) -> Result<Known> {
    let picture = read_exr(picture_path)?;
    let about: About = serde_json::from_slice(&files::read(about_path, files::Kind::Kept)?)
        .map_err(|e| Error::file(about_path, format!("is damaged: {e}")))?;
    let coverage =
        picture.coverage.clone().ok_or_else(|| Error::file(picture_path, "has no coverage in alpha"))?;
    Ok(Known { picture, coverage, noise: about.noise })
}
