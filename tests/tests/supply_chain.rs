//! What is built in: licences and sources of all packages are those that `deny.toml` allows, no crate of ours has unsafe code,
//! and bincode, which nobody maintains, is used where it can be replaced. Needs no network; advisories need `cargo deny check`.

mod support;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

const MEMBERS: [&str; 5] = ["formats", "bake", "runtime", "assets", "tests"];
const CRATES_IO: &str = "registry+https://github.com/rust-lang/crates.io-index";

fn text(path: &str) -> String {
    std::fs::read_to_string(support::workspace().join(path)).unwrap()
}

fn toml(path: &str) -> toml::Table {
    text(path).parse().unwrap()
}

/// A package that our crates are built or tested with.
struct Package {
    name: String,
    licence: String,
}

/// All of them, with every feature and for every platform; for this platform alone where the others were never downloaded.
fn packages() -> (Vec<Package>, bool) {
    let tree = |more: &[&str]| {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut run = Command::new(cargo);
        run.args([
            "tree",
            "--offline",
            "--locked",
            "--workspace",
            "--all-features",
            "--edges",
            "normal,build,dev",
        ]);
        run.args(["--prefix", "none", "--format", "{p}|{l}"]).args(more);
        let output = run.current_dir(support::workspace()).output().unwrap();
        output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
    };
    let (lines, all) = tree(&["--target", "all"]).map(|lines| (lines, true)).unwrap_or_else(|| {
        support::tell("checked in part: only packages of this platform are here");
        (tree(&[]).expect("cargo tree runs offline"), false)
    });
    let lines: BTreeSet<&str> = lines.lines().filter(|l| !l.is_empty()).collect();
    let package = |line: &str| {
        // The licence is followed by a mark where a package was told before, the name by version and place.
        let (package, licence) = line.split_once('|').unwrap();
        let name = package.split_whitespace().next().unwrap().to_owned();
        Package { name, licence: licence.trim_end_matches(" (*)").to_owned() }
    };
    (lines.into_iter().map(package).collect(), all)
}

fn strings(value: &toml::Value) -> BTreeSet<String> {
    value.as_array().unwrap().iter().map(|v| v.as_str().unwrap().to_owned()).collect()
}

/// Whether an expression of SPDX is satisfied by licences for which `allowed` holds: `or` of `and` of parentheses or names, each
/// name with an exception where one follows. A slash is an old way to write `or`.
fn satisfied(expression: &str, allowed: &dyn Fn(&str) -> bool) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let mut words = spaced.split_whitespace().peekable();
    let satisfied = any(&mut words, allowed);
    assert!(words.next().is_none(), "'{expression}' is no expression of SPDX");
    satisfied
}

type Words<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

fn any(words: &mut Words<'_>, allowed: &dyn Fn(&str) -> bool) -> bool {
    let mut holds = every(words, allowed);
    while words.next_if_eq(&"OR").is_some() {
        holds |= every(words, allowed);
    }
    holds
}

fn every(words: &mut Words<'_>, allowed: &dyn Fn(&str) -> bool) -> bool {
    let mut holds = one(words, allowed);
    while words.next_if_eq(&"AND").is_some() {
        holds &= one(words, allowed);
    }
    holds
}

fn one(words: &mut Words<'_>, allowed: &dyn Fn(&str) -> bool) -> bool {
    if words.next_if_eq(&"(").is_some() {
        let holds = any(words, allowed);
        assert_eq!(words.next(), Some(")"));
        return holds;
    }
    let mut name = words.next().expect("a licence").to_owned();
    if words.next_if_eq(&"WITH").is_some() {
        name = format!("{name} WITH {}", words.next().expect("an exception"));
    }
    allowed(&name)
}

#[test]
fn expressions_are_understood() {
    let allowed = |name: &str| ["MIT", "ISC", "Apache-2.0 WITH LLVM-exception"].contains(&name);
    for (expression, expected) in [
        ("MIT", true),
        ("GPL-2.0-only", false),
        ("GPL-2.0-only OR MIT", true),
        ("GPL-2.0-only/MIT", true),
        ("MIT AND ISC", true),
        ("MIT AND OFL-1.1", false),
        ("(MIT OR Apache-2.0) AND Unicode-3.0", false),
        ("MIT OR Apache-2.0 AND Unicode-3.0", true),
        ("Apache-2.0", false),
        ("Apache-2.0 WITH LLVM-exception OR Apache-2.0", true),
    ] {
        assert_eq!(satisfied(expression, &allowed), expected, "{expression}");
    }
}

#[test]
fn every_package_has_a_licence_that_is_allowed() {
    let deny = toml("deny.toml");
    let licences = &deny["licenses"];
    let allowed = strings(&licences["allow"]);
    let (packages, _) = packages();
    assert!(packages.len() > 100, "{}", packages.len());
    for Package { name, licence } in &packages {
        assert!(!licence.is_empty(), "{name} has no licence");
        let exceptions = licences["exceptions"].as_array().unwrap().iter();
        let own: BTreeSet<String> = exceptions
            .filter(|e| e["crate"].as_str() == Some(name.as_str()))
            .flat_map(|e| strings(&e["allow"]))
            .collect();
        let fine = satisfied(licence, &|l| allowed.contains(l) || own.contains(l));
        assert!(fine, "{name}: {licence} is not allowed by deny.toml");
    }
}

#[test]
fn no_licence_is_allowed_that_nothing_needs() {
    let (packages, all) = packages();
    if !all {
        return support::tell("skipped: other platforms may need the rest");
    }
    let allowed = strings(&toml("deny.toml")["licenses"]["allow"]);
    for licence in &allowed {
        let fonts = |l: &str| l.starts_with("OFL") || l.starts_with("Ubuntu");
        let without = |l: &str| l != licence && (allowed.contains(l) || fonts(l));
        let needed = packages.iter().any(|p| !satisfied(&p.licence, &without));
        assert!(needed, "nothing needs {licence}");
    }
}

#[test]
fn every_package_is_ours_or_from_the_registry() {
    let lock = toml("Cargo.lock");
    let ours: BTreeSet<String> = MEMBERS
        .iter()
        .map(|m| toml(&format!("{m}/Cargo.toml"))["package"]["name"].as_str().unwrap().to_owned())
        .collect();
    for package in lock["package"].as_array().unwrap() {
        let name = package["name"].as_str().unwrap();
        match package.get("source").and_then(toml::Value::as_str) {
            None => assert!(ours.contains(name), "{name} comes from a path"),
            Some(source) => {
                assert_eq!(source, CRATES_IO, "{name}");
                assert!(package.get("checksum").is_some(), "{name} has no checksum");
            }
        }
    }
}

/// Rust sources and manifests of our crates.
fn sources() -> Vec<(PathBuf, String)> {
    fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(&path, found);
            } else if path.extension().is_some_and(|e| e == "rs" || e == "toml") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    MEMBERS.iter().for_each(|m| collect(&support::workspace().join(m), &mut found));
    let this = Path::new(file!()).file_name();
    found.retain(|path| path.file_name() != this && !path.components().any(|c| c.as_os_str() == "target"));
    found.into_iter().map(|path| (path.clone(), std::fs::read_to_string(&path).unwrap())).collect()
}

#[test]
fn unsafe_code_is_forbidden_everywhere() {
    let workspace = toml("Cargo.toml");
    let members: Vec<&str> =
        workspace["workspace"]["members"].as_array().unwrap().iter().map(|m| m.as_str().unwrap()).collect();
    assert_eq!(members.iter().collect::<BTreeSet<_>>(), MEMBERS.iter().collect());
    assert_eq!(workspace["workspace"]["lints"]["rust"]["unsafe_code"].as_str(), Some("forbid"));
    for member in MEMBERS {
        let lints = toml(&format!("{member}/Cargo.toml"))["lints"]["workspace"].as_bool();
        assert_eq!(lints, Some(true), "{member}");
    }
    let files = sources();
    assert!(files.len() > 100);
    for (path, text) in files {
        // `forbid` cannot be allowed again; whoever tries is told here too.
        assert!(!text.contains("unsafe_code"), "{}", path.display());
    }
}

#[test]
fn bincode_is_used_where_it_can_be_replaced() {
    let places: BTreeSet<String> = sources()
        .into_iter()
        .filter(|(path, text)| {
            path.extension().is_some_and(|e| e == "rs")
                && text.lines().any(|l| !l.trim_start().starts_with("//") && l.contains("bincode"))
        })
        .map(|(path, _)| {
            let path = path.strip_prefix(support::workspace()).unwrap().to_owned();
            path.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
        })
        .collect();
    let expected = ["bake/src/cache/key.rs", "bake/src/cache/mod.rs", "formats/src/asset/codec.rs"];
    assert_eq!(places, expected.map(str::to_owned).into());
    assert_eq!(
        toml("Cargo.toml")["workspace"]["dependencies"]["bincode"]["version"].as_str(),
        Some("=2.0.1")
    );
}

#[test]
fn advisories_that_are_known_have_their_reason() {
    let deny = toml("deny.toml");
    let ignored = deny["advisories"]["ignore"].as_array().unwrap();
    assert!(ignored.iter().any(|i| i["id"].as_str() == Some("RUSTSEC-2025-0141")));
    for entry in ignored {
        let reason = entry["reason"].as_str().unwrap();
        assert!(reason.len() > 80, "{}: {reason}", entry["id"]);
    }
}
