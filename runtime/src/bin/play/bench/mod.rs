//! `diaphane-play bench`: frame times along an orbit, one thing varied at a time, and beside other methods at equal error.

mod cells;
mod charts;
mod crossover;
mod error;
mod methods;
mod rivals;
mod search;

use crate::args::{BackendArg, SplatArg};
use crate::tell;
use anyhow::{Result, bail};
use cells::{Cell, cells, predicted, scene};
use clap::{Args, ValueEnum};
use diaphane_formats::asset::{self, Asset};
use diaphane_formats::files;
use diaphane_runtime::Error;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::{LightMode, Player};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  diaphane-play bench statue.dph --output statue.bench.json --plots charts
      everything; the rivals only where a GPU draws
  diaphane-play bench statue.dph --backend gpu --part rivals --frames 5
      from how many lights on splats beat a ray marcher at equal error on this adapter, be it a software one
  diaphane-play bench statue-1M.dph --also statue-100k.dph --also statue-10k.dph --part axes
      frame times against the number of samples too";

/// Options of the benchmark.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BenchArgs {
    /// The baked asset (*.dph)
    pub asset: PathBuf,
    /// What draws
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,
    /// How a GPU sums the kernels
    #[arg(long, value_enum, default_value_t = SplatArg::Auto)]
    pub splat: SplatArg,
    /// Frames of each cell, on an orbit around the object; one more before them is not timed
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub frames: u32,
    /// Cells that would take longer are skipped and named
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    pub limit: f64,
    /// What is measured
    #[arg(long, value_enum, default_value_t = Part::All)]
    pub part: Part,
    /// Bakes of the same object with other numbers of samples, for an axis of samples; may be given more than once
    #[arg(long, value_name = "A.dph")]
    pub also: Vec<PathBuf>,
    /// Columns and rows of the pictures in which methods are timed against each other
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub rival_size: u32,
    /// Write charts (SVG) to this folder, which is made if it is absent
    #[arg(long, value_name = "FOLDER")]
    pub plots: Option<PathBuf>,
    /// Write the table as JSON to this file
    #[arg(long, value_name = "B.json")]
    pub output: Option<PathBuf>,
}

/// Parts of the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Both, the rivals where a GPU draws
    All,
    /// Frame times, one thing varied at a time
    Axes,
    /// Splats, a ray marcher and a 3D grid of light at equal error, from 1 to 4,096 point lights
    Rivals,
}

/// What it took.
#[derive(Serialize)]
struct Row {
    #[serde(flatten)]
    cell: Cell,
    samples: u64,
    /// Median over the frames.
    frame_ms: f64,
    /// Medians, of the passes that the adapter's clock or the CPU times.
    pass_ms: BTreeMap<&'static str, f64>,
    splats_per_ray: f64,
    /// Lights evaluated one by one, folded, left out.
    single: usize,
    folded: usize,
    dark: usize,
}

impl Row {
    fn lighting_ms(&self) -> f64 {
        ["lighting", "fold", "slopes"].iter().filter_map(|p| self.pass_ms.get(p)).sum()
    }
}

#[derive(Serialize)]
struct Table {
    backend: &'static str,
    adapter: String,
    splat: Option<&'static str>,
    frames: u32,
    rows: Vec<Row>,
    skipped: Vec<Cell>,
    rivals: Option<rivals::Report>,
}

impl BenchArgs {
    /// A line on standard output. An error if nobody reads it any more and no file is to be written either.
    fn say(&self, line: &str) -> io::Result<()> {
        match writeln!(io::stdout(), "{line}") {
            Err(_) if self.output.is_some() || self.plots.is_some() => Ok(()),
            said => said,
        }
    }
}

/// Runs all cells and prints them.
pub fn run(args: &BenchArgs) -> Result<()> {
    if args.limit.is_nan() || args.limit <= 0.0 {
        bail!("--limit must be above 0, not {}", args.limit);
    }
    if let Some(output) = &args.output {
        for input in std::iter::once(&args.asset).chain(&args.also) {
            files::require_different(output, input)?;
        }
        files::require_writable(output)?;
    }
    if let Some(folder) = &args.plots {
        std::fs::create_dir_all(folder)
            .map_err(|e| anyhow::anyhow!("cannot make the folder '{}': {e}", folder.display()))?;
    }
    let assets: Vec<Asset> =
        std::iter::once(&args.asset).chain(&args.also).map(|p| asset::read(p)).collect::<Result<_, _>>()?;
    let mut player = Player::with_path(&assets[0], args.backend.into(), args.splat.into())?;
    if let Some(note) = player.note() {
        tell(&format!("note: {note}"));
    }
    let (backend, adapter) = player.describe();
    let splat = player.path().map(diaphane_runtime::gpu::SplatPath::name);
    args.say(&format!("{backend}, {adapter}{}", splat.map_or(String::new(), |s| format!(", {s}"))))?;
    let mut table = Table {
        backend,
        adapter,
        splat,
        frames: args.frames,
        rows: Vec::new(),
        skipped: Vec::new(),
        rivals: None,
    };
    // First, while the player is that of the asset.
    match args.part {
        Part::Axes => {}
        Part::All if backend != "gpu" => {
            tell(
                "note: the rivals need a GPU, a software adapter at least (--backend gpu); they are left out",
            );
        }
        Part::Rivals if backend != "gpu" => {
            bail!("the rivals need a GPU, a software adapter at least: add --backend gpu");
        }
        Part::All | Part::Rivals => match rivals::run(&assets[0], &mut player, args) {
            Ok(report) => table.rivals = Some(report),
            Err(e) if args.part == Part::All && matches!(e.downcast_ref(), Some(Error::Rival(_))) => {
                tell(&format!("note: {e}; they are left out"));
            }
            Err(e) => return Err(e),
        },
    }
    if args.part != Part::Rivals {
        axes(&assets, player, args, &mut table)?;
    }
    if let Some(output) = &args.output {
        let json = serde_json::to_string_pretty(&table)? + "\n";
        files::write_atomically(output, json.as_bytes())?;
    }
    if let Some(folder) = &args.plots {
        charts::write(folder, &table)?;
    }
    Ok(())
}

/// Measures the cells of all axes.
fn axes(assets: &[Asset], mut player: Player, args: &BenchArgs, table: &mut Table) -> Result<()> {
    args.say(&format!(
        "{:<22} {:>9} {:>6} {:>11} {:>9} {:>9} {:>11}",
        "axis", "samples", "lights", "pixels", "frame ms", "light ms", "splats/ray"
    ))?;
    let mut played = ((0, 0), assets[0].clone());
    for cell in cells(assets[0].level_sizes().len(), assets.len()) {
        if played.0 != (cell.asset, cell.level) {
            played = ((cell.asset, cell.level), assets[cell.asset].level(cell.level)?);
            player = Player::with_path(&played.1, args.backend.into(), args.splat.into())?;
        }
        if predicted(&table.rows, &cell) * f64::from(args.frames + 1) > args.limit {
            args.say(&format!(
                "{:<22} skipped: {} lights at {} x {} would take longer than {} s",
                cell.axis, cell.lights, cell.size[0], cell.size[1], args.limit
            ))?;
            table.skipped.push(cell);
            continue;
        }
        let row = measure(&mut player, &played.1, cell, args.frames)?;
        args.say(&format!(
            "{:<22} {:>9} {:>6} {:>11} {:>9.1} {:>9.1} {:>11.1}",
            cell.axis,
            row.samples,
            cell.lights,
            format!("{}x{}", cell.size[0], cell.size[1]),
            row.frame_ms,
            row.lighting_ms(),
            row.splats_per_ray
        ))?;
        table.rows.push(row);
    }
    Ok(())
}

fn measure(player: &mut Player, asset: &Asset, cell: Cell, frames: u32) -> Result<Row> {
    let (mut times, mut passes) = (Vec::new(), BTreeMap::<&'static str, Vec<f64>>::new());
    let mut last = None;
    for k in 0..=frames {
        let frame = Frame::new(&scene(asset, cell, f64::from(k) / f64::from(frames + 1)), &asset.info)?;
        let started = Instant::now();
        let rendered = player.render(&frame, LightMode::Baked)?;
        if k > 0 {
            times.push(started.elapsed().as_secs_f64() * 1e3);
            rendered.passes.iter().for_each(|(name, ms)| passes.entry(name).or_default().push(*ms));
        }
        last = Some(rendered);
    }
    let Some(last) = last else { bail!("no frame was drawn") };
    Ok(Row {
        cell,
        samples: asset.info.samples,
        frame_ms: median(times),
        pass_ms: passes.into_iter().map(|(name, times)| (name, median(times))).collect(),
        splats_per_ray: last.counters.splats_per_ray(),
        single: last.lights.single,
        folded: last.lights.folded,
        dark: last.lights.dark,
    })
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or_default()
}
