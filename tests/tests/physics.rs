//! Identities that optical depths must obey, whoever computes them.

mod support;

use diaphane_assets::shapes::{self, Triangles};
use diaphane_formats::directions::even_directions;
use diaphane_formats::medium::{Density, Layers, Medium};
use diaphane_formats::mesh::Mesh;
use diaphane_formats::phase::Phase;
use diaphane_formats::visibility::{Accel, depth_along, project};
use glam::DVec3;
use std::f64::consts::PI;
use validation::speed::visibility::points_inside;

fn medium(kappa: f64, ior: f64, density: Density) -> Medium {
    Medium::new(DVec3::splat(kappa), DVec3::ONE, Phase::Isotropic, ior, density).unwrap()
}

fn layers() -> Density {
    Density::Layers(Layers { axis: DVec3::new(0.6, 0.8, 0.0), period: 0.5, densities: vec![1.0, 0.2] })
}

#[test]
fn divergence_of_the_first_moment_is_extinction_times_fluence() {
    // ω·∇τ = -κt(x) for every direction, so Σ w ω·∇ψ = κt(x) Σ w ψ for any set of directions: finite differences of
    // T against κt Φ. The facets' edges bend ψ slightly; step 1e-4 and 400 directions leave 1e-3 of κΦ.
    let mesh = shapes::icosphere(1.0, 5).to_mesh().unwrap();
    let accel = Accel::new(&mesh);
    let directions = even_directions(400, 5);
    let weight = 4.0 * PI / directions.len() as f64;
    for density in [Density::Uniform(0.8), layers()] {
        let medium = medium(3.0, 1.0, density);
        let step = 1e-4;
        // Away from the jumps of the density, where κt(x) has no single value.
        let rho = |x: DVec3| medium.density(x);
        let far_from_jumps = |x: &DVec3| {
            (-10..=10).all(|i| rho(*x + DVec3::new(0.6, 0.8, 0.0) * 1e-4 * f64::from(i)) == rho(*x))
        };
        let points = points_inside(&mesh, &accel, 30, 0.01, 11);
        for x in points.into_iter().filter(far_from_jumps) {
            let psi = |p: DVec3, w: DVec3| {
                (-3.0 * depth_along(&accel, &medium, p, w, f64::INFINITY, &mut Vec::new()).density_length)
                    .exp()
            };
            let mut divergence = 0.0;
            let mut fluence = 0.0;
            for w in &directions {
                fluence += weight * psi(x, *w);
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    let slope = (psi(x + axis * step, *w) - psi(x - axis * step, *w)) / (2.0 * step);
                    divergence += weight * w.dot(axis) * slope;
                }
            }
            let expected = 3.0 * rho(x) * fluence;
            assert!((divergence / expected - 1.0).abs() < 2e-3, "{x}: {divergence} {expected}");
        }
    }
}

#[test]
fn chords_of_a_ball_lie_between_those_of_its_bounds() {
    // The polyhedron lies within the unit ball and around the ball that touches its nearest face: so do its chords.
    let mesh = shapes::icosphere(1.0, 5).to_mesh().unwrap();
    let accel = Accel::new(&mesh);
    let nearest = |i: usize| mesh.area_normal(i).normalize().dot(mesh.corners(i)[0]);
    let inner = (0..mesh.triangles.len()).map(nearest).fold(f64::INFINITY, f64::min);
    assert!(inner > 0.999);
    let medium = medium(1.0, 1.0, Density::Uniform(1.0));
    let points: Vec<DVec3> = points_inside(&mesh, &accel, 200, 1.0 - inner + 1e-6, 11);
    let chord = |x: DVec3, w: DVec3, r: f64| {
        let b = x.dot(w);
        -b + (b * b + r * r - x.length_squared()).sqrt()
    };
    for w in even_directions(24, 2) {
        let rows = project(&mesh, &medium, &points, w);
        for (i, x) in points.iter().enumerate() {
            let traced = depth_along(&accel, &medium, *x, w, f64::INFINITY, &mut Vec::new());
            assert_eq!(traced.winding, 1);
            for (got, along) in [
                (traced.density_length, w),
                (f64::from(rows.forward[i]), w),
                (f64::from(rows.backward[i]), -w),
            ] {
                let (least, most) = (chord(*x, along, inner), chord(*x, along, 1.0));
                assert!(got > least - 1e-6 && got < most + 1e-6, "{x} {along}: {got} not in {least}..{most}");
            }
        }
    }
}

fn agreement(name: &str, shape: &Triangles, medium: &Medium) {
    let mesh: Mesh = shape.to_mesh().unwrap();
    let accel = Accel::new(&mesh);
    let points = points_inside(&mesh, &accel, 150, 1e-3, 11);
    let close = 3e-6 * mesh.diagonal();
    for w in even_directions(24, 8).into_iter().step_by(2) {
        let rows = project(&mesh, medium, &points, w);
        for (i, x) in points.iter().enumerate() {
            for (side, along, got) in [(0, w, rows.forward[i]), (1, -w, rows.backward[i])] {
                let traced = depth_along(&accel, medium, *x, along, f64::INFINITY, &mut Vec::new());
                let difference = (f64::from(got) - traced.density_length).abs();
                assert!(difference < close, "{name} at {x} along {along}: {got} {}", traced.density_length);
                assert_eq!(i32::from(rows.winding[side][i]), traced.winding, "{name} at {x} along {along}");
                if medium.ior() != 1.0 {
                    let difference = (f64::from(rows.boundary[side][i]) - traced.boundary).abs();
                    assert!(difference < 1e-5, "{name} at {x} along {along}: boundary");
                }
            }
        }
    }
}

#[test]
fn projecting_the_mesh_and_tracing_rays_agree() {
    let shapes = [
        ("ball", shapes::icosphere(1.0, 4)),
        ("torus", shapes::torus(0.7, 0.28, 64, 32)),
        ("bird", shapes::bird()),
        ("cube", shapes::cuboid([0.5; 3], 6)),
        ("rounded block", shapes::rounded_cuboid([0.7, 0.5, 0.5], 0.06, 6)),
    ];
    for (name, shape) in shapes {
        agreement(name, &shape, &medium(1.0, 1.0, Density::Uniform(0.7)));
        agreement(name, &shape, &medium(1.0, 1.0, layers()));
        agreement(name, &shape, &medium(1.0, 1.4, Density::Uniform(1.0)));
    }
}
