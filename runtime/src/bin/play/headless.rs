//! One picture and its timings, without a window.

use crate::args::{Args, LevelArg};
use crate::levels::Levels;
use crate::stats::Stats;
use anyhow::{Result, bail};
use diaphane_formats::files::{require_different, require_writable};
use diaphane_formats::picture::{Display, Picture, write_exr, write_png};
use diaphane_formats::{asset, scene};
use diaphane_runtime::frame::Frame;
use diaphane_runtime::framing::default_scene;
use diaphane_runtime::player::LightMode;
use std::path::Path;

/// How the picture is stored.
#[derive(Clone, Copy)]
enum Format {
    Exr,
    Png,
}

/// Draws `args.asset` to `output`.
pub fn run(args: &Args, output: &Path) -> Result<()> {
    let format = format_of(output)?;
    check_paths(args, output)?;
    args.edit().validate()?;
    if args.budget.is_some() && args.level != Some(LevelArg::Auto) {
        bail!("--budget chooses levels of detail itself: it needs --level auto");
    }
    let asset = match args.level {
        Some(LevelArg::One(level)) => asset::read_level(&args.asset, level)?,
        Some(LevelArg::Auto) | None => asset::read(&args.asset)?,
    };
    let scene = match &args.scene {
        Some(path) => scene::load(path)?,
        None => default_scene(&asset.info),
    };
    let frame = Frame::new(&scene, &asset.info)?;
    let marked = !frame.lights_marked().is_empty();
    let default = if marked { LightMode::Auto } else { LightMode::Baked };
    let mode: LightMode = args.light.map_or(default, Into::into);
    warn(&frame, &asset.info, mode);
    let mut levels = Levels::new(args, asset, &frame)?;
    let mut stats = Stats::new(levels.player()?, &frame, args.frames);
    if let Some(warning) = args.edit().warning() {
        crate::tell(&format!("warning: {warning}"));
    }
    let mut rendered = None;
    for _ in 0..args.frames {
        let (drawn, milliseconds) = levels.draw(&frame, mode)?;
        stats.add(milliseconds, &drawn);
        rendered = Some(drawn);
    }
    let Some(rendered) = rendered else { bail!("--frames must be at least 1") };
    write(output, &rendered.picture, format)?;
    let kept = levels.tell_budget();
    if let Some(path) = &args.stats {
        stats.write(&levels, kept, path)?;
    }
    Ok(())
}

fn format_of(output: &Path) -> Result<Format> {
    let extension = output.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "exr" => Ok(Format::Exr),
        "png" => Ok(Format::Png),
        _ => bail!("'{}': the picture's name must end in .exr or .png", output.display()),
    }
}

/// All that can be refused before anything is read or drawn.
fn check_paths(args: &Args, output: &Path) -> Result<()> {
    let inputs = || std::iter::once(&args.asset).chain(&args.scene);
    for input in inputs() {
        require_different(output, input)?;
    }
    require_writable(output)?;
    if let Some(stats) = &args.stats {
        for input in inputs() {
            require_different(stats, input)?;
        }
        if stats == output {
            bail!("'{}': picture and statistics need different files", output.display());
        }
        require_writable(stats)?;
    }
    Ok(())
}

fn warn(frame: &Frame, info: &asset::Info, mode: LightMode) {
    if frame.lights.is_empty() {
        crate::tell("warning: the scene has no lights; the picture will be black");
    }
    let inside = frame.lights_inside(info);
    if mode == LightMode::Baked && !inside.is_empty() {
        let list: Vec<String> = inside.iter().map(|i| (i + 1).to_string()).collect();
        crate::tell(&format!(
            "warning: light {} stands inside the object's bounding box, where baked depths run past it; use --light auto",
            list.join(", ")
        ));
    }
}

fn write(output: &Path, picture: &Picture, format: Format) -> Result<()> {
    match format {
        Format::Exr => write_exr(output, picture)?,
        Format::Png => write_png(output, picture, Display::automatic(picture))?,
    }
    Ok(())
}
