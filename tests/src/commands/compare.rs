//! `diaphane-validate compare`.

use super::output::say;
use diaphane_formats::picture::{self, Picture};
use std::path::{Path, PathBuf};
use validation::metrics::{Metrics, compare};

/// Which pictures to compare.
#[derive(clap::Args)]
#[command(
    after_help = "Only pixels that the mesh covers fully count. Their mask is --coverage, else the reference's \
                        alpha, else the pixels where the reference is above 0.\n\nExample:\n  \
                        diaphane-validate compare played.exr reference.exr --json"
)]
pub struct Arguments {
    /// Picture to judge (EXR, linear radiance)
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// Picture to compare with (EXR, linear radiance)
    #[arg(value_name = "REFERENCE")]
    reference: PathBuf,
    /// Coverage mask, 0..1 or 0..255 per pixel
    #[arg(long, value_name = "C.exr|C.npy")]
    coverage: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Prints the metrics.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    let image = picture::read_exr(&a.image)?;
    let reference = picture::read_exr(&a.reference)?;
    let (coverage, source) = find_coverage(a.coverage.as_deref(), &reference)?;
    let metrics = compare(&image, &reference, &coverage)?;
    if a.json {
        let mut value = serde_json::to_value(metrics)?;
        value["coverage"] = source.into();
        say(&serde_json::to_string_pretty(&value)?);
    } else {
        print_metrics(&metrics);
        say(&format!("coverage   {source}"));
    }
    Ok(metrics.non_finite == 0)
}

/// The metrics as a small table.
pub fn print_metrics(m: &Metrics) {
    say(&format!("rel_rmse   {:.5}", m.rel_rmse));
    say(&format!("psnr_db    {:.2}", m.psnr_db));
    say(&format!("bias       {:+.5}", m.bias));
    say(&format!("p99_rel    {:.5}", m.p99_rel));
    say(&format!("non_finite {}", m.non_finite));
    say(&format!("pixels     {}", m.pixels));
}

/// The mask and where it comes from.
fn find_coverage(file: Option<&Path>, reference: &Picture) -> anyhow::Result<(Vec<f32>, String)> {
    if let Some(path) = file {
        let (width, height, coverage) = picture::read_coverage(path)?;
        anyhow::ensure!(
            (width, height) == (reference.width, reference.height),
            "'{}' is {width} x {height} but the reference is {} x {}",
            path.display(),
            reference.width,
            reference.height
        );
        return Ok((coverage, format!("from {}", path.display())));
    }
    Ok(match &reference.coverage {
        Some(coverage) => (coverage.clone(), "the reference's alpha".to_owned()),
        None => {
            let lit = |p: &[f32; 3]| f32::from(u8::from(p.iter().any(|v| *v > 0.0)));
            (reference.pixels.iter().map(lit).collect(), "pixels above 0 in the reference".to_owned())
        }
    })
}
