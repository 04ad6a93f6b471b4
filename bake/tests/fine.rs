//! What the costlier parts of a bake promise: refinement lowers the error of rays, lobes come where faces are flat.

use diaphane_assets::shapes::{cuboid, icosphere};
use diaphane_bake::params::{Params, Preset, Representation};
use diaphane_bake::progress::Silent;
use diaphane_bake::report::Report;
use diaphane_bake::{Error, Input, bake};
use diaphane_formats::asset::{Asset, encode, parse};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::harmonics::bytes;
use diaphane_formats::medium::{Density, Medium};
use diaphane_formats::mesh::Mesh;
use diaphane_formats::phase::Phase;
use glam::DVec3;

fn run(flat: bool, params: &Params) -> diaphane_bake::Result<(Asset, Report)> {
    run_with(flat, 4.0, 0.8, params)
}

fn run_with(
    flat: bool,
    extinction: f64,
    albedo: f64,
    params: &Params,
) -> diaphane_bake::Result<(Asset, Report)> {
    let raw = if flat { cuboid([0.5; 3], 2) } else { icosphere(1.0, 4) };
    let (mesh, report) = Mesh::from_triangles(raw.positions, raw.triangles).unwrap();
    let medium = Medium::new(
        DVec3::splat(extinction),
        DVec3::splat(albedo),
        Phase::Isotropic,
        1.0,
        Density::Uniform(1.0),
    );
    let input = Input {
        mesh: &mesh,
        mesh_report: &report,
        medium: &medium.unwrap(),
        mesh_name: "mesh.obj".to_owned(),
        material_name: "m.toml".to_owned(),
    };
    bake(&input, params, &Silent)
}

fn small() -> Params {
    let draft = Params::preset(Preset::Draft);
    Params { samples: 1500, directions: 128, order: 6, extra_bands: 0, ..draft }
}

#[test]
fn refinement_lowers_the_error_of_other_rays_too() {
    // Samples enough that uneven sums of kernels are the larger part of the error.
    let many = || Params { samples: 8000, order: 3, ..small() };
    let (plain, unrefined) = run(false, &many()).unwrap();
    assert!(unrefined.refinement.is_none());
    let (refined, report) = run(false, &Params { refine: 3, ..many() }).unwrap();
    let done = report.refinement.unwrap();
    assert!(done.after < 0.9 * done.before, "{done:?}");
    assert!(done.moves <= 3 && (1.0..=2.2).contains(&done.width_factor), "{done:?}");
    assert_eq!(refined.info.width_factor, done.width_factor);
    // The certificate's rays and lights are none of refinement's.
    let share = |a: &Asset| a.info.certificate.unwrap().error.unwrap().interpolation;
    assert!(share(&refined) < 0.9 * share(&plain), "{} {}", share(&refined), share(&plain));
    let count = refined.samples.len() as f64 / 8000.0;
    assert!((0.95..=1.05).contains(&count), "the number of samples stays: {count}");
}

#[test]
fn refinement_is_the_same_for_any_number_of_threads() {
    let bytes = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let params = Params { samples: 600, refine: 2, certificate: false, ..small() };
        encode(&pool.install(|| run(true, &params)).unwrap().0).unwrap()
    });
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn what_sends_no_light_is_not_refined() {
    let params = Params { samples: 600, refine: 3, ..small() };
    let (asset, report) = run_with(false, 0.0, 0.8, &params).unwrap();
    let done = report.refinement.unwrap();
    assert!(done.before == f64::INFINITY && done.after == f64::INFINITY, "{done:?}");
    assert_eq!(asset.info.width_factor, params.width_factor);
    assert_eq!(done.moves, 1, "a first move that does not pay is the last");
}

#[test]
fn albedo_makes_no_difference_to_the_samples() {
    let params = Params { samples: 600, refine: 1, ..small() };
    let (bright, _) = run_with(false, 4.0, 0.8, &params).unwrap();
    let (dark, _) = run_with(false, 4.0, 0.0, &params).unwrap();
    assert_eq!(bright.samples, dark.samples);
    assert!(bright.info.certificate.unwrap().error.is_some());
    assert!(dark.info.certificate.unwrap().error.is_none(), "an error of no light is none");
}

#[test]
fn refinement_is_refused_out_of_range() {
    let error = run(false, &Params { refine: 101, ..small() }).unwrap_err();
    assert!(matches!(&error, Error::Parameter(text) if text.contains("--refine")), "{error}");
}

#[test]
fn bytes_that_some_samples_leave_go_to_those_in_need() {
    // Deep samples of a ball need few bands, those under its surface more than it grants.
    let params = Params { light_error: 0.02, certificate: false, ..small() };
    let (plain, _) = run(false, &params).unwrap();
    let (lent, _) = run(false, &Params { extra_bands: 4, ..params }).unwrap();
    let most = |a: &Asset| a.samples.depth.order.iter().copied().max().unwrap();
    assert_eq!((most(&plain), most(&lent)), (6, 10));
    // As much as if all had all bands, and no more.
    let budget = lent.samples.len() * bytes(6);
    let used = |a: &Asset| a.samples.depth.codes.len();
    assert!(used(&plain) < used(&lent) && used(&lent) <= budget, "{} {}", used(&plain), used(&lent));
}

#[test]
fn lobes_are_for_samples_under_a_flat_face() {
    let params = Params { light_error: 0.0, certificate: false, ..small() };
    let (asset, _) = run(true, &params).unwrap();
    assert!(matches!(asset.info.encoding, Encoding::Lobe { .. }));
    let s = &asset.samples;
    let with: Vec<usize> = (0..s.len()).filter(|&i| s.lobe[i] != glam::Vec3::ZERO).collect();
    assert!(with.len() > s.len() / 20, "{} of {}", with.len(), s.len());
    for &i in &with {
        // One band less pays for the lobe.
        assert_eq!(s.depth.order[i], 5);
        // Samples on the surface look along its normal: one coordinate of the unit cube's faces.
        let p = s.position(i).abs().to_array();
        let on_face = p.iter().filter(|c| **c > 0.499).count();
        if on_face == 1 {
            let axis = s.lobe[i].normalize().abs().max_element();
            assert!(axis > 0.99, "{:?}", s.lobe[i]);
        }
    }
    assert_eq!(parse(&encode(&asset).unwrap()).unwrap().samples.lobe, s.lobe);
    // Bytes: no sample is larger than one with all bands.
    let plain = Params { representation: Representation::Reciprocal, ..params };
    let (without, _) = run(true, &plain).unwrap();
    assert!(encode(&asset).unwrap().len() <= encode(&without).unwrap().len() + 64);
}
