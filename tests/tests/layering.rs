//! Dependencies point one way: formats <- bake, formats <- runtime; bake and runtime never meet.

mod support;

use std::path::{Path, PathBuf};

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs" || e == "toml") {
            out.push(path);
        }
    }
}

/// No file of the crate names one of the others, as a package or as a module path.
fn never_names(krate: &str, others: &[&str]) {
    let mut files = Vec::new();
    sources(&support::workspace().join(krate), &mut files);
    assert!(files.len() > 1, "{krate} has no sources");
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        // Comments may speak of other crates.
        let code =
            text.lines().filter(|l| !l.trim_start().starts_with("//") && !l.trim_start().starts_with('#'));
        for line in code {
            for other in others {
                let names = [format!("diaphane-{other}"), format!("diaphane_{other}")];
                let own_name = line.trim_start().starts_with("name =");
                let found = names.iter().any(|n| line.contains(n.as_str()));
                assert!(own_name || !found, "{}: {line}", file.display());
            }
        }
    }
}

#[test]
fn formats_knows_nobody() {
    never_names("formats/src", &["bake", "runtime", "assets"]);
    let manifest = std::fs::read_to_string(support::workspace().join("formats/Cargo.toml")).unwrap();
    let dependencies = manifest.split("[dependencies]").nth(1).unwrap();
    assert!(!dependencies.contains("diaphane-"));
}

#[test]
fn bake_and_runtime_never_meet() {
    never_names("bake", &["runtime"]);
    never_names("runtime", &["bake"]);
    never_names("assets", &["bake", "runtime"]);
}

#[test]
fn the_reference_uses_no_baked_data_and_no_shared_integral() {
    let mut files = Vec::new();
    sources(&support::workspace().join("tests/src/reference"), &mut files);
    assert!(files.len() > 5);
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        for word in [
            "asset",
            "reconstruct",
            "kernel::",
            "density_length",
            "depth_along",
            "diaphane_bake",
            "diaphane_runtime",
        ] {
            let used = text.lines().any(|l| !l.trim_start().starts_with("//") && l.contains(word));
            assert!(!used, "{} uses {word}", file.display());
        }
    }
}
