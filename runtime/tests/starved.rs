//! A GPU without memory for a picture: it is drawn in smaller tiles. A software adapter takes the memory of this program, which
//! the system can bound; without such an adapter or such bounds the test says "skipped" and passes.
#![cfg(target_os = "linux")]

#[path = "gpu/objects.rs"]
#[expect(dead_code, reason = "shared with the tests of the GPU")]
mod objects;

use diaphane_formats::{asset, picture};
use diaphane_runtime::gpu::{GpuDevice, instance};
use glam::DVec3;
use std::path::Path;
use std::process::{Command, Output};

/// The ball, which fills the picture, one ray a pixel: 417 MB of state.
fn scene(centre: DVec3) -> String {
    let at = |x: f64, y: f64, z: f64| (centre + DVec3::new(x, y, z)).to_array();
    format!(
        "[camera]\nposition = {:?}\ntarget = {:?}\nvertical_fov_degrees = 16\n[image]\nwidth = 1600\nheight = 1200\n\
         samples_per_pixel = 1\n[[lights]]\ntype = \"point\"\nposition = {:?}\nintensity = [20, 20, 20]\n",
        at(0.4, 0.6, 4.6),
        at(0.0, 0.0, 0.0),
        at(2.0, 3.0, 2.0)
    )
}

/// Draws the asset with so many kilobytes of addresses.
fn draw(folder: &Path, picture: &Path, kilobytes: Option<u32>) -> Output {
    let mut run = Command::new("sh");
    let limit = kilobytes.map_or_else(|| "unlimited".to_owned(), |k| k.to_string());
    run.args(["-c", &format!("ulimit -v {limit} && exec \"$@\""), "sh", env!("CARGO_BIN_EXE_diaphane-play")]);
    run.arg(folder.join("ball.dph")).arg("--scene").arg(folder.join("s.toml")).args(["--backend", "gpu"]);
    run.arg("--output").arg(picture).env("RUST_LOG", "warn").output().unwrap()
}

#[test]
fn what_does_not_fit_is_drawn_in_smaller_tiles() {
    match GpuDevice::open(&instance(), None) {
        Ok(gpu) if gpu.is_software() => {}
        Ok(gpu) => return tell(&format!("skipped: the memory of {} cannot be bounded", gpu.describe())),
        Err(e) => {
            assert!(
                std::env::var_os("DIAPHANE_REQUIRE_GPU").is_none_or(|v| v != "1"),
                "a GPU is required here: {e}"
            );
            return tell(&format!("skipped: no adapter ({e})"));
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ball.dph");
    let ball = objects::Object { spacing: 0.3, ..objects::ball() }.build();
    asset::write(&path, &ball).unwrap();
    std::fs::write(folder.path().join("s.toml"), scene(DVec3::from(ball.info.centre))).unwrap();
    let whole = folder.path().join("whole.exr");
    let run = draw(folder.path(), &whole, None);
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    let expected = picture::read_exr(&whole).unwrap();
    // How much driver and program take before the picture depends on the machine.
    let mut limit = 2.2e6;
    while limit > 4e5 {
        limit *= 0.9;
        let megabytes = limit as u32 / 1000;
        let tiled = folder.path().join("tiled.exr");
        let run = draw(folder.path(), &tiled, Some(megabytes * 1000));
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(!said.contains("panicked"), "{megabytes} MB: {said}");
        assert_eq!(run.status.code(), Some(0), "{megabytes} MB: {said}");
        if said.contains("1600 x 1200 pixels") && said.contains("smaller tiles") {
            let got = picture::read_exr(&tiled).unwrap();
            let peak = expected.pixels.as_flattened().iter().fold(0.0, |a: f32, b| a.max(*b));
            let pairs = expected.pixels.as_flattened().iter().zip(got.pixels.as_flattened());
            // Tiles round the corners of triangles differently.
            let differing = pairs.filter(|(a, b)| (**a - **b).abs() > 1e-5 * peak).count();
            assert!(
                peak > 0.0 && differing <= 3 * expected.pixels.len() / 10_000,
                "{differing} values differ"
            );
            println!("{megabytes} MB: {}, {differing} values differ", said.trim());
            return;
        }
    }
    panic!("it never ran out of memory");
}

/// Says why a test does nothing, past the test runner's capture of the print macros.
fn tell(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
