//! Meshes broken in many ways: each is baked as what was meant, nearly as well as if it had been clean, or refused in one
//! clear line; what is wrong is counted.

#[path = "support/broken/mod.rs"]
mod broken;

use broken::{Intended, Kind, all};
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::{Input, bake, progress::Silent};
use diaphane_formats::asset::Asset;
use diaphane_formats::medium::{Density, Medium};
use diaphane_formats::mesh::{Mending, Mesh, MeshReport, parse_obj};
use diaphane_formats::phase::Phase;
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::{Scene, parse_scene};
use diaphane_runtime::player::{Backend, LightMode};
use glam::DVec3;
use proptest::prelude::*;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use validation::metrics::compare;
use validation::play::play;
use validation::reference::{Settings, render};

/// The picture's error may be so many times that of the clean shape.
const FACTOR: f64 = 2.0;

/// Light from the side and from behind.
const SCENE: &str = "[camera]\nposition = [1.6, 1.2, 3.4]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 32\n\
                     [image]\nwidth = 48\nheight = 48\nsamples_per_pixel = 4\n[surface]\nreflection = false\n\
                     [[lights]]\ntype = \"point\"\nposition = [2, 2.2, 2.4]\nintensity = [26, 24, 21]\n\
                     [[lights]]\ntype = \"point\"\nposition = [-1.8, 0.8, -1.8]\nintensity = [34, 30, 20]\n";

fn scene() -> Scene {
    parse_scene(SCENE, Path::new(".")).unwrap()
}

/// The same for all, so that nothing depends on the bounding box of what was broken.
fn medium() -> Medium {
    Medium::new(DVec3::splat(1.5), DVec3::splat(0.8), Phase::Isotropic, 1.0, Density::Uniform(1.0)).unwrap()
}

fn baked(mesh: &Mesh, mesh_report: &MeshReport, samples: usize) -> diaphane_bake::Result<Asset> {
    let input = Input {
        mesh,
        mesh_report,
        medium: &medium(),
        mesh_name: String::new(),
        material_name: String::new(),
    };
    let preset = Params::preset(Preset::Draft);
    let params = Params { samples, directions: 64, certificate: false, ..preset };
    Ok(bake(&input, &params, &Silent)?.0)
}

/// Played on the CPU.
fn picture(asset: &Asset) -> Picture {
    play(asset, &scene(), Backend::Cpu, LightMode::Baked, 1).unwrap().picture
}

fn played(mesh: &Mesh, mesh_report: &MeshReport) -> Picture {
    picture(&baked(mesh, mesh_report, 1_500).unwrap())
}

/// A clean shape by the reference, and the error of its own bake.
struct Clean {
    reference: Picture,
    error: f64,
}

impl Clean {
    fn new(intended: Intended) -> Self {
        let shape = intended.shape();
        let single = shape.positions.iter().map(|p| p.as_vec3().as_dvec3()).collect();
        let mesh = Mesh::from_trusted(single, shape.triangles).unwrap();
        let settings = Settings { tolerance: 0.01, ..Settings::default() };
        let reference = render(&mesh, &medium(), &scene(), &settings, &|_| {}).unwrap().picture;
        let mut clean = Self { reference, error: 0.0 };
        clean.error = clean.error_of(&played(&mesh, &MeshReport::default()));
        clean
    }

    fn error_of(&self, picture: &Picture) -> f64 {
        let coverage = self.reference.coverage.as_deref().unwrap();
        let metrics = compare(picture, &self.reference, coverage).unwrap();
        assert_eq!(metrics.non_finite, 0);
        metrics.rel_rmse
    }
}

/// What went wrong with a kind, if anything did.
fn check(kind: &Kind, clean: &BTreeMap<usize, Clean>) -> Result<String, String> {
    let parsed = parse_obj(kind.mesh.to_obj().as_bytes());
    match (parsed, kind.intended) {
        (Err(e), Err(says)) => {
            let line = e.to_string();
            let clear = line.contains(says) && line.lines().count() == 1;
            if clear { Ok(format!("refused: {line}")) } else { Err(format!("does not say '{says}': {line}")) }
        }
        (Err(e), Ok(_)) => Err(format!("refused: {e}")),
        (Ok(_), Err(_)) => Err("was not refused".to_owned()),
        (Ok((mesh, report)), Ok(intended)) => {
            let count = (kind.count)(&report);
            let clean = &clean[&(intended as usize)];
            let error = clean.error_of(&played(&mesh, &report));
            let ratio = error / clean.error;
            let line = format!("{ratio:.2} times the clean error of {:.4}, counted {count}", clean.error);
            if count > 0 && ratio <= FACTOR { Ok(line) } else { Err(format!("{line}; {report:?}")) }
        }
    }
}

#[test]
fn each_kind_is_baked_as_what_was_meant_or_refused() {
    let clean: BTreeMap<usize, Clean> =
        Intended::ALL.into_par_iter().map(|i| (i as usize, Clean::new(i))).collect();
    let kinds = all();
    let found: Vec<_> = kinds.par_iter().map(|kind| check(kind, &clean)).collect();
    let mut wrong = 0;
    for (kind, found) in kinds.iter().zip(&found) {
        match found {
            Ok(line) => println!("{}: {line}", kind.name),
            Err(line) => {
                wrong += 1;
                println!("WRONG {}: {line}", kind.name);
            }
        }
    }
    assert!(kinds.len() >= 95);
    assert_eq!(wrong, 0, "of {} kinds", kinds.len());
}

#[test]
fn clean_shapes_come_out_as_they_were() {
    let shapes = Intended::ALL.into_iter().map(Intended::shape).chain([diaphane_assets::shapes::bird()]);
    for shape in shapes {
        let (mesh, report) = Mesh::from_triangles(shape.positions.clone(), shape.triangles.clone()).unwrap();
        let corners = |t: &[u32; 3], positions: &[DVec3]| t.map(|v| positions[v as usize]);
        assert_eq!(report.flipped + report.holes + report.degenerate + report.duplicate, 0);
        assert_eq!(report.mending, Mending::default());
        let given = shape.triangles.iter().map(|t| corners(t, &shape.positions));
        assert!(mesh.triangles.iter().map(|t| corners(t, &mesh.positions)).eq(given));
    }
}

/// Whether every directed edge has as many opposites.
fn is_closed(mesh: &Mesh) -> bool {
    let mut balance: HashMap<[u32; 2], i32> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *balance.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
    }
    balance.values().all(|n| *n == 0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Triangles between points of a small lattice: most edges are shared by many, most faces cross or touch others.
    #[test]
    fn any_triangles_become_a_closed_mesh_or_one_line(
        triangles in proptest::collection::vec(proptest::array::uniform3(0u32..27), 1..60)
    ) {
        let at = |i: i32| DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) - 1.0;
        match Mesh::from_triangles((0..27).map(at).collect(), triangles) {
            Ok((mesh, report)) => {
                prop_assert!(is_closed(&mesh));
                prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
                prop_assert_eq!((report.vertices, report.triangles), (mesh.positions.len(), mesh.triangles.len()));
            }
            Err(e) => prop_assert_eq!(e.to_string().lines().count(), 1),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn any_triangles_are_baked_to_finite_pictures_or_refused(
        triangles in proptest::collection::vec(proptest::array::uniform3(0u32..27), 20..60)
    ) {
        let at = |i: i32| 0.6 * (DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) - 1.0);
        if let Ok((mesh, report)) = Mesh::from_triangles((0..27).map(at).collect(), triangles) {
            match baked(&mesh, &report, 200) {
                Ok(asset) => {
                    let picture = picture(&asset);
                    prop_assert!(picture.pixels.iter().flatten().all(|v| v.is_finite()));
                }
                Err(e) => prop_assert_eq!(e.to_string().lines().count(), 1),
            }
        }
    }
}
