//! The window under a virtual display. Without Xvfb or an adapter the test says "skipped" and passes, unless
//! DIAPHANE_REQUIRE_DISPLAY=1 or DIAPHANE_REQUIRE_GPU=1 ask it to fail.
#![cfg(feature = "window")]

#[path = "gpu/objects.rs"]
#[expect(dead_code, reason = "shared with the tests of the GPU")]
mod objects;

use diaphane_formats::asset;
use diaphane_runtime::gpu::{GpuDevice, instance};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

const PLAY: &str = env!("CARGO_BIN_EXE_diaphane-play");

fn required(what: &str) -> bool {
    std::env::var_os(format!("DIAPHANE_REQUIRE_{what}")).is_some_and(|v| v == "1")
}

/// Writes a small asset and says where.
fn ball(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("ball.dph");
    asset::write(&path, &objects::Object { spacing: 0.2, ..objects::ball() }.build()).unwrap();
    path
}

/// Standard error without what the system's libraries print there on their own.
fn complaints(output: &Output) -> Vec<String> {
    let text = String::from_utf8_lossy(&output.stderr);
    text.lines().filter(|l| !l.contains("XDG_RUNTIME_DIR")).map(str::to_owned).collect()
}

#[test]
fn opens_draws_and_shows_the_object_beside_the_panel() {
    if let Err(e) = GpuDevice::open(&instance(), None) {
        assert!(!required("GPU"), "a GPU is required here: {e}");
        tell(&format!("skipped: no adapter ({e})"));
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shot = folder.path().join("shot.png");
    let run = Command::new("xvfb-run")
        .args(["-a", "-s", "-screen 0 1280x1024x24", PLAY])
        .arg(ball(folder.path()))
        .args(["--screenshot-after", "3"])
        .arg(&shot)
        .output();
    let output = match run {
        Ok(output) => output,
        Err(e) => {
            assert!(!required("DISPLAY"), "xvfb-run is required here: {e}");
            tell(&format!("skipped: no virtual display ({e})"));
            return;
        }
    };
    assert_eq!(output.status.code(), Some(0), "{:?}", complaints(&output));
    assert!(complaints(&output).is_empty(), "{:?}", complaints(&output));
    let picture = image::open(&shot).unwrap().to_rgb8();
    let (width, height) = picture.dimensions();
    assert!(width >= 800 && height >= 500, "{width} x {height}");
    let light = |x: u32, y: u32| picture.get_pixel(x, y).0.iter().map(|v| u32::from(*v)).sum::<u32>();
    // The picture takes what the panel's 300 points leave: the ball in its middle, nothing in its corner.
    let middle = (width - 300) / 2;
    assert!(light(middle, height / 2) > 60, "the ball shows");
    assert_eq!(light(2, 2), 0, "nothing is drawn around it");
    let panel = (0..height).flat_map(|y| (width - 290..width - 10).map(move |x| (x, y)));
    assert!(panel.filter(|&(x, y)| light(x, y) > 300).count() > 500, "the panel has text");
}

/// Shows an asset and a scene for many frames while both are replaced: by good ones until that is told, then by broken ones, then by
/// good ones again. What it says, line by line.
#[test]
fn files_that_change_are_shown_and_broken_ones_are_not() {
    let software = match GpuDevice::open(&instance(), None) {
        Ok(gpu) => gpu.is_software(),
        Err(e) => {
            assert!(!required("GPU"), "a GPU is required here: {e}");
            return tell(&format!("skipped: no adapter ({e})"));
        }
    };
    // Long enough for files to be replaced meanwhile.
    let frames = if software { "200" } else { "1000" };
    let folder = tempfile::tempdir().unwrap();
    let (asset, scene) = (ball(folder.path()), folder.path().join("s.toml"));
    let text = |light: f64| {
        format!(
            "[camera]\nposition = [11, -19, 9]\ntarget = [10, -20, 5]\nvertical_fov_degrees = 36\n[image]\nwidth = 64\n\
             height = 64\nsamples_per_pixel = 1\n[[lights]]\ntype = \"directional\"\ndirection = [0, 0, -1]\n\
             irradiance = [{light}, {light}, {light}]\n"
        )
    };
    std::fs::write(&scene, text(1.0)).unwrap();
    let shot = folder.path().join("shot.png");
    let run = Command::new("xvfb-run")
        .args(["-a", "-s", "-screen 0 1280x1024x24", PLAY])
        .arg(&asset)
        .arg("--scene")
        .arg(&scene)
        .args(["--screenshot-after", frames])
        .arg(&shot)
        .stderr(Stdio::piped())
        .spawn();
    let mut run = match run {
        Ok(run) => run,
        Err(e) => {
            assert!(!required("DISPLAY"), "xvfb-run is required here: {e}");
            return tell(&format!("skipped: no virtual display ({e})"));
        }
    };
    let (said, lines) = std::sync::mpsc::channel();
    let from = BufReader::new(run.stderr.take().unwrap());
    let reader =
        std::thread::spawn(move || from.lines().map_while(Result::ok).for_each(|l| drop(said.send(l))));
    let mut heard = Vec::new();
    // Does something until a line with both parts comes.
    let mut until = |parts: [&str; 2], change: &mut dyn FnMut()| {
        let started = Instant::now();
        while started.elapsed() < Duration::from_secs(60) {
            change();
            // Longer than the window waits for a file to rest.
            match lines.recv_timeout(Duration::from_millis(1500)) {
                Ok(line) => {
                    let found = parts.iter().all(|p| line.contains(p));
                    heard.push(line);
                    if found {
                        return;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        panic!("{parts:?} never came after {heard:?}");
    };
    let good = std::fs::read(&asset).unwrap();
    let other = folder.path().join("other");
    let replace = |path: &Path, bytes: &[u8]| {
        std::fs::write(&other, bytes).unwrap();
        std::fs::rename(&other, path).unwrap();
    };
    until(["ball.dph", "again"], &mut || replace(&asset, &good));
    until(["ball.dph", "stays"], &mut || replace(&asset, &good[..good.len() / 2]));
    until(["s.toml", "stays"], &mut || replace(&scene, b"[camera]"));
    until(["s.toml", "again"], &mut || replace(&scene, text(2.0).as_bytes()));
    std::fs::remove_file(&asset).unwrap();
    until(["ball.dph", "No such file"], &mut || {});
    assert!(run.wait().unwrap().success(), "{heard:?}");
    reader.join().unwrap();
    let picture = image::open(&shot).unwrap().to_rgb8();
    let middle = picture.get_pixel((picture.width() - 300) / 2, picture.height() / 2).0;
    assert!(middle.iter().map(|v| u32::from(*v)).sum::<u32>() > 60, "the ball shows: {middle:?}");
}

#[test]
fn without_a_display_there_is_one_clear_line() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(PLAY)
        .arg(ball(folder.path()))
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let lines = complaints(&output);
    assert!(lines.len() == 1 && lines[0].contains("display") && lines[0].contains("--output"), "{lines:?}");
}

#[test]
fn a_screenshot_needs_a_number_and_a_png() {
    let folder = tempfile::tempdir().unwrap();
    let asset = ball(folder.path());
    for (frames, file) in [("0", "a.png"), ("many", "a.png"), ("2", "a.exr")] {
        let run = Command::new(PLAY).arg(&asset).args(["--screenshot-after", frames, file]).output().unwrap();
        assert_eq!((run.status.code(), complaints(&run).len()), (Some(2), 1), "{frames} {file}");
    }
}

/// Says why a test does nothing, past the test runner's capture of the print macros.
fn tell(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
