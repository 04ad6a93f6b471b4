//! `diaphane-validate bake-scaling`: how the time of a bake grows with samples, triangles and directions.

use super::output::{say, tell};
use super::{check_folder, make_folder};
use anyhow::Context;
use diaphane_formats::files;
use diaphane_runtime::plot;
use std::path::PathBuf;
use validation::speed::bakes::seconds;
use validation::speed::scaling::{AXES, Measured, chart, last_slope, measure, slope};
use validation::speed::{Line, text};

/// Where to write, and how much to measure.
#[derive(clap::Args)]
#[command(
    after_help = "Writes bake_scaling.svg and bake_scaling.json. All of it takes some minutes and 3 GB of memory. Close other \
                  programs: they take part in the measurement.\n\nExamples:\n  diaphane-validate bake-scaling \
                  --output-dir out\n  diaphane-validate bake-scaling --output-dir out --quick"
)]
pub struct Arguments {
    /// Folder for the chart and the figures
    #[arg(long, value_name = "DIR")]
    output_dir: PathBuf,
    /// Leaves out bakes that take long
    #[arg(long)]
    quick: bool,
}

/// Measures, writes and prints.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    check_folder(&a.output_dir)?;
    make_folder(&a.output_dir)?;
    let mut bakes: Vec<Measured> = Vec::new();
    let mut lines = Vec::new();
    for axis in AXES {
        for size in axis.sizes(a.quick) {
            let m = measure(axis, &size)?;
            let total = seconds(&m.report, "total");
            tell(&format!("{} {}: {total:.2} s", m.value, axis.name()));
            bakes.push(m);
        }
        let own: Vec<&Measured> = bakes.iter().filter(|b| b.axis == axis.name()).collect();
        let steepest = format!("{:.2}, between the two largest {:.2}", slope(&own), last_slope(&own));
        lines.push(Line::new(format!("slope against {}", axis.name()), steepest));
    }
    let svg = plot::render(&chart(&bakes));
    files::write_atomically(&a.output_dir.join("bake_scaling.svg"), svg.as_bytes())?;
    let json = serde_json::to_string_pretty(&bakes).context("cannot encode the figures")?;
    files::write_atomically(&a.output_dir.join("bake_scaling.json"), json.as_bytes())?;
    say(text(&lines).trim_end());
    Ok(true)
}
