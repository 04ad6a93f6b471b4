//! `diaphane-play` without a window: what it writes, and what it refuses with exit code 2 and one line.

mod support;

use diaphane_formats::{asset, picture};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A fresh folder with `ball.dph` and `a.scene.toml`.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let ball = support::ball(0.3, glam::DVec3::ZERO, diaphane_formats::phase::Phase::Isotropic);
    asset::write(&folder.join("ball.dph"), &ball).unwrap();
    std::fs::write(folder.join("a.scene.toml"), SCENE).unwrap();
    folder
}

const SCENE: &str = "\
[camera]
position = [0.4, 0.6, 4.6]
target = [0, 0, 0]
vertical_fov_degrees = 28
[image]
width = 12
height = 10
samples_per_pixel = 2
[[lights]]
type = \"point\"
position = [3, 1, 1]
intensity = [30, 10, 6]
";

fn play(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_diaphane-play"));
    command.current_dir(folder).args(arguments).output().unwrap()
}

#[test]
fn plays_one_level() {
    let folder = folder("level");
    let mut ball = asset::read(&folder.join("ball.dph")).unwrap();
    let weight = vec![1.0; ball.samples.len() / 4];
    ball.levels.push(asset::Level { width_factor: 2.2, weight, error: None });
    asset::write(&folder.join("ball.dph"), &ball).unwrap();
    let arguments = ["ball.dph", "--scene", "a.scene.toml", "--backend", "cpu", "--output", "o.exr"];
    let level = |k: &str| play(&folder, &[&arguments[..], &["--stats", "s.json", "--level", k]].concat());
    for (k, samples) in [("0", ball.samples.len()), ("1", ball.samples.len() / 4)] {
        let done = level(k);
        assert!(done.status.success(), "{done:?}");
        let text = std::fs::read_to_string(folder.join("s.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(stats["samples"], samples);
    }
    let none = level("2");
    assert_eq!(none.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&none.stderr).contains("no level 2"), "{none:?}");
}

/// A budget that nothing keeps leads to the coarsest level, one that everything keeps to the finest, whatever the machine.
#[test]
fn a_budget_of_time_chooses_levels_and_says_which() {
    let folder = folder("budget");
    let mut ball = asset::read(&folder.join("ball.dph")).unwrap();
    let all = ball.samples.len();
    for (level, width_factor) in [(1, 2.2), (2, 3.0)] {
        let weight = vec![1.0; all >> (2 * level)];
        ball.levels.push(asset::Level { width_factor, weight, error: None });
    }
    asset::write(&folder.join("ball.dph"), &ball).unwrap();
    // So large that all samples are drawn where there is time.
    std::fs::write(
        folder.join("near.toml"),
        SCENE.replace("[0.4, 0.6, 4.6]", "[0, 0, 2.6]").replace("= 12", "= 99"),
    )
    .unwrap();
    let arguments =
        ["ball.dph", "--scene", "near.toml", "--backend", "cpu", "--output", "o.exr", "--stats", "s.json"];
    let draw = |more: &[&str]| {
        let done = play(&folder, &[&arguments[..], &["--level", "auto", "--frames", "80"], more].concat());
        assert!(done.status.success(), "{done:?}");
        let text = std::fs::read_to_string(folder.join("s.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
        (stats, String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (stats, said) = draw(&["--budget", "1e-6"]);
    let frames: Vec<u64> =
        stats["budget"]["frames"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
    assert!(
        frames.len() == 3 && frames.iter().all(|n| *n > 0) && frames.iter().sum::<u64>() == 80,
        "{frames:?}"
    );
    assert_eq!((&stats["budget"]["level"], &stats["samples"]), (&2.into(), &(all >> 4).into()));
    assert_eq!(stats["samples_drawn"], all >> 4);
    assert!(said.contains("for 0.000001 ms a frame: 0 in ") && said.contains("the last one 2"), "{said}");
    let (stats, _) = draw(&["--budget", "1e9"]);
    assert_eq!((&stats["budget"]["frames"][0], &stats["samples"]), (&80.into(), &all.into()));
    let (stats, said) = draw(&[]);
    assert!(stats["budget"].is_null() && said.contains("level of detail 0"), "{said}");
    for refused in
        [&["--budget", "5"][..], &["--budget", "5", "--level", "1"], &["--budget", "0", "--level", "auto"]]
    {
        let done = play(&folder, &[&arguments[..], refused].concat());
        assert_eq!(done.status.code(), Some(2), "{refused:?}");
        assert_eq!(String::from_utf8_lossy(&done.stderr).trim_end().lines().count(), 1, "{done:?}");
    }
}

#[test]
fn benchmarks_name_what_they_skip() {
    let folder = folder("bench");
    let arguments = ["bench", "ball.dph", "--backend", "cpu", "--frames", "1"];
    // So short that only the first cell of each axis runs.
    let done = play(&folder, &[&arguments[..], &["--limit", "1e-6", "--output", "b.json"]].concat());
    assert!(done.status.success(), "{done:?}");
    let table: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("b.json")).unwrap()).unwrap();
    let (rows, skipped) = (table["rows"].as_array().unwrap(), table["skipped"].as_array().unwrap());
    assert_eq!((rows.len(), skipped.len()), (4, 6 + 6 + 5));
    assert!(
        rows.iter()
            .all(|r| r["frame_ms"].as_f64().unwrap() > 0.0 && r["splats_per_ray"].as_f64().unwrap() > 0.0)
    );
    assert!(String::from_utf8_lossy(&done.stdout).contains("skipped: 4096 lights"));
    let refused = play(&folder, &[&arguments[..], &["--limit", "0"]].concat());
    assert_eq!(refused.status.code(), Some(2));
    let refused = play(&folder, &[&arguments[..], &["--part", "rivals"]].concat());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("add --backend gpu"), "{refused:?}");
}

#[test]
fn benchmarks_draw_charts_and_compare_bakes() {
    let folder = folder("charts");
    std::fs::copy(folder.join("ball.dph"), folder.join("other.dph")).unwrap();
    let arguments = ["bench", "ball.dph", "--backend", "cpu", "--frames", "1", "--limit", "1e-6"];
    let more = ["--also", "other.dph", "--plots", "charts", "--output", "b.json"];
    let done = play(&folder, &[&arguments[..], &more].concat());
    assert!(done.status.success(), "{done:?}");
    assert!(String::from_utf8_lossy(&done.stderr).contains("the rivals need a GPU"), "{done:?}");
    let table: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("b.json")).unwrap()).unwrap();
    let samples =
        |key: &str| table[key].as_array().unwrap().iter().filter(|c| c["axis"] == "samples").count();
    assert_eq!((samples("rows"), samples("skipped")), (1, 1));
    for chart in ["lights", "resolution", "samples"] {
        let text = std::fs::read_to_string(folder.join(format!("charts/{chart}.svg"))).unwrap();
        assert!(text.starts_with("<svg") && text.contains("threads"), "{chart}");
    }
    let refused = play(&folder, &[&arguments[..], &["--also", "b.json", "--output", "b.json"]].concat());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("both input and output"), "{refused:?}");
}

/// Passes where there is no adapter, once that was said in a line.
#[test]
fn rivals_are_compared_at_equal_error() {
    let folder = folder("rivals");
    let arguments = ["bench", "ball.dph", "--backend", "gpu", "--part", "rivals", "--frames", "1"];
    let more = ["--limit", "20", "--rival-size", "32", "--output", "b.json", "--plots", "charts"];
    let done = play(&folder, &[&arguments[..], &more].concat());
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    if done.status.code() == Some(2) && said.contains("no usable GPU adapter") {
        return;
    }
    assert!(done.status.success(), "{done:?}");
    let table: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("b.json")).unwrap()).unwrap();
    let rivals = &table["rivals"];
    assert!(rivals["adapter"].is_string() && rivals["crossovers"].as_array().unwrap().len() == 2);
    let rows = rivals["rows"].as_array().unwrap();
    let row = |method: &str| rows.iter().find(|r| r["method"] == method && r["lights"] == 1).unwrap();
    let error = |method: &str| row(method)["rel_rmse"].as_f64().unwrap();
    assert!(error("march") <= error("splats") && row("march")["effort"]["steps"].as_u64().unwrap() > 0);
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(text.contains("against the ray marcher: ") && text.contains("against the 3D grid: "), "{text}");
    assert!(std::fs::read_to_string(folder.join("charts/rivals.svg")).unwrap().contains("ray marcher"));
}

#[test]
fn writes_picture_and_statistics() {
    let folder = folder("writes");
    let arguments = ["ball.dph", "--scene", "a.scene.toml", "--backend", "cpu", "--frames", "3"];
    let done = play(&folder, &[&arguments[..], &["--output", "o.exr", "--stats", "s.json"]].concat());
    assert!(done.status.success(), "{done:?}");
    let picture = picture::read_exr(&folder.join("o.exr")).unwrap();
    assert_eq!((picture.width, picture.height), (12, 10));
    let coverage = picture.coverage.unwrap();
    assert!(coverage[0] == 0.0 && coverage[5 * 12 + 6] == 1.0 && picture.pixels[5 * 12 + 6][0] > 0.0);
    let text = std::fs::read_to_string(folder.join("s.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(stats["backend"], "cpu");
    assert_eq!((&stats["width"], &stats["lights"], &stats["frames"]), (&12.into(), &1.into(), &3.into()));
    for key in ["adapter", "height", "samples", "samples_drawn", "splats_per_pixel", "pass_ms", "counters"] {
        assert!(!stats[key].is_null(), "{key}");
    }
    // Two rays for each of 12 x 10 pixels, which all kernels of the ball reach into; a CPU has no shards.
    let census = &stats["counters"]["census"];
    assert_eq!((&census["views"], &census["tiles"]), (&2.into(), &2.into()), "{census}");
    assert_eq!(census["samples_shown"].as_u64(), stats["samples"].as_u64().map(|n| 2 * n), "{census}");
    for key in ["shards", "splat", "splat_why", "clock", "budget"] {
        assert!(stats.get(key).is_some_and(serde_json::Value::is_null), "{key}");
    }
    assert_eq!(stats["notes"], serde_json::json!([]));
    for time in ["min", "median", "max"] {
        assert!(stats["frame_ms"][time].is_number() && stats["pass_ms"]["splat"][time].is_number());
    }
    let png = play(&folder, &[&arguments[..], &["--output", "o.png", "--reuse"]].concat());
    assert!(png.status.success());
    assert!(std::fs::read(folder.join("o.png")).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn lights_that_a_scene_marks_are_exact_unless_baked_light_is_asked_for() {
    let folder = folder("marked");
    std::fs::write(folder.join("m.scene.toml"), format!("{SCENE}exact = true\n")).unwrap();
    let exact = |scene: &str, light: &[&str]| {
        let arguments =
            ["ball.dph", "--scene", scene, "--backend", "cpu", "--output", "o.exr", "--stats", "s.json"];
        let done = play(&folder, &[&arguments[..], light].concat());
        assert!(done.status.success(), "{done:?}");
        let text = std::fs::read_to_string(folder.join("s.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
        let report = &stats["exact"];
        let (exact, baked) = (report["exact"].as_u64().unwrap(), report["baked"].as_u64().unwrap());
        assert_eq!(report["rays"].as_u64().unwrap(), exact * stats["samples"].as_u64().unwrap());
        assert_eq!(report["errors"].as_array().unwrap().len() as u64, exact);
        assert!(exact == 0 || report["errors"][0]["relative"].as_f64().unwrap() > 0.0);
        (exact, baked)
    };
    assert_eq!(exact("a.scene.toml", &[]), (0, 1));
    assert_eq!(exact("a.scene.toml", &["--light", "exact"]), (1, 0));
    assert_eq!(exact("m.scene.toml", &[]), (1, 0));
    assert_eq!(exact("m.scene.toml", &["--light", "auto"]), (1, 0));
    assert_eq!(exact("m.scene.toml", &["--light", "baked"]), (0, 1));
}

#[test]
fn plays_another_material() {
    let folder = folder("edits");
    let draw = |name: &str, more: &[&str]| {
        let arguments = ["ball.dph", "--scene", "a.scene.toml", "--backend", "cpu", "--output", name];
        let done = play(&folder, &[&arguments[..], &["--stats", "s.json"], more].concat());
        assert!(done.status.success(), "{done:?}");
        let text = std::fs::read_to_string(folder.join("s.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
        let pixels = picture::read_exr(&folder.join(name)).unwrap().pixels;
        (pixels, stats, String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (baked, stats, _) = draw("a.exr", &[]);
    assert_eq!(stats["extinction"], serde_json::json!([4.0, 4.0, 4.0]));
    assert_eq!(stats["albedo"], serde_json::json!([0.8, 0.6, 0.4]));
    let edit = ["--extinction-scale", "0.75,1,1.5", "--albedo", "0.4"];
    let (edited, stats, said) = draw("b.exr", &edit);
    assert_eq!(stats["extinction"], serde_json::json!([3.0, 4.0, 6.0]));
    assert_eq!(stats["albedo"], serde_json::json!([0.4, 0.4, 0.4]));
    assert!(baked != edited && !said.contains("warning"), "{said}");
    // Far from the baked medium: drawn, and said.
    let (_, _, said) = draw("c.exr", &["--extinction-scale", "100"]);
    assert!(said.contains("warning: the extinction scale") && said.contains("0.6..1.8"), "{said}");
}

#[test]
fn no_lights_is_black_with_a_warning() {
    let folder = folder("dark");
    let dark = SCENE.split("[[lights]]").next().unwrap();
    std::fs::write(folder.join("dark.toml"), dark).unwrap();
    let arguments = ["ball.dph", "--scene", "dark.toml", "--backend", "cpu", "--output", "o.exr"];
    let done = play(&folder, &arguments);
    assert!(done.status.success() && String::from_utf8_lossy(&done.stderr).contains("no lights"));
    let picture = picture::read_exr(&folder.join("o.exr")).unwrap();
    assert!(picture.pixels.iter().flatten().all(|v| *v == 0.0));
}

#[test]
fn refuses_bad_input_in_one_line() {
    let folder = folder("refuses");
    let write = |name: &str, text: String| std::fs::write(folder.join(name), text).unwrap();
    write("zero.toml", SCENE.replace("width = 12", "width = 0"));
    write("misspelt.toml", SCENE.replace("width = 12", "widht = 12"));
    write("on_target.toml", SCENE.replace("[0.4, 0.6, 4.6]", "[0, 0, 0]"));
    write("scene.png", SCENE.to_owned());
    let bytes = std::fs::read(folder.join("ball.dph")).unwrap();
    std::fs::write(folder.join("cut.dph"), &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(folder.join("input.exr"), &bytes).unwrap();
    let cases: [(&[&str], &str); 13] = [
        (&["missing.dph", "--output", "o.png"], "missing.dph"),
        (&["cut.dph", "--output", "o.png"], "cut.dph"),
        (&["a.scene.toml", "--output", "o.png"], "a.scene.toml"),
        (&["ball.dph", "--output", "o.jpg"], ".exr or .png"),
        (&["ball.dph", "--output", "nowhere/o.png"], "cannot write"),
        (&["input.exr", "--output", "./input.exr"], "both input and output"),
        (&["ball.dph", "--scene", "scene.png", "--output", "scene.png"], "both input and output"),
        (&["ball.dph", "--scene", "zero.toml", "--output", "o.png"], "image.width"),
        (&["ball.dph", "--scene", "misspelt.toml", "--output", "o.png"], "'width'"),
        (&["ball.dph", "--output", "o.png", "--extinction-scale", "-1"], "extinction scale must lie"),
        (&["ball.dph", "--output", "o.png", "--albedo", "0.5,2,0"], "albedo must lie within 0..1"),
        (&["ball.dph", "--output", "o.png", "--albedo", "0.5,red,0"], "'red' is not a number"),
        (&["ball.dph", "--scene", "on_target.toml", "--output", "o.png"], "same point"),
    ];
    for (arguments, expected) in cases {
        let done = play(&folder, arguments);
        let said = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(expected) && said.trim_end().lines().count() == 1, "{arguments:?}: {said}");
        assert!(!folder.join("o.png").exists(), "{arguments:?}");
    }
    for arguments in [["ball.dph", "--output", "o.png", "--frames", "0"], ["ball.dph", "-x", "", "", ""]] {
        assert_eq!(play(&folder, &arguments).status.code(), Some(2));
    }
}
