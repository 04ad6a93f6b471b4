//! The window under a virtual display. Without Xvfb or an adapter the test says "skipped" and passes, unless
//! DIAPHANE_REQUIRE_DISPLAY=1 or DIAPHANE_REQUIRE_GPU=1 ask it to fail.
#![cfg(feature = "window")]

#[path = "gpu/objects.rs"]
#[expect(dead_code, reason = "shared with the tests of the GPU")]
mod objects;

use diaphane_formats::asset;
use diaphane_runtime::gpu::{GpuDevice, instance};
use std::path::Path;
use std::process::{Command, Output};

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
