//! What a comparison leaves behind for people: pictures at one exposure, an error map, a page that needs no network,
//! and the same figures as JSON.

mod base64;
mod error_map;
mod font;
mod page;

pub use error_map::ErrorMap;
pub use page::page;

use crate::metrics::Metrics;
use crate::play::Played;
use crate::reference::Reference;
use diaphane_formats::picture::{self, Display};
use diaphane_formats::{Result, files};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// One played picture beside its reference.
pub struct Case {
    /// What is shown.
    pub title: String,
    /// The player's picture.
    pub played: Played,
    /// The truth.
    pub reference: Reference,
    /// How far apart they are.
    pub metrics: Metrics,
    /// Further facts for the table: name and value.
    pub facts: Vec<(String, String)>,
}

/// The figures of a case as they stand in `report.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// What is shown.
    pub title: String,
    /// Columns of the picture.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// "gpu" or "cpu".
    pub backend: String,
    /// What did the work.
    pub adapter: String,
    /// Milliseconds of a frame.
    pub frame_ms: f64,
    /// Mean number of kernels on a ray.
    pub splats_per_ray: f64,
    /// Estimated relative error of the reference.
    pub reference_noise: f64,
    /// The metrics.
    pub metrics: Metrics,
    /// Further facts.
    pub facts: Vec<(String, String)>,
    /// Sentences that a user should read.
    pub warnings: Vec<String>,
}

impl Case {
    /// The figures without the pictures.
    pub fn summary(&self) -> Summary {
        Summary {
            title: self.title.clone(),
            width: self.played.picture.width,
            height: self.played.picture.height,
            backend: self.played.backend.clone(),
            adapter: self.played.adapter.clone(),
            frame_ms: self.played.frame_ms,
            splats_per_ray: self.played.splats_per_ray,
            reference_noise: self.reference.error,
            metrics: self.metrics,
            facts: self.facts.clone(),
            warnings: self.played.warnings.clone(),
        }
    }

    /// The exposure of both pictures.
    fn display(&self) -> Display {
        Display::automatic(&self.reference.picture)
    }

    /// The error map.
    pub fn error_map(&self) -> ErrorMap {
        ErrorMap::new(&self.played.picture, &self.reference.picture)
    }
}

/// Names of the files that [`write_pictures`] makes.
pub const PICTURES: [&str; 5] = ["played.exr", "played.png", "reference.exr", "reference.png", "error.png"];

/// Writes both pictures (EXR, and PNG at the same exposure) and the error map to `folder`; returns their paths.
///
/// # Errors
/// A file cannot be written.
pub fn write_pictures(folder: &Path, case: &Case) -> Result<Vec<PathBuf>> {
    let paths = PICTURES.map(|name| folder.join(name));
    let display = case.display();
    picture::write_exr(&paths[0], &case.played.picture)?;
    picture::write_png(&paths[1], &case.played.picture, display)?;
    picture::write_exr(&paths[2], &case.reference.picture)?;
    picture::write_png(&paths[3], &case.reference.picture, display)?;
    let map = case.error_map();
    picture::write_png_bytes(&paths[4], map.width, map.height, &map.rgb)?;
    Ok(paths.to_vec())
}

/// Writes `report.html` and `report.json` to `folder`.
///
/// # Errors
/// A file cannot be written.
pub fn write_report(folder: &Path, heading: &str, cases: &[Case]) -> Result<()> {
    let summaries: Vec<Summary> = cases.iter().map(Case::summary).collect();
    let json = serde_json::to_string_pretty(&summaries)
        .map_err(|e| diaphane_formats::Error::invalid(format!("cannot write the report as JSON: {e}")))?;
    files::write_atomically(&folder.join("report.json"), json.as_bytes())?;
    files::write_atomically(&folder.join("report.html"), page(heading, cases)?.as_bytes())
}
