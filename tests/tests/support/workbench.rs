//! A folder with one small good file of each kind, and the programs.
#![allow(dead_code)] // Each test file uses its own part.

use diaphane_bake::params::Params;
use diaphane_bake::{Input, bake, progress::Silent};
use diaphane_formats::asset::{self, Asset};
use diaphane_formats::medium::Medium;
use diaphane_formats::{material::parse_material, mesh::parse_obj};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub const MATERIAL: &str =
    "extinction = [3, 2, 1]\nalbedo = [0.8, 0.7, 0.6]\nphase = { type = \"isotropic\" }\n";

pub const SCENE: &str = "[camera]\nposition = [1.3, 1.6, 4.6]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 30\n\
                         [image]\nwidth = 40\nheight = 32\nsamples_per_pixel = 4\n[surface]\nreflection = false\n\
                         [[lights]]\ntype = \"point\"\nposition = [3, 1, 1]\nintensity = [30, 20, 10]\n";

/// The folder; removed when dropped.
pub struct Workbench {
    pub folder: tempfile::TempDir,
}

/// A small asset.
pub fn small_asset(medium: &Medium, samples: usize) -> Asset {
    let text = diaphane_assets::shapes::icosphere(1.0, 2).to_obj();
    let (mesh, mesh_report) = parse_obj(text.as_bytes()).unwrap();
    let input = Input {
        mesh: &mesh,
        mesh_report: &mesh_report,
        medium,
        mesh_name: "ball.obj".to_owned(),
        material_name: "m.toml".to_owned(),
    };
    let params = Params { samples, directions: 32, order: 3, ..Params::default() };
    bake(&input, &params, &Silent).unwrap().0
}

impl Workbench {
    /// Writes ball.obj, m.toml, s.toml and ball.dph.
    pub fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        bench.write("ball.obj", diaphane_assets::shapes::icosphere(1.0, 2).to_obj());
        bench.write("m.toml", MATERIAL);
        bench.write("s.toml", SCENE);
        let medium = parse_material(MATERIAL, Path::new(".")).unwrap();
        bench.write("ball.dph", asset::encode(&small_asset(&medium, 300)).unwrap());
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), contents).unwrap();
    }

    /// `diaphane-PROGRAM` in the folder; `None` (said once) where that program was not built with the tests.
    pub fn command(&self, program: &str, arguments: &[&str]) -> Option<Command> {
        let validate = Path::new(env!("CARGO_BIN_EXE_diaphane-validate"));
        let name = format!("diaphane-{program}{}", std::env::consts::EXE_SUFFIX);
        let path = validate.with_file_name(&name);
        if !path.is_file() {
            tell(&format!("skipped: {name} is not built; test with --workspace"));
            return None;
        }
        let mut command = Command::new(path);
        command.current_dir(self.folder.path()).args(arguments);
        Some(command)
    }

    /// Runs [`Workbench::command`].
    pub fn run(&self, program: &str, arguments: &[&str]) -> Option<Output> {
        Some(self.command(program, arguments)?.output().unwrap())
    }

    /// Every file below the folder with its bytes.
    pub fn contents(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        fn walk(folder: &Path, out: &mut BTreeMap<PathBuf, Vec<u8>>) {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    out.insert(path.clone(), Vec::new());
                    walk(&path, out);
                } else {
                    out.insert(path.clone(), std::fs::read(&path).unwrap());
                }
            }
        }
        let mut out = BTreeMap::new();
        walk(self.folder.path(), &mut out);
        out
    }

    /// The command must end with 2, say one line that holds `says`, and leave the folder as it was.
    pub fn refuses(&self, program: &str, arguments: &[&str], says: &str) {
        let before = self.contents();
        let Some(done) = self.run(program, arguments) else {
            return;
        };
        let line = String::from_utf8_lossy(&done.stderr).into_owned();
        let what = format!("diaphane-{program} {}\n{line}", arguments.join(" "));
        assert_eq!(done.status.code(), Some(2), "{what}");
        assert_eq!(line.trim_end().lines().count(), 1, "{what}");
        assert!(line.contains(says), "does not say '{says}': {what}");
        assert!(self.contents() == before, "something was written: {what}");
    }
}

/// Puts a subcommand in front.
pub trait With<'a> {
    fn with(&self, first: &'a str) -> Vec<&'a str>;
}

impl<'a, const N: usize> With<'a> for [&'a str; N] {
    fn with(&self, first: &'a str) -> Vec<&'a str> {
        std::iter::once(first).chain(self.iter().copied()).collect()
    }
}

/// Says why a test does nothing, past the test runner's capture of the print macros.
fn tell(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
