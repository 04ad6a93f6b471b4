//! Pictures from the window to files.

use anyhow::Result;
use diaphane_formats::picture::{Display, Picture, write_exr, write_png};
use std::path::{Path, PathBuf};

/// Saves a picture next to the others in the working directory: radiance as EXR, or with an exposure as PNG. Returns
/// the file's name.
///
/// # Errors
/// The file cannot be written.
pub fn save(title: &str, picture: &Picture, exposure: Option<f32>) -> Result<PathBuf> {
    let stem = Path::new(title).file_stem().map_or_else(|| "picture".into(), |s| s.to_string_lossy());
    let path = free_name(&stem, if exposure.is_some() { "png" } else { "exr" });
    match exposure {
        Some(exposure) => write_png(&path, picture, Display { exposure })?,
        None => write_exr(&path, picture)?,
    }
    Ok(path)
}

/// The first of stem-001, stem-002, ... that does not exist.
fn free_name(stem: &str, extension: &str) -> PathBuf {
    let name = |n: u32| PathBuf::from(format!("{stem}-{n:03}.{extension}"));
    (1..).map(name).find(|p| !p.exists()).unwrap_or_else(|| name(0))
}
