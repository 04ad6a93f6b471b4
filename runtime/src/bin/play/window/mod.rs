//! The window: looks at an asset under lights that can be moved, through the same passes as the headless player.

mod app;
mod frames;
mod health;
mod levels;
mod orbit;
mod pace;
mod panel;
mod reload;
mod save;
mod screen;
mod session;
mod sources;

use crate::args::Args;
use anyhow::{Context, Result, anyhow};
use app::App;
use diaphane_formats::files::{require_different, require_writable};
use diaphane_formats::{asset, scene};
use diaphane_runtime::framing::default_scene;
use diaphane_runtime::player::LightMode;
use session::Session;
use sources::Sources;
use std::path::PathBuf;
use winit::event_loop::EventLoop;

/// Draw this many frames, save what the window shows, and quit.
pub struct Errand {
    /// Frames to draw.
    pub frames: u32,
    /// Where the picture goes.
    pub file: PathBuf,
}

/// Opens the window and stays until it is closed.
///
/// # Errors
/// Unreadable files, no display, no adapter that can draw on it, a GPU that fails.
pub fn run(args: &Args) -> Result<()> {
    let errand = args.screenshot_after.as_deref().map(errand).transpose()?;
    if let Some(errand) = &errand {
        require_different(&errand.file, &args.asset)?;
        if let Some(scene) = &args.scene {
            require_different(&errand.file, scene)?;
        }
        require_writable(&errand.file)?;
    }
    // Before the files are read, so that no change escapes.
    let sources = Sources::new(&args.asset, args.scene.as_deref());
    let asset = asset::read(&args.asset)?;
    let scene = match &args.scene {
        Some(path) => scene::load(path)?,
        None => default_scene(&asset.info),
    };
    let mode = args.light.map_or(LightMode::Auto, Into::into);
    let edit = args.edit();
    let session = Session::new(asset, scene, mode, edit)?;
    if let Some(warning) = edit.warning() {
        crate::tell(&format!("warning: {warning}"));
    }
    let event_loop = EventLoop::new().map_err(|e| {
        // The reason follows the place in winit's source that noticed it.
        let text = e.to_string();
        let reason = text.rsplit(": ").next().unwrap_or(&text).trim_end_matches('.');
        anyhow!("no display to open a window on ({reason}); draw a picture with --output instead")
    })?;
    let title = args.asset.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut app = App::new(session, sources, title, errand, args.budget);
    event_loop.run_app(&mut app).context("the window failed")?;
    app.finish()
}

/// The two values of --screenshot-after.
fn errand(values: &[String]) -> Result<Errand> {
    let [frames, file] = values else {
        return Err(anyhow!("--screenshot-after needs a number and a file"));
    };
    let frames = frames.parse().ok().filter(|n| (1..=100_000).contains(n));
    let frames =
        frames.ok_or_else(|| anyhow!("--screenshot-after needs a number of frames within 1..100000"))?;
    let file = PathBuf::from(file);
    if !file.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(anyhow!("'{}': the screenshot's name must end in .png", file.display()));
    }
    Ok(Errand { frames, file })
}
