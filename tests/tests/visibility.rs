//! Both ways to find optical depths agree, for every kind of medium and boundary, and bakes by either are alike.

use diaphane_bake::params::{Params, Preset, Visibility};
use diaphane_bake::progress::Silent;
use diaphane_formats::directions::even_directions;
use diaphane_formats::medium::{Density, Layers, Medium, SampledDensity};
use diaphane_formats::phase::Phase;
use diaphane_formats::visibility::{Accel, project_with, trace};
use glam::DVec3;
use validation::range::objects::Object;
use validation::speed::bakes::{by, medium, timed};
use validation::speed::visibility::{agreement, points_inside};

#[test]
fn no_winding_is_wrong_and_depths_agree() {
    for object in [Object::Bird, Object::Torus, Object::Cube] {
        let mesh = object.place().unwrap().mesh;
        let accel = Accel::new(&mesh);
        let even = medium(&mesh, false).unwrap();
        let points = points_inside(&mesh, &accel, 5_000, 0.0, 1);
        assert_eq!(points.len(), 5_000);
        let found = agreement(&mesh, &accel, &even, &points, 40);
        assert_eq!(found.lines, 200_000);
        assert_eq!((found.wrong_projected, found.wrong_traced), (0, 0), "{}", object.name());
        assert!(found.largest < 1e-6, "{}: {}", object.name(), found.largest);
    }
}

#[test]
fn uneven_media_and_refracting_boundaries_agree_too() {
    let mesh = Object::Bird.place().unwrap().mesh;
    let accel = Accel::new(&mesh);
    let (low, high) = mesh.bounds();
    let layers = || Density::Layers(Layers { axis: DVec3::Y, period: 0.3, densities: vec![0.4, 1.6] });
    let with = |density: Density, ior: f64| {
        Medium::new(DVec3::splat(4.0), DVec3::ONE, Phase::Isotropic, ior, density).unwrap()
    };
    // A density that is not 1 shows whether it counts once.
    let media = [with(Density::Uniform(0.7), 1.5), with(layers(), 1.0), with(layers(), 1.3)];
    let points = points_inside(&mesh, &accel, 3_000, 0.0, 2);
    for medium in &media {
        let sampled = SampledDensity::new(medium, low, high, 48);
        for sampled in [None, Some(&sampled)] {
            for axis in even_directions(12, 5) {
                let a = project_with(&mesh, medium, sampled, &points, axis);
                let b = trace(&accel, medium, sampled, &points, axis);
                assert_eq!(a.winding, b.winding);
                for side in 0..2 {
                    for (a, b) in a.lengths(side).iter().zip(b.lengths(side)) {
                        assert!((a - b).abs() < 2e-5, "{a} {b}");
                    }
                    assert_eq!(a.boundary[side].len(), b.boundary[side].len());
                    for (a, b) in a.boundary[side].iter().zip(&b.boundary[side]) {
                        assert!((a - b).abs() < 1e-4, "{a} {b}");
                    }
                }
            }
        }
    }
}

#[test]
fn many_points_are_projected_in_blocks_as_few_are_at_once() {
    let mesh = Object::Bird.place().unwrap().mesh;
    let (low, high) = mesh.bounds();
    let even = medium(&mesh, false).unwrap();
    let spread = |i: u32| {
        // Outside points have rows too.
        let unit = DVec3::new(0.819_172_513, 0.671_043_606, 0.549_700_478) * f64::from(i);
        low + (high - low) * unit.fract()
    };
    let points: Vec<DVec3> = (0..300_000).map(spread).collect();
    let axis = DVec3::new(0.36, 0.48, 0.8);
    let whole = project_with(&mesh, &even, None, &points, axis);
    let parts: Vec<_> = points.chunks(50_000).map(|p| project_with(&mesh, &even, None, p, axis)).collect();
    for side in 0..2 {
        assert!(whole.lengths(side).iter().eq(parts.iter().flat_map(|p| p.lengths(side))));
        assert!(whole.winding[side].iter().eq(parts.iter().flat_map(|p| &p.winding[side])));
        assert!(whole.winding[side].contains(&1) && whole.winding[side].contains(&0));
    }
}

#[test]
fn bakes_by_either_method_err_alike() {
    let mesh = Object::Torus.place().unwrap().mesh;
    let even = medium(&mesh, false).unwrap();
    let params = Params { samples: 1_500, ..Params::preset(Preset::Draft) };
    let error = |how: Visibility| {
        let report = timed(&mesh, &even, &by(&params, how), &Silent).unwrap();
        let expected = if how == Visibility::Trace { "trace" } else { "project" };
        assert_eq!(report.visibility, expected);
        (report.samples, report.certificate.unwrap().error.unwrap().rel_rmse)
    };
    let (project, trace) = (error(Visibility::Project), error(Visibility::Trace));
    assert_eq!(project.0, trace.0);
    assert!((project.1 / trace.1 - 1.0).abs() < 0.02, "{project:?} {trace:?}");
    assert_eq!(error(Visibility::Auto), project);
}
