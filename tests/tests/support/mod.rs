//! What several tests need.
#![allow(dead_code)] // Each test file uses its own part.

use diaphane_formats::picture::Picture;
use diaphane_formats::scene::{Scene, parse_scene};
use std::path::{Path, PathBuf};

/// The workspace's root.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Reference pictures of another renderer, kept beside the workspace; absent on most machines.
pub fn reference_folder() -> Option<PathBuf> {
    let folder = workspace().join("../shared/reference");
    if folder.is_dir() {
        return Some(folder);
    }
    tell(&format!("skipped: {} is absent", folder.display()));
    None
}

/// A scene from its text.
pub fn scene(text: &str) -> Scene {
    parse_scene(text, Path::new(".")).unwrap()
}

/// Nodes and weights of the Gauss-Legendre rule on 0..1: roots of the Legendre polynomial by Newton's method.
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..100 {
                let (mut p, mut before) = (1.0, 0.0);
                for k in 0..n {
                    let k = k as f64;
                    (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
                }
                slope = n as f64 * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// The largest value of a picture.
pub fn brightest(picture: &Picture) -> f32 {
    picture.pixels.iter().flatten().fold(0.0, |m, v| m.max(*v))
}

/// Says why a test does nothing, past the test runner's capture of the print macros.
pub fn tell(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
