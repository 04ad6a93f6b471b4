//! Programs whose readers have gone (`| head`) end quietly.

#[path = "support/workbench.rs"]
mod workbench;

use std::io::{PipeWriter, pipe};
use std::process::Stdio;
use workbench::Workbench;

const BENCH: [&str; 8] = ["bench", "ball.dph", "--backend", "cpu", "--part", "axes", "--frames", "1"];
const BAKE: [&str; 9] =
    ["ball.obj", "--material", "m.toml", "--output", "new.dph", "--samples", "200", "--directions", "32"];
const PLAY: [&str; 6] = ["ball.dph", "--backend", "cpu", "--level", "auto", "--output"];
const IMAGE: [&str; 9] =
    ["image", "ball.dph", "ball.obj", "--material", "m.toml", "--scene", "s.toml", "--backend", "cpu"];

/// A pipe that nobody reads.
fn closed() -> PipeWriter {
    pipe().unwrap().1
}

#[test]
fn nobody_reads_standard_output() {
    let bench = Workbench::new();
    for (program, arguments) in [
        ("bake", &["inspect", "ball.dph"][..]),
        ("bake", &["inspect", "ball.dph", "--json"]),
        ("bake", &BAKE),
        ("play", &[&BENCH[..], &["--limit", "0.001"]].concat()),
        ("validate", &IMAGE),
    ] {
        let Some(mut command) = bench.command(program, arguments) else { continue };
        let done =
            command.stdout(closed()).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(0), "{program} {arguments:?}: {said}");
        assert!(!said.contains("error") && !said.contains("panic"), "{program} {arguments:?}: {said}");
    }
    assert!(bench.path("new.dph").is_file() || bench.command("bake", &[]).is_none());
}

#[test]
fn nobody_reads_either_stream() {
    let bench = Workbench::new();
    for (program, arguments, code) in [
        ("bake", &BAKE[..], 0),
        ("bake", &["inspect", "none.dph"], 2),
        ("play", &BENCH[..2], 0),
        ("play", &["bench", "none.dph"], 2),
        ("validate", &IMAGE, 0),
        ("validate", &["compare", "none.exr", "none.exr"], 2),
    ] {
        let Some(mut command) = bench.command(program, arguments) else { continue };
        let done = command.stdout(closed()).stderr(closed()).status().unwrap();
        assert_eq!(done.code(), Some(code), "{program} {arguments:?}");
    }
}

#[test]
fn a_file_that_was_asked_for_is_written() {
    let bench = Workbench::new();
    let arguments = [&BENCH[..], &["--limit", "0.001", "--output", "b.json"]].concat();
    let Some(mut command) = bench.command("play", &arguments) else { return };
    assert!(command.stdout(closed()).status().unwrap().success());
    let text = std::fs::read_to_string(bench.path("b.json")).unwrap();
    assert!(text.contains("rows") && text.contains("skipped"));
    let Some(mut command) = bench.command("play", &[&PLAY[..], &["x.png"]].concat()) else { return };
    assert!(command.stdout(closed()).stderr(closed()).status().unwrap().success());
    assert!(bench.path("x.png").is_file());
}
