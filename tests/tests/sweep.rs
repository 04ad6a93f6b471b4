//! The sweep from the outside: what it leaves, that it goes on where it was, and bad usage.

mod support;
#[path = "support/workbench.rs"]
mod workbench;

use std::process::Output;
use workbench::{With, Workbench};

const SMALL: [&str; 20] = [
    "--quick",
    "--cases",
    "none",
    "--case",
    "ball.obj",
    "m.toml",
    "s.toml",
    "--base",
    "60,3,32",
    "--samples",
    "30",
    "--orders",
    "2",
    "--directions",
    "32",
    "--lights=1,3",
    "--size=16",
    "--frames=1",
    "--tolerance=0.05",
    "--steps=1,4",
];

fn sweep(bench: &Workbench, more: &[&str]) -> Output {
    let done = bench.run("validate", &[&["sweep", "--output-dir", "o"], &SMALL[..], more].concat()).unwrap();
    assert!(done.status.success(), "{done:?}");
    done
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn measures_once_and_goes_on_where_it_was() {
    let bench = Workbench::new();
    let read = |name: &str| std::fs::read_to_string(bench.path("o").join(name)).unwrap();
    let first = sweep(&bench, &[]);
    // Assets: base, 30 samples, 2 bands, three other encodings. Splats of each, the recipe and the grid for two, the
    // march with two numbers of steps: 6 + 2 + 2 + 2 drawings with two numbers of lights.
    let out = text(&first.stdout);
    assert!(out.contains("24 measurements (24 new)"), "{out}");
    let csv = read("sweep.csv");
    assert_eq!(csv.lines().count(), 25);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().all(|l| l.split(',').count() == columns), "{csv}");
    for name in ["error-time-1", "error-time-3", "error-bytes", "error-bake"] {
        assert!(read(&format!("{name}-cpu.svg")).starts_with("<svg "), "{name}");
    }
    assert!(read("summary.txt").contains("== ball =="));
    let json: serde_json::Value = serde_json::from_str(&read("summary.json")).unwrap();
    // The published recipe is worse than the player at equal samples, whatever the lights (at 30 samples both are
    // hardly a picture).
    let recipe = json[0]["recipe"].as_array().unwrap();
    assert_eq!(recipe.len(), 4);
    let mut enough = recipe.iter().filter(|r| r["samples"] == 60);
    assert!(enough.all(|r| r["ratio"].as_f64().unwrap() > 1.0), "{recipe:?}");
    // Again: nothing is measured, and the table, which holds times, is the same.
    let again = sweep(&bench, &[]);
    assert!(text(&again.stdout).contains("24 measurements (0 new)"));
    assert_eq!(read("sweep.csv"), csv);
    // A torn line is said and measured again, the others are not.
    let lines = read("measurements.jsonl");
    let torn = lines.replacen("\"rel_rmse\"", "\"rel_\u{fffd}", 1);
    std::fs::write(bench.path("o/measurements.jsonl"), torn).unwrap();
    let mended = sweep(&bench, &[]);
    assert!(text(&mended.stderr).contains("line 1 is damaged"), "{mended:?}");
    assert!(text(&mended.stdout).contains("24 measurements (1 new)"));
    // One more step measures one more setting; another seed measures everything.
    let more = sweep(&bench, &["--grid-steps", "2"]);
    assert!(text(&more.stdout).contains("24 measurements (4 new)"), "{more:?}");
    let other = sweep(&bench, &["--seed", "2", "--methods", "march"]);
    assert!(text(&other.stdout).contains("4 measurements (4 new)"));
}

#[test]
fn bad_usage_is_one_line() {
    let bench = Workbench::new();
    bench.write("file", "in the way");
    let refuses = |arguments: &[&str], says: &str| {
        bench.refuses("validate", &[&["sweep"], arguments].concat(), says);
    };
    refuses(&["--steps", "0"], "--steps");
    refuses(&["--orders", "5,15"], "--orders");
    refuses(&["--samples", "many"], "--samples");
    refuses(&["--base", "100,5"], "--base");
    refuses(&["--lights", "0"], "--lights");
    refuses(&["--size", "4"], "--size");
    refuses(&["--frames", "0"], "--frames");
    refuses(&["--tolerance=-1"], "--tolerance");
    refuses(&["--tolerance=nan"], "--tolerance");
    refuses(&["--methods", "splats,magic"], "magic");
    refuses(&["--cases", "moon"], "moon");
    refuses(&["--cases", "none"], "--case");
    refuses(&["--presets", "huge"], "huge");
    refuses(&["--encodings", "morse"], "morse");
    refuses(&["--backend", "abacus"], "abacus");
    refuses(&["--case", "ball.obj", "m.toml"], "--case");
    refuses(&["--case", "ball.obj", "m.toml", "missing.toml"], "missing.toml");
    bench.refuses("validate", &["--output-dir", "file/o"].with("sweep"), "file/o");
}
