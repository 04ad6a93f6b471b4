//! The error certificate of a bake: what it says, when it says nothing, and the error that it is asked to meet.

use diaphane_assets::shapes::icosphere;
use diaphane_bake::params::{Params, Preset, Representation};
use diaphane_bake::progress::Silent;
use diaphane_bake::{Error, Input, Result, bake};
use diaphane_formats::asset::{Asset, Certificate, CertifiedError, encode, parse};
use diaphane_formats::medium::{Density, Medium, Shape, Shapes, Solid};
use diaphane_formats::mesh::Mesh;
use diaphane_formats::phase::Phase;
use glam::DVec3;

fn medium(extinction: DVec3, albedo: f64, density: Density) -> Medium {
    let phase = Phase::HenyeyGreenstein { g: 0.3 };
    Medium::new(extinction, DVec3::splat(albedo), phase, 1.0, density).unwrap()
}

fn jade() -> Medium {
    medium(DVec3::new(5.0, 4.0, 3.0), 0.8, Density::Uniform(1.0))
}

fn small() -> Params {
    Params {
        samples: 600,
        directions: 64,
        points_per_sample: 4,
        order: 4,
        extra_bands: 0,
        light_error: 0.0,
        ..Params::preset(Preset::Draft)
    }
}

fn run(medium: &Medium, params: &Params) -> Result<Asset> {
    let raw = icosphere(1.0, 3);
    let (mesh, mesh_report) = Mesh::from_triangles(raw.positions, raw.triangles).unwrap();
    let (mesh_name, material_name) = ("mesh.obj".to_owned(), "m.toml".to_owned());
    let input = Input { mesh: &mesh, mesh_report: &mesh_report, medium, mesh_name, material_name };
    bake(&input, params, &Silent).map(|(asset, report)| {
        assert_eq!(report.certificate, asset.info.certificate);
        asset
    })
}

fn certificate(medium: &Medium, params: &Params) -> Certificate {
    run(medium, params).unwrap().info.certificate.unwrap()
}

fn error(medium: &Medium, params: &Params) -> CertifiedError {
    certificate(medium, params).error.unwrap()
}

#[test]
fn samples_reduce_one_share_and_bands_the_other() {
    // Without lobes, which make up for bands, and with directions enough that bands are what limits the harmonics.
    let plain = || Params { representation: Representation::Reciprocal, directions: 256, ..small() };
    let base = error(&jade(), &plain());
    assert!(base.rel_rmse > 0.0 && base.rel_rmse < 0.3, "{base:?}");
    assert!((base.interpolation.hypot(base.representation) / base.rel_rmse - 1.0).abs() < 1e-9);
    let more = error(&jade(), &Params { samples: 6000, ..plain() });
    assert!(more.interpolation < 0.7 * base.interpolation, "{base:?} {more:?}");
    let fewer_bands = error(&jade(), &Params { order: 2, ..plain() });
    assert!(fewer_bands.representation > 1.3 * base.representation, "{base:?} {fewer_bands:?}");
    // What the harmonics hold hardly matters for the other share.
    assert!((fewer_bands.interpolation / base.interpolation - 1.0).abs() < 0.15, "{base:?} {fewer_bands:?}");
}

#[test]
fn any_number_of_threads_certifies_the_same() {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| certificate(&jade(), &small()))
    };
    let one = on(1);
    assert_eq!(one, on(5));
    assert!(one.rays > 500 && one.views > 0 && one.lights > 0 && one.seed == small().seed);
    assert_ne!(one.error, certificate(&jade(), &Params { seed: 9, ..small() }).error);
}

#[test]
fn it_can_be_left_out_and_survives_the_file() {
    let without = run(&jade(), &Params { certificate: false, ..small() }).unwrap();
    assert_eq!(without.info.certificate, None);
    let with = run(&jade(), &small()).unwrap();
    assert_eq!(parse(&encode(&with).unwrap()).unwrap().info.certificate, with.info.certificate);
    // It changes nothing else.
    assert_eq!(with.samples, without.samples);
    let mut damaged = with;
    damaged.info.certificate.as_mut().unwrap().error.as_mut().unwrap().rel_rmse = f64::NAN;
    assert!(encode(&damaged).is_err());
}

#[test]
fn what_scatters_nothing_is_not_measurable() {
    let black = medium(DVec3::splat(3.0), 0.0, Density::Uniform(1.0));
    assert_eq!(certificate(&black, &small()).error, None);
    let asked = Params { max_error: Some(0.1), ..small() };
    assert!(matches!(run(&black, &asked), Err(Error::TooInaccurate(_))));
}

#[test]
fn odd_media_are_measured_or_said_not_to_be() {
    let around = |base| {
        let solid = Solid::Sphere { center: DVec3::ZERO, radius: 0.5 };
        Density::Shapes(Shapes { base, shapes: vec![Shape { solid, density: 50.0, absorb: true }] })
    };
    let media = [
        medium(DVec3::new(0.0, 2.0, 900.0), 0.8, Density::Uniform(1.0)),
        medium(DVec3::splat(1e-6), 0.8, Density::Uniform(1.0)),
        medium(DVec3::splat(1e4), 0.8, Density::Uniform(1.0)),
        medium(DVec3::splat(2.0), 0.8, around(0.0)),
        medium(DVec3::splat(2.0), 0.8, around(1.0)),
    ];
    for medium in &media {
        for (samples, directions, order) in [(1, 64, 4), (300, 1, 1)] {
            match run(medium, &Params { samples, directions, order, ..small() }) {
                // The file is checked as it is encoded.
                Ok(asset) => assert!(encode(&asset).is_ok() && asset.info.certificate.is_some()),
                Err(error) => assert!(matches!(error, Error::NoRoom(_)), "{error}"),
            }
        }
    }
}

#[test]
fn a_wanted_error_is_met_by_adding_or_refused() {
    let base = error(&jade(), &small()).rel_rmse;
    let wanted = 0.8 * base;
    let asset = run(&jade(), &Params { max_error: Some(wanted), ..small() }).unwrap();
    assert!(asset.info.certificate.unwrap().error.unwrap().rel_rmse <= wanted);
    assert!(asset.samples.len() > 700 || asset.info.order > 4);
    // Nothing is added where the error is met at once.
    let easy = run(&jade(), &Params { max_error: Some(2.0 * base), ..small() }).unwrap();
    assert_eq!(easy.info.order, 4);
    let both = Params { certificate: false, max_error: Some(0.1), ..small() };
    for bad in
        [both, Params { max_error: Some(0.0), ..small() }, Params { max_error: Some(f64::NAN), ..small() }]
    {
        assert!(matches!(run(&jade(), &bad), Err(Error::Parameter(_))));
    }
}
