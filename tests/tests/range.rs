//! The table of media, lights and views: its parts, and the command from the outside.

#[path = "support/workbench.rs"]
mod workbench;

use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::Silent;
use diaphane_formats::phase::Phase;
use diaphane_runtime::player::{Backend, LightMode};
use std::path::Path;
use std::process::Output;
use validation::play::play;
use validation::range::bakes::{bake_body, dye};
use validation::range::cache::{Origin, Subject};
use validation::range::materials::{Field, Material};
use validation::range::objects::Object;
use validation::range::rows::{Body, rows};
use validation::reference::{Reference, Settings};
use workbench::{With, Workbench};

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn range(bench: &Workbench, arguments: &[&str]) -> Output {
    bench.run("validate", &[&["range"], arguments].concat()).unwrap()
}

/// The cheapest run of some rows.
fn quick(bench: &Workbench, filter: &str, more: &[&str]) -> Output {
    let small = ["--preset", "draft", "--samples", "600", "--image", "16", "--tolerance", "0.05"];
    range(bench, &[&small[..], &["--output-dir", "o", "--filter", filter], more].concat())
}

#[test]
fn dyed_assets_are_what_a_bake_of_the_material_gives() {
    let object = Object::Torus;
    let placed = object.place().unwrap();
    let params = Params { samples: 400, ..Params::preset(Preset::Draft) };
    let material = Material {
        albedo: [0.9, 0.4, 0.05],
        phase: Phase::HenyeyGreenstein { g: 0.7 },
        ior: 1.4,
        field: Field::Layers,
        ..Material::grey(8.0)
    };
    let bake =
        |material: Material| bake_body(&Body { object, material }, &placed, &params, &Silent).unwrap().asset;
    let mut fresh = bake(material);
    fresh.info.certificate = None;
    fresh.levels.iter_mut().for_each(|level| level.error = None);
    let mut dyed = bake(material.baked());
    let row = rows().into_iter().find(|r| r.object == object).unwrap();
    let picture = |asset: &diaphane_formats::asset::Asset| {
        let scene = row.scene(&placed, 16);
        play(asset, &scene, Backend::Cpu, LightMode::Baked, 1).unwrap().picture
    };
    assert!(picture(&dyed) != picture(&fresh), "albedo and phase change nothing");
    dye(&mut dyed, &material);
    assert!(dyed == fresh, "a bake depends on albedo or phase");
    assert!(picture(&dyed) == picture(&fresh));
}

#[test]
fn references_are_kept_and_damage_is_noticed() {
    let bench = Workbench::new();
    let folder = bench.folder.path().join("references");
    std::fs::create_dir(&folder).unwrap();
    let row = rows().into_iter().find(|r| r.name == "extinction-4-torus").unwrap();
    let placed = row.object.place().unwrap();
    let medium = row.material.medium(&placed).unwrap();
    let scene = row.scene(&placed, 12);
    let settings = Settings { tolerance: 0.1, ..Settings::default() };
    let subject = Subject { mesh: &placed.mesh, medium: &medium, scene: &scene, settings: &settings };
    let get = || subject.reference(&folder, &|_| ()).unwrap();
    let (first, origin) = get();
    assert_eq!(origin, Origin::Rendered);
    let same = |r: &Reference| {
        assert!(r.picture == first.picture && r.rays == first.rays && r.converged == first.converged);
        // JSON is read back to the last digit but one.
        assert!((r.error / first.error - 1.0).abs() < 1e-12);
    };
    let (again, origin) = get();
    assert_eq!(origin, Origin::Cached);
    same(&again);
    let (exr, json) = (folder.join(subject.key() + ".exr"), folder.join(subject.key() + ".json"));
    let damaged = |what: &str| {
        let (repaired, origin) = get();
        assert!(matches!(origin, Origin::Damaged(_)), "{what}: {origin:?}");
        same(&repaired);
        assert_eq!(get().1, Origin::Cached, "{what}");
    };
    let mut bytes = std::fs::read(&exr).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&exr, bytes).unwrap();
    damaged("one bit of the picture");
    std::fs::write(&json, "{\"error\": 0.1").unwrap();
    damaged("cut facts");
    std::fs::remove_file(&json).unwrap();
    damaged("facts missing");
    std::fs::remove_file(&exr).unwrap();
    damaged("picture missing");
}

#[test]
fn keys_tell_everything_apart() {
    let all = rows();
    let key = |name: &str, size: u32, settings: Settings| {
        let row = all.iter().find(|r| r.name == name).unwrap();
        let placed = row.object.place().unwrap();
        let (medium, scene) = (row.material.medium(&placed).unwrap(), row.scene(&placed, size));
        Subject { mesh: &placed.mesh, medium: &medium, scene: &scene, settings: &settings }.key()
    };
    let base = Settings::default();
    let keys = [
        key("extinction-16-bird", 16, base),
        key("extinction-16-torus", 16, base),
        key("extinction-4-bird", 16, base),
        key("albedo-0.5", 16, base),
        key("phase-g-0.5", 16, base),
        key("ior-1.3", 16, base),
        key("noise-bird", 16, base),
        key("lights-8", 16, base),
        key("light-environment", 16, base),
        key("camera-near", 16, base),
        key("extinction-16-bird", 17, base),
        key("extinction-16-bird", 16, Settings { seed: 1, ..base }),
        key("extinction-16-bird", 16, Settings { tolerance: 0.01, ..base }),
    ];
    let distinct: std::collections::HashSet<&String> = keys.iter().collect();
    assert_eq!(distinct.len(), keys.len());
    assert_eq!(keys[0], key("extinction-16-bird", 16, base));
}

#[test]
fn the_filter_picks_rows() {
    let bench = Workbench::new();
    let all = text(&range(&bench, &["--list"]).stdout);
    assert_eq!(all.lines().count(), rows().len());
    let some = text(&range(&bench, &["--list", "--filter", "ior"]).stdout);
    assert_eq!(some.lines().collect::<Vec<_>>(), ["ior-1.3", "ior-1.5"]);
    assert!(!bench.path("out").exists());
}

#[test]
fn errors_above_the_limit_end_with_1_and_references_are_used_again() {
    let bench = Workbench::new();
    let done = quick(&bench, "extinction-4-torus", &["--max-error", "0.9"]);
    assert_eq!(done.status.code(), Some(0), "{done:?}");
    assert!(text(&done.stderr).contains("reference rendered"));
    let csv = std::fs::read_to_string(bench.path("o/range.csv")).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 2);
    assert!(lines[0].starts_with("name,rel_rmse,psnr_db,bias,p99_rel,non_finite,splats_per_ray"));
    assert_eq!(lines[0].split(',').count(), lines[1].split(',').count());
    let error: f64 = lines[1].split(',').nth(1).unwrap().parse().unwrap();
    assert!(error > 0.0 && error < 0.9, "{error}");
    let html = std::fs::read_to_string(bench.path("o/report.html")).unwrap();
    assert_eq!(html.matches("src=\"data:image/png;base64,").count(), 3);

    let stored = std::fs::read_dir(bench.path("o/references")).unwrap().map(|e| e.unwrap().path());
    let picture = stored.into_iter().find(|p| has_end(p, "exr")).unwrap();
    let strict = format!("{}", 0.99 * error);
    let done = quick(&bench, "extinction-4-torus", &["--max-error", &strict]);
    assert_eq!(done.status.code(), Some(1), "{done:?}");
    assert!(text(&done.stderr).contains("reference cached"));
    assert!(text(&done.stderr).contains("check failed: extinction-4-torus"));

    std::fs::write(picture, "no picture").unwrap();
    let done = quick(&bench, "extinction-4-torus", &[]);
    assert_eq!(done.status.code(), Some(0), "{done:?}");
    assert!(text(&done.stderr).contains("damaged") && text(&done.stderr).contains("rendered again"));
    // The repaired reference tells the same error.
    let csv = std::fs::read_to_string(bench.path("o/range.csv")).unwrap();
    assert_eq!(csv.lines().nth(1).unwrap().split(',').nth(1), lines[1].split(',').nth(1));
}

#[test]
fn the_densest_rows_are_shown_but_not_judged() {
    let bench = Workbench::new();
    let done = quick(&bench, "extinction-256-torus", &["--max-error", "0"]);
    assert_eq!(done.status.code(), Some(0), "{done:?}");
    assert!(text(&done.stdout).contains("not judged"));
}

#[test]
fn bad_usage_is_refused() {
    let bench = Workbench::new();
    bench.write("file", "in the way");
    for (arguments, says) in [
        (["--filter", "no such row"], "--list"),
        (["--max-error", "nan"], "--max-error"),
        (["--image", "0"], "--image"),
        (["--samples", "0"], "--samples"),
        (["--tolerance", "0"], "--tolerance"),
        (["--preset", "best"], "best"),
        (["--output-dir", "file/o"], "file/o"),
    ] {
        bench.refuses("validate", &arguments.with("range"), says);
    }
}

fn has_end(path: &Path, end: &str) -> bool {
    path.extension().is_some_and(|e| e == end)
}
