//! What a bake needs is known before it begins.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::{Command, Output};

fn bake(folder: &Path, more: &[&str]) -> Output {
    let written = diaphane_assets::write_all(&folder.join("in")).unwrap();
    let statue = written.iter().find(|w| w.name == "statue").unwrap();
    Command::new(env!("CARGO_BIN_EXE_diaphane-bake"))
        .arg(&statue.mesh)
        .arg("--material")
        .arg(&statue.material)
        .arg("--output")
        .arg(folder.join("a.dph"))
        .arg("--report")
        .arg(folder.join("a.json"))
        .args(["--preset", "draft", "--no-certificate"])
        .args(more)
        .output()
        .unwrap()
}

#[test]
fn the_peak_is_as_predicted() {
    let folder = tempfile::tempdir().unwrap();
    let made = bake(folder.path(), &["--samples", "150000", "--directions", "64", "--sh-order", "3"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let text = std::fs::read_to_string(folder.path().join("a.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    let of = |key: &str| report["memory"][key].as_f64().unwrap();
    let ratio = of("peak") / of("predicted");
    assert!((0.7..1.3).contains(&ratio), "{} MB, predicted {} MB", of("peak") / 1e6, of("predicted") / 1e6);
}

#[test]
fn too_large_bakes_are_refused_with_a_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let refused = bake(folder.path(), &["--samples", "1000000", "--memory-limit", "1G"]);
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    let last = said.lines().last().unwrap();
    assert!(last.contains("above --memory-limit 1000 MB") && last.contains("samples would fit"), "{said}");
    assert!(!folder.path().join("a.dph").exists());
    // What it says would fit does.
    let words: Vec<&str> = last.split_whitespace().collect();
    let fits = words[words.iter().position(|w| *w == "samples").unwrap() - 1];
    assert!(fits.parse::<usize>().unwrap() > 100_000, "{said}");
    let refused = bake(folder.path(), &["--memory-limit", "5M"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("the mesh alone takes too much"));
    for wrong in ["0", "4X", "", "-1G", "nan"] {
        let refused = bake(folder.path(), &[&format!("--memory-limit={wrong}")]);
        assert_eq!(refused.status.code(), Some(2), "{wrong}");
        assert!(String::from_utf8_lossy(&refused.stderr).contains("500M, 4G or 4GiB"), "{wrong}");
    }
}
