//! Another extinction at run time against assets that were baked for it.

use diaphane_assets::shapes;
use diaphane_bake::params::Params;
use diaphane_bake::{Input, bake, progress::Silent};
use diaphane_formats::asset::Asset;
use diaphane_formats::medium::{Density, Medium};
use diaphane_formats::mesh::{Mesh, MeshReport};
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::{Scene, parse_scene};
use diaphane_runtime::edit::{Edit, MEASURED_SCALES};
use diaphane_runtime::player::{Backend, LightMode};
use glam::DVec3;
use std::path::Path;
use validation::metrics::compare;
use validation::play::play_edited;
use validation::reference::{Settings, render};

/// Optical depth of the diagonal as baked.
const DEPTH: f64 = 12.0;
const SAMPLES: usize = 3_000;

/// Light from the side and from behind, where edits show most.
const SCENE: &str = "[camera]\nposition = [1.5, 0.8, 3.4]\ntarget = [0, 0, 0]\nvertical_fov_degrees = 28\n\
                     [image]\nwidth = 48\nheight = 48\nsamples_per_pixel = 4\n[surface]\nreflection = false\n\
                     [[lights]]\ntype = \"point\"\nposition = [2, 2.2, 2.4]\nintensity = [26, 24, 21]\n\
                     [[lights]]\ntype = \"point\"\nposition = [-1.8, 0.8, -1.8]\nintensity = [34, 30, 20]\n";

fn medium(mesh: &Mesh, scale: f64) -> Medium {
    let extinction = DVec3::splat(DEPTH * scale / mesh.diagonal());
    Medium::new(extinction, DVec3::splat(0.8), Phase::Isotropic, 1.0, Density::Uniform(1.0)).unwrap()
}

fn baked(mesh: &Mesh, medium: &Medium) -> Asset {
    let input = Input {
        mesh,
        mesh_report: &MeshReport::default(),
        medium,
        mesh_name: String::new(),
        material_name: String::new(),
    };
    let params = Params { samples: SAMPLES, directions: 128, certificate: false, ..Params::default() };
    bake(&input, &params, &Silent).unwrap().0
}

/// Relative error of `asset` under `edit` against the medium that should come out.
fn error(asset: &Asset, edit: &Edit, mesh: &Mesh, medium: &Medium, scene: &Scene) -> f64 {
    let settings = Settings { tolerance: 0.01, ..Settings::default() };
    let reference = render(mesh, medium, scene, &settings, &|_| {}).unwrap().picture;
    let played = play_edited(asset, edit, scene, Backend::Cpu, LightMode::Baked, 1).unwrap();
    compare(&played.picture, &reference, reference.coverage.as_deref().unwrap()).unwrap().rel_rmse
}

#[test]
fn edits_in_the_stated_range_are_nearly_as_good_as_new_bakes() {
    let scene = parse_scene(SCENE, Path::new(".")).unwrap();
    // The cube was the worst of those measured.
    for shape in [shapes::bird(), shapes::cuboid([0.57; 3], 20)] {
        in_range(&shape.to_mesh().unwrap(), &scene);
    }
}

fn in_range(mesh: &Mesh, scene: &Scene) {
    let asset = baked(mesh, &medium(mesh, 1.0));
    for scale in MEASURED_SCALES {
        let wanted = medium(mesh, scale);
        let edit = Edit { extinction_scale: DVec3::splat(scale), ..Edit::default() };
        assert_eq!(edit.warning(), None);
        let edited = error(&asset, &edit, mesh, &wanted, scene);
        let fresh = error(&baked(mesh, &wanted), &Edit::default(), mesh, &wanted, scene);
        println!("{scale}: edited {edited:.4}, baked anew {fresh:.4}");
        assert!(edited <= 1.5 * fresh, "scale {scale}: edited {edited}, baked anew {fresh}");
    }
}
