use super::*;
use diaphane_formats::medium::Density;
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::parse_scene;
use std::path::Path;

fn tetrahedron() -> Mesh {
    let p = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]];
    let positions = p.map(DVec3::from_array).to_vec();
    Mesh::from_triangles(positions, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]).unwrap().0
}

fn medium() -> Medium {
    Medium::new(DVec3::new(1.0, 2.0, 3.0), DVec3::splat(0.8), Phase::Isotropic, 1.0, Density::Uniform(1.0))
        .unwrap()
}

fn scene(lights: &str) -> Scene {
    let head = "[camera]\nposition=[0.3,0.5,4]\ntarget=[0,0,0]\nvertical_fov_degrees=40\n[image]\nwidth=24\nheight=20\n";
    parse_scene(&format!("{head}{lights}"), Path::new(".")).unwrap()
}

const LIGHT: &str = "[[lights]]\ntype='point'\nposition=[2,2,2]\nintensity=[10,10,10]\n";

#[test]
fn same_picture_for_any_number_of_threads() {
    let settings = Settings { tolerance: 0.02, ..Settings::default() };
    let picture = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&tetrahedron(), &medium(), &scene(LIGHT), &settings, &|_| ()).unwrap().picture)
    };
    assert_eq!(picture(1), picture(3));
}

#[test]
fn no_lights_give_black_with_coverage() {
    let r = render(&tetrahedron(), &medium(), &scene(""), &Settings::default(), &|_| ()).unwrap();
    assert!(r.converged && r.error == 0.0);
    assert!(r.picture.pixels.iter().all(|p| *p == [0.0; 3]));
    assert!(r.picture.coverage.unwrap().contains(&1.0));
}

#[test]
fn the_error_estimate_is_honest() {
    // Two pictures with independent noise differ by √2 times the error of one.
    let noisy = |seed: u64| {
        let settings = Settings { tolerance: 0.02, seed, ..Settings::default() };
        render(&tetrahedron(), &medium(), &scene(LIGHT), &settings, &|_| ()).unwrap()
    };
    let (a, b) = (noisy(1), noisy(2));
    let values = |r: &Reference| r.picture.pixels.iter().flatten().map(|v| f64::from(*v)).collect::<Vec<_>>();
    let (va, vb) = (values(&a), values(&b));
    let difference: f64 = va.iter().zip(&vb).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / 2.0;
    let measured = (difference / va.iter().map(|v| v * v).sum::<f64>()).sqrt();
    let claimed = (0.5 * (a.error.powi(2) + b.error.powi(2))).sqrt();
    assert!(measured < 1.5 * claimed && measured > claimed / 1.5, "measured {measured}, claimed {claimed}");
}

#[test]
fn a_white_environment_and_a_dense_albedo_stay_below_it() {
    // Single scattering of radiance 1 from everywhere: L ≤ Ω (1 - exp(-τ_view)) < 1.
    let mut s = scene("");
    let mut picture = Picture::new(8, 4);
    picture.pixels.fill([1.0; 3]);
    s.environment = Some(diaphane_formats::scene::Environment { picture, scale: 1.0 });
    let settings = Settings { tolerance: 0.01, ..Settings::default() };
    let r = render(&tetrahedron(), &medium(), &s, &settings, &|_| ()).unwrap();
    let most = r.picture.pixels.iter().flatten().fold(0.0f32, |m, v| m.max(*v));
    assert!(most < 0.8 && most > 0.1, "{most}");
}

#[test]
fn a_tolerance_of_zero_is_refused() {
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let settings = Settings { tolerance, ..Settings::default() };
        assert!(render(&tetrahedron(), &medium(), &scene(LIGHT), &settings, &|_| ()).is_err());
    }
}
