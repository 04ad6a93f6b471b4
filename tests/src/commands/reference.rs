//! `diaphane-validate reference`.

use super::Inputs;
use super::output::{say, tell, warn};
use super::progress::Display;
use diaphane_formats::{files, picture};
use std::path::PathBuf;
use std::time::Instant;
use validation::reference::{Settings, render};

/// What to render and how well.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  diaphane-validate reference bunny.obj --material jade.material.toml \\\n      \
                        --scene studio.scene.toml --output bunny.exr --tolerance 0.01"
)]
pub struct Arguments {
    #[command(flatten)]
    inputs: Inputs,
    /// Picture to write: linear radiance, coverage in alpha
    #[arg(long, value_name = "IMG.exr")]
    output: PathBuf,
    /// Relative noise of the picture at which to stop
    #[arg(long, default_value_t = 0.005)]
    tolerance: f64,
    /// Seed of the noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Renders and writes the picture.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    anyhow::ensure!(
        a.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")),
        "'{}': the reference is linear radiance; name an .exr file",
        a.output.display()
    );
    anyhow::ensure!(
        a.tolerance > 0.0 && a.tolerance.is_finite(),
        "--tolerance must be above 0, not {}",
        a.tolerance
    );
    let loaded = a.inputs.load()?;
    a.inputs.require_different(&a.output)?;
    files::require_writable(&a.output)?;
    warn(&loaded.warnings);
    let settings = Settings { tolerance: a.tolerance, seed: a.seed, ..Settings::default() };
    let start = Instant::now();
    let display = Display::new("reference");
    let reference =
        render(&loaded.mesh, &loaded.medium, &loaded.scene, &settings, &|p| display.reference(p))?;
    display.finish();
    picture::write_exr(&a.output, &reference.picture)?;
    let picture = &reference.picture;
    say(&format!(
        "{}: {} x {}, noise {:.3} %, {:.1} million rays, {:.1} s",
        a.output.display(),
        picture.width,
        picture.height,
        100.0 * reference.error,
        reference.rays as f64 * 1e-6,
        start.elapsed().as_secs_f64()
    ));
    if !reference.converged {
        tell("check failed: the noise is above the tolerance although every pixel has all its samples");
    }
    Ok(reference.converged)
}
