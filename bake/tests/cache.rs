//! Nothing is baked twice: what a cache holds is found again, and makes no difference to the asset.

use diaphane_assets::shapes::icosphere;
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::{Progress, Silent};
use diaphane_bake::report::Report;
use diaphane_bake::{Error, Input, bake};
use diaphane_formats::asset::encode;
use diaphane_formats::medium::{Density, Medium};
use diaphane_formats::mesh::{Mesh, MeshReport};
use diaphane_formats::phase::Phase;
use glam::DVec3;
use std::path::Path;
use std::sync::Mutex;

fn mesh() -> Mesh {
    let raw = icosphere(1.0, 3);
    Mesh::from_triangles(raw.positions, raw.triangles).unwrap().0
}

fn medium(albedo: f64, extinction: f64) -> Medium {
    let even = Density::Uniform(1.0);
    Medium::new(DVec3::splat(extinction), DVec3::splat(albedo), Phase::Isotropic, 1.0, even).unwrap()
}

fn small(cache: Option<&Path>) -> Params {
    let draft = Params::preset(Preset::Draft);
    Params { samples: 600, directions: 32, order: 4, cache: cache.map(Path::to_owned), ..draft }
}

fn run(
    medium: &Medium,
    params: &Params,
    progress: &dyn Progress,
) -> diaphane_bake::Result<(Vec<u8>, Report)> {
    let (mesh, mesh_report) = (mesh(), MeshReport::default());
    let input = Input {
        mesh: &mesh,
        mesh_report: &mesh_report,
        medium,
        mesh_name: "mesh.obj".to_owned(),
        material_name: "m.toml".to_owned(),
    };
    bake(&input, params, progress).map(|(asset, report)| (encode(&asset).unwrap(), report))
}

/// The asset with the cache, what was reused and what was made; the asset without the cache is the same.
fn with_cache(
    folder: &Path,
    medium: &Medium,
    change: impl Fn(Params) -> Params,
) -> (Vec<String>, Vec<String>) {
    let (bytes, report) = run(medium, &change(small(Some(folder))), &Silent).unwrap();
    let (plain, _) = run(medium, &change(small(None)), &Silent).unwrap();
    assert!(bytes == plain);
    let cache = report.cache.unwrap();
    assert!(cache.problems.is_empty(), "{:?}", cache.problems);
    (cache.reused, cache.kept)
}

const ALL: [&str; 7] =
    ["distance field", "samples", "optical depth", "harmonics", "light", "weights", "certificate"];

#[test]
fn only_what_depends_on_a_change_is_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let run = |albedo, extinction, change: &dyn Fn(Params) -> Params| {
        with_cache(folder.path(), &medium(albedo, extinction), change)
    };
    let same = |p: Params| p;
    let none: [&str; 0] = [];
    assert_eq!(run(0.8, 5.0, &same), (none.map(String::from).to_vec(), ALL.map(String::from).to_vec()));
    let finished = ["samples", "light", "weights", "certificate"];
    for albedo in [0.8, 0.3] {
        let (reused, kept) = run(albedo, 5.0, &same);
        assert_eq!((reused, kept.len()), (finished.map(String::from).to_vec(), 0));
    }
    let (reused, kept) = run(0.8, 5.0, &|p| Params { order: 3, ..p });
    assert_eq!(reused, ["samples", "optical depth", "weights"]);
    assert_eq!(kept, ["harmonics", "light", "certificate"]);
    // Beyond ten bands fits go on from ten.
    let ten = run(0.8, 5.0, &|p| Params { order: 10, ..p });
    assert_eq!(ten.1, ["harmonics", "light", "certificate"]);
    for order in [11, 13] {
        let (reused, kept) = run(0.8, 5.0, &|p| Params { order, ..p });
        assert_eq!(reused, ["samples", "optical depth", "harmonics", "weights"]);
        assert_eq!(kept, ["light", "certificate"]);
    }
    let (reused, _) = run(0.8, 6.0, &same);
    assert_eq!(reused, ["distance field"]);
    for change in
        [(&|p| Params { samples: 700, ..p }) as &dyn Fn(Params) -> Params, &|p| Params { seed: 2, ..p }]
    {
        assert!(!run(0.8, 5.0, change).0.contains(&"samples".to_owned()));
    }
    let (reused, _) = run(0.8, 5.0, &|p| Params { directions: 40, ..p });
    assert!(!reused.contains(&"optical depth".to_owned()) && !reused.contains(&"weights".to_owned()));
}

/// Asks to stop when a stage begins.
struct StopAt(&'static str, Mutex<bool>);

impl Progress for StopAt {
    fn stage(&self, name: &'static str, _: u64) {
        *self.1.lock().unwrap() |= name == self.0;
    }
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        *self.1.lock().unwrap()
    }
}

#[test]
fn an_interrupted_bake_goes_on_where_it_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let medium = medium(0.8, 5.0);
    let params = small(Some(folder.path()));
    let stopped = run(&medium, &params, &StopAt("harmonics", Mutex::new(false)));
    assert!(matches!(stopped, Err(Error::Cancelled)));
    let (reused, kept) = with_cache(folder.path(), &medium, |p| p);
    assert_eq!(reused, ["samples", "optical depth"]);
    assert_eq!(kept, ["harmonics", "light", "weights", "certificate"]);
}

#[test]
fn blocks_are_found_again_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let medium = medium(0.8, 5.0);
    let params = |cache| Params {
        samples: 70_000,
        directions: 16,
        points_per_sample: 1,
        order: 2,
        extra_bands: 0,
        certificate: false,
        ..small(cache)
    };
    let (whole, report) = run(&medium, &params(Some(folder.path())), &Silent).unwrap();
    let block = ["optical depth", "harmonics", "more bands"];
    assert_eq!(report.cache.unwrap().kept[2..8], [block, block].concat());
    let mut fits = 0;
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().to_string_lossy().into_owned();
        let first_fits = name.starts_with("more-bands") && fits == 0;
        fits += usize::from(first_fits);
        if first_fits || name.starts_with("light") || name.starts_with("weights") {
            std::fs::remove_file(entry.path()).unwrap();
        }
    }
    let (again, report) = run(&medium, &params(Some(folder.path())), &Silent).unwrap();
    assert!(again == whole);
    let cache = report.cache.unwrap();
    let count = |stage: &str| cache.reused.iter().filter(|s| *s == stage).count();
    assert_eq!((count("optical depth"), count("harmonics"), count("more bands")), (2, 2, 1));
    assert_eq!(cache.kept, ["more bands", "light", "weights"]);
}

#[test]
fn damaged_entries_are_made_again_and_said_so() {
    let folder = tempfile::tempdir().unwrap();
    let medium = medium(0.8, 5.0);
    let params = small(Some(folder.path()));
    let (whole, _) = run(&medium, &params, &Silent).unwrap();
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let path = entry.unwrap().path();
        let mut bytes = std::fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x40;
        std::fs::write(&path, bytes).unwrap();
    }
    let (again, report) = run(&medium, &params, &Silent).unwrap();
    assert!(again == whole);
    let cache = report.cache.unwrap();
    assert_eq!((cache.reused.len(), cache.problems.len()), (0, ALL.len()), "{:?}", cache.problems);
    assert!(report.shortfalls.iter().all(|s| s.contains("is damaged and was made again")));
    assert_eq!(report.shortfalls.len(), ALL.len());
    let (_, report) = run(&medium, &params, &Silent).unwrap();
    assert!(report.cache.unwrap().problems.is_empty());
}

#[test]
fn entries_of_another_bake_are_made_again_and_said_so() {
    let (ours, theirs) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let medium = medium(0.8, 5.0);
    let params = small(Some(ours.path()));
    let (whole, _) = run(&medium, &params, &Silent).unwrap();
    let other = Params { samples: 400, order: 3, cache: Some(theirs.path().to_owned()), ..params.clone() };
    run(&medium, &other, &Silent).unwrap();
    // Each under the name of ours, its checksum right.
    let stage =
        |path: &Path| path.file_name().unwrap().to_string_lossy().rsplit_once('-').unwrap().0.to_owned();
    let files = |folder: &Path| -> Vec<_> {
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    };
    let mut swapped = 0;
    for entry in
        files(ours.path()).iter().filter(|entry| !["samples", "certificate"].contains(&stage(entry).as_str()))
    {
        let others = files(theirs.path());
        std::fs::copy(others.iter().find(|o| stage(o) == stage(entry)).unwrap(), entry).unwrap();
        swapped += 1;
    }
    assert!(swapped > 3);
    let (again, report) = run(&medium, &params, &Silent).unwrap();
    assert!(again == whole);
    let problems = report.cache.unwrap().problems;
    assert!(
        problems.len() > 2 && problems.iter().all(|p| p.contains("belongs to another bake")),
        "{problems:?}"
    );
}
