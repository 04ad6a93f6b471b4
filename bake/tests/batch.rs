//! `diaphane-bake batch` as a user runs it.

use std::path::Path;
use std::process::{Command, Output};

fn bake(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_diaphane-bake")).args(arguments).current_dir(folder).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_failure_does_not_stop_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let written = diaphane_assets::write_all(&folder.path().join("in")).unwrap();
    assert!(written.iter().any(|w| w.name == "statue"));
    let entry = |material: &str, output: &str| {
        format!("[[bake]]\nmesh = \"in/statue.obj\"\nmaterial = \"in/{material}\"\noutput = \"{output}\"\n")
    };
    let list = format!(
        "[defaults]\npreset = \"draft\"\nsamples = 300\ndirections = 32\nno-certificate = true\n{}{}{}",
        entry("statue.material.toml", "one.dph"),
        entry("missing.material.toml", "two.dph"),
        entry("statue.material.toml", "three.dph")
    );
    std::fs::write(folder.path().join("list.toml"), list).unwrap();
    let ran = bake(&["batch", "list.toml", "--quiet"], folder.path());
    let (out, err) = (text(&ran.stdout), text(&ran.stderr));
    assert_eq!(ran.status.code(), Some(1), "{out}{err}");
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines.len(), 3, "a line for each bake: {out}");
    assert!(out.contains("FAILED  two.dph"), "{out}");
    assert!(err.trim_end().ends_with("1 of 3 bakes failed"), "{err}");
    let (one, three) = (folder.path().join("one.dph"), folder.path().join("three.dph"));
    assert_eq!(std::fs::read(&one).unwrap(), std::fs::read(three).unwrap());
    assert!(!folder.path().join("two.dph").exists());

    // Each entry is a command line that does the same.
    let listed = bake(&["batch", "list.toml", "--commands"], folder.path());
    assert_eq!(listed.status.code(), Some(0));
    let first = text(&listed.stdout).lines().next().unwrap().replace("one.dph", "alone.dph");
    let words: Vec<&str> = first.split(' ').skip(1).collect();
    assert_eq!(bake(&words, folder.path()).status.code(), Some(0), "{first}");
    assert_eq!(std::fs::read(one).unwrap(), std::fs::read(folder.path().join("alone.dph")).unwrap());
}

#[test]
fn a_wrong_option_is_named_before_anything_is_baked() {
    let folder = tempfile::tempdir().unwrap();
    let entry = |option: &str| {
        format!("[[bake]]\nmesh = \"a.obj\"\nmaterial = \"m.toml\"\noutput = \"a.dph\"\n{option}\n")
    };
    std::fs::write(folder.path().join("list.toml"), entry("") + &entry("sample = 3")).unwrap();
    let ran = bake(&["batch", "list.toml"], folder.path());
    assert_eq!(ran.status.code(), Some(2));
    let err = text(&ran.stderr);
    assert_eq!(err.lines().count(), 1, "{err}");
    assert!(err.contains("bake 2") && err.contains("--sample"), "{err}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);

    // One asset would replace the other.
    std::fs::write(folder.path().join("list.toml"), entry("") + &entry("seed = 3")).unwrap();
    let ran = bake(&["batch", "list.toml"], folder.path());
    assert_eq!(ran.status.code(), Some(2));
    assert!(text(&ran.stderr).contains("bakes 1 and 2 write the same file"), "{ran:?}");
}
