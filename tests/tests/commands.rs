//! What the validation program does with good input, from the outside.

mod support;
#[path = "support/workbench.rs"]
mod workbench;

use diaphane_formats::picture::{Picture, read_exr, write_exr};
use std::process::Output;
use workbench::{SCENE, Workbench};

fn validate(bench: &Workbench, arguments: &[&str]) -> Output {
    bench.run("validate", arguments).unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const INPUTS: [&str; 5] = ["ball.obj", "--material", "m.toml", "--scene", "s.toml"];

#[test]
fn reference_writes_radiance_and_coverage() {
    let bench = Workbench::new();
    let arguments = [&["reference"], &INPUTS[..], &["--output", "r.exr", "--tolerance", "0.02"]].concat();
    let done = validate(&bench, &arguments);
    assert!(done.status.success(), "{done:?}");
    assert!(text(&done.stdout).contains("noise"));
    let picture = read_exr(&bench.path("r.exr")).unwrap();
    assert_eq!((picture.width, picture.height), (40, 32));
    let coverage = picture.coverage.unwrap();
    assert!(
        coverage.contains(&1.0) && coverage.contains(&0.0) && coverage.iter().any(|c| *c > 0.0 && *c < 1.0)
    );
    // The same seed gives the same bytes, another seed other noise.
    let first = std::fs::read(bench.path("r.exr")).unwrap();
    validate(&bench, &arguments);
    assert_eq!(std::fs::read(bench.path("r.exr")).unwrap(), first);
    validate(&bench, &[&arguments[..], &["--seed", "7"]].concat());
    assert_ne!(std::fs::read(bench.path("r.exr")).unwrap(), first);
}

#[test]
fn a_scene_without_lights_is_black_with_a_warning() {
    let bench = Workbench::new();
    bench.write("s.toml", SCENE.split("[[lights]]").next().unwrap());
    let done = validate(&bench, &[&["reference"], &INPUTS[..], &["--output", "r.exr"]].concat());
    assert!(done.status.success());
    assert!(text(&done.stderr).contains("no lights"));
    assert_eq!(support::brightest(&read_exr(&bench.path("r.exr")).unwrap()), 0.0);
}

#[test]
fn compare_says_which_coverage_it_used() {
    let bench = Workbench::new();
    let mut reference = Picture::new(2, 1);
    reference.pixels = vec![[1.0; 3], [2.0; 3]];
    let mut image = reference.clone();
    image.pixels[1] = [1.0; 3];
    write_exr(&bench.path("i.exr"), &image).unwrap();
    write_exr(&bench.path("r.exr"), &reference).unwrap();
    reference.coverage = Some(vec![1.0, 0.5]);
    write_exr(&bench.path("alpha.exr"), &reference).unwrap();
    let json = |arguments: &[&str]| -> serde_json::Value {
        let done = validate(&bench, arguments);
        assert!(done.status.success(), "{done:?}");
        serde_json::from_slice(&done.stdout).unwrap()
    };
    // All pixels: √(mean(0, 1) / mean(1, 4)) = √(1/5). With alpha only the first, which is right.
    let all = json(&["compare", "i.exr", "r.exr", "--json"]);
    assert!((all["rel_rmse"].as_f64().unwrap() - 0.2f64.sqrt()).abs() < 1e-9);
    assert!(all["coverage"].as_str().unwrap().contains("above 0"));
    let alpha = json(&["compare", "i.exr", "alpha.exr", "--json"]);
    assert_eq!((alpha["rel_rmse"].as_f64(), alpha["pixels"].as_u64()), (Some(0.0), Some(1)));
    assert!(alpha["coverage"].as_str().unwrap().contains("alpha"));
    let file = json(&["compare", "i.exr", "r.exr", "--coverage", "alpha.exr", "--json"]);
    assert_eq!(file["pixels"].as_u64(), Some(1));
    assert!(file["coverage"].as_str().unwrap().contains("alpha.exr"));
    for key in ["psnr_db", "bias", "p99_rel", "non_finite"] {
        assert!(all[key].is_number(), "{key}");
    }
    assert!(text(&validate(&bench, &["compare", "i.exr", "r.exr"]).stdout).contains("rel_rmse   0.44721"));
    // A picture with values that are not finite fails the check.
    image.pixels[0] = [f32::NAN; 3];
    write_exr(&bench.path("nan.exr"), &image).unwrap();
    assert_eq!(validate(&bench, &["compare", "nan.exr", "r.exr"]).status.code(), Some(1));
}

#[test]
fn image_writes_pictures_map_and_report_and_judges() {
    let bench = Workbench::new();
    let inputs = [&["image", "ball.dph"], &INPUTS[..], &["--tolerance", "0.02", "--backend", "cpu"]].concat();
    let done = validate(&bench, &[&inputs[..], &["--output-dir", "o", "--max-error", "0.5"]].concat());
    assert!(done.status.success(), "{done:?}");
    let files = [
        "played.exr",
        "played.png",
        "reference.exr",
        "reference.png",
        "error.png",
        "report.html",
        "report.json",
    ];
    for name in files {
        assert!(bench.path("o").join(name).is_file(), "{name}");
    }
    let html = std::fs::read_to_string(bench.path("o/report.html")).unwrap();
    assert_eq!(html.matches("src=\"data:image/png;base64,").count(), 3);
    // Nothing is loaded from elsewhere.
    assert!(!html.contains("http") && !html.contains("<script") && !html.contains("<link"));
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(bench.path("o/report.json")).unwrap()).unwrap();
    let error = json[0]["metrics"]["rel_rmse"].as_f64().unwrap();
    assert!(error > 0.0 && error < 0.5);
    // The same picture as the player's own, and the same figures as compare's.
    let compared = validate(&bench, &["compare", "o/played.exr", "o/reference.exr", "--json"]);
    let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert!((compared["rel_rmse"].as_f64().unwrap() - error).abs() < 1e-6);
    // One below, the other above.
    let strict = format!("{}", error * 0.99);
    let done = validate(&bench, &[&inputs[..], &["--output-dir", "o", "--max-error", &strict]].concat());
    assert_eq!(done.status.code(), Some(1), "{done:?}");
    assert!(text(&done.stderr).contains("check failed"));
}

#[test]
fn image_edits_player_and_reference_alike() {
    let bench = Workbench::new();
    let inputs = [&["image", "ball.dph"], &INPUTS[..], &["--tolerance", "0.02", "--backend", "cpu"]].concat();
    let edit = ["--extinction-scale", "2,1,1", "--albedo", "0.4,0.7,0.6", "--output-dir", "e"];
    let error = |arguments: &[&str], folder: &str| -> f64 {
        let done = validate(&bench, arguments);
        assert!(done.status.success(), "{done:?}");
        let bytes = std::fs::read(bench.path(folder).join("report.json")).unwrap();
        serde_json::from_slice::<serde_json::Value>(&bytes).unwrap()[0]["metrics"]["rel_rmse"]
            .as_f64()
            .unwrap()
    };
    // Half the albedo on one side alone would make red, the brightest channel, twice as bright there: an error of
    // 0.5 or 1 in half of the radiance. So few samples are off by 0.07 by themselves.
    let edited = error(&[&inputs[..], &edit[..]].concat(), "e");
    assert!(edited < 0.15, "{edited}");
    // The same reference from a material file that says so: [3, 2, 1] · [2, 1, 1], to the bit.
    bench.write("m.toml", "extinction = [6, 2, 1]\nalbedo = [0.4, 0.7, 0.6]\n");
    let arguments = [&["reference"], &INPUTS[..], &["--output", "r.exr", "--tolerance", "0.02"]].concat();
    assert!(validate(&bench, &arguments).status.success());
    let pixels = |name: &str| read_exr(&bench.path(name)).unwrap().pixels;
    assert!(pixels("r.exr") == pixels("e/reference.exr"));
}

#[test]
fn demo_tells_the_whole_story() {
    let bench = Workbench::new();
    let done = validate(&bench, &["demo", "--output-dir", "o", "--samples", "1500", "--backend", "cpu"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let table = text(&done.stdout);
    for word in
        ["samples", "bytes", "bake s", "frame ms", "rel_rmse", "PSNR", "noise", "statue", "cube", "block"]
    {
        assert!(table.contains(word), "{word} is missing: {table}");
    }
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(bench.path("o/report.json")).unwrap()).unwrap();
    for case in json.as_array().unwrap() {
        assert!(case["reference_noise"].as_f64().unwrap() <= 0.02);
        assert!(case["width"].as_u64().unwrap() >= 128 && case["height"].as_u64().unwrap() >= 128);
    }
    for name in ["statue", "cube", "block"] {
        for file in ["played.png", "reference.png", "error.png"] {
            assert!(bench.path("o").join(name).join(file).is_file());
        }
        assert!(bench.path("o/inputs").join(format!("{name}.obj")).is_file());
    }
    assert!(bench.path("o/report.html").is_file());
}

#[test]
fn help_and_version_are_no_errors() {
    let bench = Workbench::new();
    for arguments in [vec!["--help"], vec!["--version"], vec!["image", "--help"]] {
        let done = validate(&bench, &arguments);
        assert!(done.status.success() && !done.stdout.is_empty() && done.stderr.is_empty());
    }
}
