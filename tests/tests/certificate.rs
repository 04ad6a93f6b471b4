//! The error certificate against pictures of the reference, and on the command line.

#[path = "support/workbench.rs"]
mod workbench;

use diaphane_formats::asset;
use diaphane_formats::material::parse_material;
use diaphane_formats::scene::parse_scene;
use diaphane_runtime::player::{Backend, LightMode};
use std::path::Path;
use validation::metrics::compare;
use validation::play::play;
use validation::reference::{Settings, render};
use workbench::{MATERIAL, Workbench, small_asset};

/// A view with a key light, and a light from another side.
const VIEWS: [([f64; 3], [f64; 3], [f64; 3]); 4] = [
    ([0.0, 0.0, 6.0], [-1.0, -0.5, -0.6], [1.0, 0.2, 0.4]),
    ([4.0, 3.0, -3.0], [-0.3, -1.0, 0.1], [0.2, 0.3, -1.0]),
    ([-5.0, 1.0, 2.0], [1.0, -0.6, -0.8], [0.1, 1.0, 0.9]),
    ([1.0, -6.0, 0.5], [0.5, 0.4, 1.0], [-1.0, 0.7, 0.0]),
];

#[test]
fn the_certificate_predicts_pictures() {
    let medium = parse_material(MATERIAL, Path::new(".")).unwrap();
    let asset = small_asset(&medium, 300);
    let said = asset.info.certificate.unwrap().error.unwrap();
    let bytes = asset::encode(&asset).unwrap();
    let asset = asset::parse(&bytes).unwrap();
    let mesh = diaphane_assets::shapes::icosphere(1.0, 2).to_mesh().unwrap();
    let mut squares = 0.0;
    for (camera, first, second) in VIEWS {
        let text = format!(
            "[camera]\nposition = {camera:?}\ntarget = [0, 0, 0]\nvertical_fov_degrees = 24\n\
             up = [0.1, 1, 0.2]\n[image]\nwidth = 40\nheight = 40\nsamples_per_pixel = 4\n\
             [surface]\nreflection = false\n\
             [[lights]]\ntype = \"directional\"\ndirection = {first:?}\nirradiance = [1, 1, 1]\n\
             [[lights]]\ntype = \"directional\"\ndirection = {second:?}\nirradiance = [1, 1, 1]\n"
        );
        let scene = parse_scene(&text, Path::new(".")).unwrap();
        let settings = Settings { tolerance: 0.01, ..Settings::default() };
        let reference = render(&mesh, &medium, &scene, &settings, &|_| {}).unwrap();
        let played = play(&asset, &scene, Backend::Cpu, LightMode::Baked, 1).unwrap();
        let coverage = reference.picture.coverage.clone().unwrap();
        squares += compare(&played.picture, &reference.picture, &coverage).unwrap().rel_rmse.powi(2);
    }
    let seen = (squares / VIEWS.len() as f64).sqrt();
    let ratio = said.rel_rmse / seen;
    assert!(ratio > 1.0 / 1.5 && ratio < 1.5, "certified {said:?}, seen in pictures {seen}");
}

const BAKE: [&str; 13] = [
    "ball.obj",
    "--material",
    "m.toml",
    "--preset",
    "draft",
    "--samples",
    "300",
    "--directions",
    "32",
    "--sh-order",
    "3",
    "--output",
    "new.dph",
];

#[test]
fn inspect_and_report_show_it() {
    let bench = Workbench::new();
    let Some(done) = bench.run("bake", &[&BAKE[..], &["--report", "r.json"]].concat()) else { return };
    assert!(done.status.success(), "{done:?}");
    assert!(String::from_utf8_lossy(&done.stdout).contains("rel. RMSE"));
    let json = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).unwrap();
    let report = json(&std::fs::read(bench.path("r.json")).unwrap());
    let inspected = json(&bench.run("bake", &["inspect", "new.dph", "--json"]).unwrap().stdout);
    let certificate = &inspected["info"]["certificate"];
    assert_eq!(&report["certificate"], certificate);
    for key in ["rel_rmse", "psnr_db", "bias", "interpolation", "representation"] {
        assert!(certificate["error"][key].is_number(), "{key}");
    }
    for key in ["rays", "views", "lights", "seed"] {
        assert!(certificate[key].is_u64(), "{key}");
    }
    let text = bench.run("bake", &["inspect", "new.dph"]).unwrap().stdout;
    let percent = 100.0 * certificate["error"]["rel_rmse"].as_f64().unwrap();
    assert!(String::from_utf8_lossy(&text).contains(&format!("{percent:.2} % rel. RMSE")));
}

#[test]
fn no_certificate_is_said() {
    let bench = Workbench::new();
    let Some(done) = bench.run("bake", &[&BAKE[..], &["--no-certificate"]].concat()) else { return };
    assert!(done.status.success(), "{done:?}");
    let inspected = bench.run("bake", &["inspect", "new.dph"]).unwrap();
    assert!(String::from_utf8_lossy(&inspected.stdout).contains("no certificate"));
    bench.refuses(
        "bake",
        &["ball.obj", "--material", "m.toml", "--output", "x.dph", "--max-error", "0"],
        "above 0",
    );
    let both = [&BAKE[..], &["--no-certificate", "--max-error", "0.1"]].concat();
    bench.refuses("bake", &both, "cannot be used with");
}

#[test]
fn an_error_out_of_reach_fails_and_writes_nothing() {
    let bench = Workbench::new();
    // Nothing scatters: no certificate can satisfy any error.
    bench.write("black.toml", MATERIAL.replace("[0.8, 0.7, 0.6]", "[0, 0, 0]"));
    let before = bench.contents();
    let mut arguments = [&BAKE[..], &["--max-error", "0.01", "--report", "r.json"]].concat();
    arguments[2] = "black.toml";
    let Some(done) = bench.run("bake", &arguments) else { return };
    assert_eq!(done.status.code(), Some(1), "{done:?}");
    assert!(String::from_utf8_lossy(&done.stderr).contains("cannot be measured"));
    assert!(bench.contents() == before);
}
