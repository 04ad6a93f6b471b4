//! Ctrl-C during a bake.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

#[test]
fn an_interrupted_bake_says_so_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let written = diaphane_assets::write_all(&folder.path().join("in")).unwrap();
    let statue = written.iter().find(|w| w.name == "statue").unwrap();
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    for stage in ["samples ...", "optical depth ...", "harmonics ..."] {
        let mut bake = Command::new(env!("CARGO_BIN_EXE_diaphane-bake"))
            .arg(&statue.mesh)
            .arg("--material")
            .arg(&statue.material)
            .arg("--output")
            .arg(out.join("a.dph"))
            .args(["--samples", "20000", "--report"])
            .arg(out.join("a.json"))
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(bake.stderr.take().unwrap());
        let mut line = String::new();
        while line.trim_end() != stage {
            line.clear();
            assert!(lines.read_line(&mut line).unwrap() > 0, "ended before '{stage}'");
        }
        let sent = Command::new("kill").args(["-INT", &bake.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let mut rest = String::new();
        lines.read_to_string(&mut rest).unwrap();
        assert_eq!(bake.wait().unwrap().code(), Some(2), "{stage} {rest}");
        let last = rest.lines().last().unwrap_or("");
        assert!(last.starts_with("error: ") && last.contains("cancelled"), "{stage} {rest}");
        assert!(!rest.contains("weights"), "{stage}: it went on to {rest}");
        assert_eq!(std::fs::read_dir(&out).unwrap().count(), 0, "{stage}");
    }
}
