//! `diaphane-play bench`: frame times along an orbit, one thing varied at a time.

use crate::args::{BackendArg, SplatArg};
use anyhow::{Result, bail};
use clap::Args;
use diaphane_formats::asset::{self, Asset};
use diaphane_formats::directions::even_directions;
use diaphane_formats::files;
use diaphane_formats::scene::{Light, Scene};
use diaphane_runtime::frame::Frame;
use diaphane_runtime::framing::default_scene;
use diaphane_runtime::player::{LightMode, Player};
use glam::{DQuat, DVec3};
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::Instant;

/// Options of the benchmark.
#[derive(Debug, Args)]
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
    /// Write the table as JSON to this file
    #[arg(long, value_name = "B.json")]
    pub output: Option<PathBuf>,
}

const LIGHTS: [usize; 7] = [1, 4, 16, 64, 256, 1024, 4096];
const SIZES: [[u32; 2]; 6] = [[256, 256], [512, 512], [800, 800], [1024, 1024], [1920, 1080], [3840, 2160]];
/// Of the cells that vary something else.
const SIZE: [u32; 2] = [800, 800];

/// What a cell draws.
#[derive(Clone, Copy, Serialize)]
struct Cell {
    axis: &'static str,
    lights: usize,
    directional: bool,
    level: usize,
    size: [u32; 2],
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
}

/// Runs all cells and prints them.
pub fn run(args: &BenchArgs) -> Result<()> {
    if args.limit.is_nan() || args.limit <= 0.0 {
        bail!("--limit must be above 0, not {}", args.limit);
    }
    if let Some(output) = &args.output {
        files::require_different(output, &args.asset)?;
        files::require_writable(output)?;
    }
    let asset = asset::read(&args.asset)?;
    let mut player = Player::with_path(&asset, args.backend.into(), args.splat.into())?;
    if let Some(note) = player.note() {
        eprintln!("note: {note}");
    }
    let (backend, adapter) = player.describe();
    let splat = player.path().map(diaphane_runtime::gpu::SplatPath::name);
    println!("{backend}, {adapter}{}", splat.map_or(String::new(), |s| format!(", {s}")));
    println!(
        "{:<22} {:>9} {:>6} {:>11} {:>9} {:>9} {:>11}",
        "axis", "samples", "lights", "pixels", "frame ms", "light ms", "splats/ray"
    );
    let mut table =
        Table { backend, adapter, splat, frames: args.frames, rows: Vec::new(), skipped: Vec::new() };
    let mut level = (0, asset.clone());
    for cell in cells(asset.level_sizes().len()) {
        if level.0 != cell.level {
            level = (cell.level, asset.level(cell.level)?);
            player = Player::with_path(&level.1, args.backend.into(), args.splat.into())?;
        }
        if predicted(&table.rows, &cell) * f64::from(args.frames + 1) > args.limit {
            println!(
                "{:<22} skipped: {} lights at {} x {} would take longer than {} s",
                cell.axis, cell.lights, cell.size[0], cell.size[1], args.limit
            );
            table.skipped.push(cell);
            continue;
        }
        let row = measure(&mut player, &level.1, cell, args.frames)?;
        println!(
            "{:<22} {:>9} {:>6} {:>11} {:>9.1} {:>9.1} {:>11.1}",
            cell.axis,
            row.samples,
            cell.lights,
            format!("{}x{}", cell.size[0], cell.size[1]),
            row.frame_ms,
            row.lighting_ms(),
            row.splats_per_ray
        );
        table.rows.push(row);
    }
    if let Some(output) = &args.output {
        let json = serde_json::to_string_pretty(&table)? + "\n";
        files::write_atomically(output, json.as_bytes())?;
    }
    Ok(())
}

/// All cells, those of an axis in rising order of cost; levels of detail last, because each needs a player of its own.
fn cells(levels: usize) -> Vec<Cell> {
    let base = Cell { axis: "", lights: 1, directional: false, level: 0, size: SIZE };
    let point = LIGHTS.map(|lights| Cell { axis: "point lights", lights, ..base });
    let suns = LIGHTS.map(|lights| Cell { axis: "directional lights", lights, directional: true, ..base });
    let sizes = SIZES.map(|size| Cell { axis: "resolution", size, ..base });
    let levels = (0..levels).map(|level| Cell { axis: "level of detail", level, ..base });
    point.into_iter().chain(suns).chain(sizes).chain(levels).collect()
}

/// Seconds of a frame, from the cell before on the same axis: all of it grows with the pixels, lighting with the lights.
fn predicted(rows: &[Row], cell: &Cell) -> f64 {
    let pixels = |c: &Cell| f64::from(c.size[0]) * f64::from(c.size[1]);
    let Some(before) = rows.last().filter(|r| r.cell.axis == cell.axis) else { return 0.0 };
    let larger = (pixels(cell) / pixels(&before.cell)).max(1.0);
    // Clocks of software adapters miss parts of a pass.
    let light = before.lighting_ms().max(0.02 * before.frame_ms);
    let more = cell.lights as f64 / before.cell.lights as f64 - 1.0;
    1e-3 * (before.frame_ms * larger + light * more.max(0.0))
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

/// The default view, turned by a part of a circle; lights in even directions turn the other way, so that they move in every
/// frame. Their sum stays the same.
fn scene(asset: &Asset, cell: Cell, turn: f64) -> Scene {
    let mut scene = default_scene(&asset.info);
    let centre = DVec3::from(asset.info.centre);
    let around = DQuat::from_rotation_y(TAU * turn);
    scene.camera.position = centre + around * (scene.camera.position - centre);
    scene.image.samples_per_pixel = 1;
    [scene.image.width, scene.image.height] = cell.size;
    let distance = 1.5 * f64::from(asset.info.diagonal());
    let share = DVec3::splat(4.0 / cell.lights as f64);
    let light = |d: DVec3| {
        let d = around.inverse() * d;
        if cell.directional {
            Light::Directional { direction: -d, irradiance: share }
        } else {
            Light::Point { position: centre + distance * d, intensity: share * distance * distance }
        }
    };
    scene.lights = even_directions(cell.lights.max(2), 0).into_iter().take(cell.lights).map(light).collect();
    scene
}
