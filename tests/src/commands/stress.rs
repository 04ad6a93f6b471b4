//! `diaphane-validate stress`: the numerical stress suite.

use super::output::{say, tell};
use super::progress::Steps;
use anyhow::Context;
use diaphane_bake::progress::Silent;
use diaphane_formats::files::{require_writable, write_atomically};
use std::path::PathBuf;
use validation::stress::{self, Plan, Settings};

/// Which cells, and where to.
#[derive(clap::Args)]
#[command(
    after_help = "Meshes, media, lights and cameras at the ends of what numbers can hold. Every body is baked once; \
                        each of its cells must be finite, within the light that was put in, and as near to double \
                        precision as rounding allows; where there is a GPU it must agree with the CPU. Exit code 1 when \
                        a bound is broken.\n\nExamples:\n  diaphane-validate stress\n  diaphane-validate stress --subset \
                        --json stress.json\n  diaphane-validate stress --filter \"ring: albedo 1 g 0.99\""
)]
pub struct Arguments {
    /// A fixed part of the matrix, as tests run it
    #[arg(long)]
    subset: bool,
    /// Only cells whose name (see --list) holds this text
    #[arg(long, value_name = "TEXT", default_value = "")]
    filter: String,
    /// Leaves the GPU out
    #[arg(long)]
    no_gpu: bool,
    /// Writes every cell's figures to a file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print the cells' names and stop
    #[arg(long)]
    list: bool,
}

/// Runs and prints.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    let mut plan = if a.subset { Plan::subset() } else { Plan::full() };
    plan.filter(&a.filter);
    anyhow::ensure!(plan.cells() > 0, "no cell's name holds '{}'; --list shows them all", a.filter);
    if a.list {
        for (body, cells) in &plan.bodies {
            cells.iter().for_each(|cell| say(&format!("{}: {}", body.name(), cell.name())));
        }
        return Ok(true);
    }
    if let Some(path) = &a.json {
        require_writable(path)?;
    }
    let display = Steps::new(plan.bodies.len());
    let report = stress::run(&plan, Settings { gpu: !a.no_gpu }, &Silent, &|body, cells| {
        display.note(body);
        display.done(&format!("{body}: {cells} cells"));
    });
    display.finish();
    say(&report.text());
    if let Some(path) = &a.json {
        let text = serde_json::to_string_pretty(&report).context("the report cannot be written as JSON")?;
        write_atomically(path, text.as_bytes())?;
    }
    if report.failed() > 0 {
        tell(&format!("check failed: {} of {} cells", report.failed(), report.lines.len()));
    }
    Ok(report.failed() == 0)
}
