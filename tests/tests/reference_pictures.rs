//! The reference against pictures of an independent renderer, where they are at hand.

mod support;

use diaphane_formats::{material, mesh, picture, scene};
use validation::metrics::compare;
use validation::reference::{Settings, render};

/// Renders a case at full size and holds it to max(1 %, twice the picture's own noise) and 0.3 % bias.
fn matches(case: &str, mesh_name: &str, tolerance: f64) {
    let Some(folder) = support::reference_folder() else {
        return;
    };
    let file = |name: String| folder.join(name);
    let text = std::fs::read_to_string(file(format!("{case}.json"))).unwrap();
    let about: serde_json::Value = serde_json::from_str(&text).unwrap();
    let noise = about["estimated_noise_rel_rmse"].as_f64().unwrap();
    let (mesh, _) = mesh::load_obj(&file(format!("meshes/{mesh_name}.obj"))).unwrap();
    let medium = material::load(&file(format!("{case}.material.toml"))).unwrap();
    let scene = scene::load(&file(format!("{case}.scene.toml"))).unwrap();
    let settings = Settings { tolerance, ..Settings::default() };
    let own = render(&mesh, &medium, &scene, &settings, &|_| ()).unwrap();
    let (_, _, coverage) = picture::read_coverage(&file(format!("images/{case}_cov.npy"))).unwrap();
    let theirs = picture::read_exr(&file(format!("images/{case}.exr"))).unwrap();
    let m = compare(&own.picture, &theirs, &coverage).unwrap();
    println!(
        "{case}: rel_rmse {:.5}, bias {:+.5}; own noise {:.5}, theirs {noise}",
        m.rel_rmse, m.bias, own.error
    );
    assert!(own.converged);
    assert!(m.rel_rmse <= f64::max(0.01, 2.0 * noise), "{case}: {m:?}");
    assert!(m.bias.abs() <= 0.003, "{case}: {m:?}");
    // Both sides count 16 × 16 rays along edges.
    let differ =
        own.picture.coverage.unwrap().iter().zip(&coverage).filter(|(a, b)| (*a - *b).abs() > 0.05).count();
    assert!(differ <= 40, "{case}: coverage differs in {differ} pixels");
}

#[test]
fn sphere() {
    matches("sphere_homog", "sphere", 0.006);
}

#[test]
fn bunny() {
    matches("bunny_homog", "bunny", 0.007);
}

#[test]
fn torus() {
    matches("torus_homog", "torus", 0.007);
}

#[test]
fn cube_of_layers() {
    matches("cube_layers", "cube", 0.012);
}
