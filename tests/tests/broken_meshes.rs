//! Meshes broken in many ways: each is baked as what was meant, nearly as well as if it had been clean, or refused in one
//! clear line; what is wrong is counted.

#[path = "support/broken/mod.rs"]
mod broken;

use broken::{Intended, Kind, all};
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::{Input, bake, progress::Silent};
use diaphane_formats::medium::{Density, Medium};
use diaphane_formats::mesh::{Mesh, MeshReport, parse_obj};
use diaphane_formats::phase::Phase;
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::{Scene, parse_scene};
use diaphane_runtime::player::{Backend, LightMode};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeMap;
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

/// Bakes and plays on the CPU.
fn played(mesh: &Mesh, mesh_report: &MeshReport) -> Picture {
    let input = Input {
        mesh,
        mesh_report,
        medium: &medium(),
        mesh_name: String::new(),
        material_name: String::new(),
    };
    let preset = Params::preset(Preset::Draft);
    let params = Params { samples: 1_500, directions: 64, certificate: false, ..preset };
    let asset = bake(&input, &params, &Silent).unwrap().0;
    play(&asset, &scene(), Backend::Cpu, LightMode::Baked, 1).unwrap().picture
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
    assert!(kinds.len() >= 40);
    assert_eq!(wrong, 0, "of {} kinds", kinds.len());
}
