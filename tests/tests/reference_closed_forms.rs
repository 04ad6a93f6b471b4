//! The reference against media and shapes whose picture can be written down.

mod support;

use diaphane_assets::shapes::{cuboid, icosphere};
use diaphane_formats::medium::{Density, Grid, Layers, Medium, Noise, Shape, Shapes, Solid};
use diaphane_formats::mesh::Mesh;
use diaphane_formats::phase::Phase;
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::{Environment, Scene};
use glam::DVec3;
use std::f64::consts::PI;
use support::{gauss, scene};
use validation::metrics::compare;
use validation::reference::{Settings, render};

fn picture(mesh: &Mesh, medium: &Medium, scene: &Scene, tolerance: f64) -> Picture {
    let settings = Settings { tolerance, ..Settings::default() };
    let reference = render(mesh, medium, scene, &settings, &|_| ()).unwrap();
    assert!(reference.converged);
    reference.picture
}

fn uniform(kappa: f64, phase: Phase, ior: f64) -> Medium {
    Medium::new(DVec3::splat(kappa), DVec3::ONE, phase, ior, Density::Uniform(1.0)).unwrap()
}

/// Distance from a point inside the unit sphere to the sphere along a unit vector.
fn to_sphere(x: DVec3, w: DVec3) -> f64 {
    let b = x.dot(w);
    -b + (b * b + 1.0 - x.length_squared()).max(0.0).sqrt()
}

#[test]
fn homogeneous_ball_matches_chord_lengths() {
    // 327,680 triangles, scaled so that their volume is the ball's: chords are off by a few 1e-6.
    let mut ball = icosphere(1.0, 7);
    let volume = ball.to_mesh().unwrap().volume();
    ball.positions.iter_mut().for_each(|p| *p *= (4.0 / 3.0 * PI / volume).cbrt());
    let scene = scene(
        "[camera]\nposition=[0,0,4]\ntarget=[0,0,0]\nvertical_fov_degrees=32\n[image]\nwidth=64\nheight=64\n\
         [[lights]]\ntype='point'\nposition=[3,0,0]\nintensity=[100,50,10]\n\
         [[lights]]\ntype='directional'\ndirection=[0.6,-0.8,0]\nirradiance=[0,3,7]\n",
    );
    let (kappa, albedo) = (DVec3::new(4.0, 2.0, 9.0), DVec3::new(0.5, 0.7, 0.9));
    let phase = Phase::HenyeyGreenstein { g: 0.4 };
    let medium = Medium::new(kappa, albedo, phase, 1.0, Density::Uniform(1.0)).unwrap();
    let got = picture(&ball.to_mesh().unwrap(), &medium, &scene, 4e-4);
    let frame = scene.ray_frame().unwrap();
    let (pixel, along) = (gauss(6), gauss(40));
    let exact = |x: f64, y: f64| -> DVec3 {
        let d = frame.direction(x, y, 64.0, 64.0);
        let b = frame.origin.dot(d);
        let inside = b * b - frame.origin.length_squared() + 1.0;
        if inside <= 0.0 {
            return DVec3::ZERO;
        }
        let (start, length) = (-b - inside.sqrt(), 2.0 * inside.sqrt());
        let mut sum = DVec3::ZERO;
        for &(u, w) in &along {
            let p = frame.origin + d * (start + u * length);
            let to = DVec3::new(3.0, 0.0, 0.0) - p;
            let lights = [
                (to.normalize(), DVec3::new(100.0, 50.0, 10.0) / to.length_squared()),
                (DVec3::new(-0.6, 0.8, 0.0), DVec3::new(0.0, 3.0, 7.0)),
            ];
            for (towards, irradiance) in lights {
                // Henyey-Greenstein; light travels along -towards, the eye lies along -d.
                let base: f64 = 1.0 + 0.16 - 0.8 * towards.dot(d);
                let phase = 0.84 / (4.0 * PI * base.powf(1.5));
                let depth = u * length + to_sphere(p, towards);
                sum += (-kappa * depth).exp() * kappa * albedo * irradiance * (phase * w * length);
            }
        }
        sum
    };
    let mut wanted = Picture::new(64, 64);
    for (i, value) in wanted.pixels.iter_mut().enumerate() {
        let mut sum = DVec3::ZERO;
        for &(u, a) in &pixel {
            for &(v, b) in &pixel {
                sum += exact((i % 64) as f64 + u, (i / 64) as f64 + v) * (a * b);
            }
        }
        *value = sum.as_vec3().to_array();
    }
    let m = compare(&got, &wanted, got.coverage.as_ref().unwrap()).unwrap();
    println!("rel_rmse {:.6}, bias {:+.6}, {} pixels", m.rel_rmse, m.bias, m.pixels);
    assert!(m.rel_rmse <= 1e-3 && m.bias.abs() < 2e-4, "{m:?}");
}

/// Looks along -z at a box from far away through a very narrow field of view: all rays are one ray.
const NARROW: &str = "[camera]\nposition=[0.13,0.07,60]\ntarget=[0.13,0.07,0]\nvertical_fov_degrees=1e-4\n\
                      [image]\nwidth=2\nheight=2\n";

fn slab_value(medium: &Medium, lights: &str) -> f64 {
    let mesh = cuboid([0.5, 0.6, 0.7], 3).to_mesh().unwrap();
    let p = picture(&mesh, medium, &scene(&format!("{NARROW}{lights}")), 3e-4);
    p.pixels.iter().map(|v| f64::from(v[0])).sum::<f64>() / 4.0
}

const FRONT: &str = "[[lights]]\ntype='directional'\ndirection=[0,0,-1]\nirradiance=[8,8,8]\n";
const BACK: &str = "[[lights]]\ntype='directional'\ndirection=[0,0,1]\nirradiance=[8,8,8]\n";

#[test]
fn any_density_lit_along_the_view_depends_on_its_mass_only() {
    // From the front ∫ κρ e^{-2κm} E/4π dz = (1 - e^{-2κM}) E/8π, from behind ∫ κρ e^{-κM} E/4π dz = κM e^{-κM} E/4π,
    // with M = ∫ρ dz through the box, whatever the arrangement.
    let values = (0..6 * 5 * 9).map(|i| ((i * 7 + i / 5) % 11) as f32 * 0.3).collect();
    let solid = |solid, density| Shape { solid, density, absorb: false };
    let torus =
        Solid::Torus { center: DVec3::ZERO, axis: DVec3::new(0.0, 0.6, 0.8), radius: 0.2, tube: 0.15 };
    let shapes = vec![
        solid(torus, 5.0),
        solid(Solid::Sphere { center: DVec3::new(0.1, 0.0, 0.3), radius: 0.2 }, 2.0),
        solid(Solid::Box { min: DVec3::splat(-0.5), max: DVec3::new(0.3, 0.2, -0.2) }, 0.2),
    ];
    let fields = [
        Density::Uniform(1.3),
        Density::Layers(Layers {
            axis: DVec3::new(0.36, 0.48, 0.8),
            period: 0.25,
            densities: vec![1.0, 0.2, 3.0],
        }),
        Density::Grid(Grid::new([6, 5, 9], DVec3::splat(-0.8), DVec3::splat(0.9), values).unwrap()),
        Density::Noise(Noise { seed: 3, frequency: 3.0, octaves: 3, range: [0.2, 1.8] }),
        Density::Shapes(Shapes { base: 0.7, shapes }),
    ];
    for field in fields {
        let n = 200_000;
        let at = |i: u32| DVec3::new(0.13, 0.07, -0.7 + 1.4 * (f64::from(i) + 0.5) / f64::from(n));
        let mass: f64 = (0..n).map(|i| field.value(at(i)).0).sum::<f64>() * 1.4 / f64::from(n);
        let kappa = 1.7;
        let medium = Medium::new(DVec3::splat(kappa), DVec3::ONE, Phase::Isotropic, 1.0, field).unwrap();
        let front = (1.0 - (-2.0 * kappa * mass).exp()) * 8.0 / (8.0 * PI);
        let back = kappa * mass * (-kappa * mass).exp() * 8.0 / (4.0 * PI);
        let (got_front, got_back) = (slab_value(&medium, FRONT), slab_value(&medium, BACK));
        println!("M {mass:.4}: front {got_front:.6} of {front:.6}, back {got_back:.6} of {back:.6}");
        assert!((got_front / front - 1.0).abs() < 1e-3, "{:?}", medium.density_field());
        assert!((got_back / back - 1.0).abs() < 1e-3, "{:?}", medium.density_field());
    }
}

#[test]
fn an_absorbing_inclusion_hides_what_lies_behind_it() {
    // A ball of density 3 that scatters nothing between 0.25 and -0.25 (radius √(0.25² + 0.13² + 0.07²)) in a box of
    // density 1: lit from the front, the eye sees the 0.45 in front and, through twice 3 · 0.5, the 0.45 behind.
    let radius = (0.25f64.powi(2) + 0.13f64.powi(2) + 0.07f64.powi(2)).sqrt();
    let solid = Solid::Sphere { center: DVec3::ZERO, radius };
    let field =
        Density::Shapes(Shapes { base: 1.0, shapes: vec![Shape { solid, density: 3.0, absorb: true }] });
    let medium = Medium::new(DVec3::ONE, DVec3::ONE, Phase::Isotropic, 1.0, field).unwrap();
    let part = |from: f64, to: f64| (-2.0 * from).exp() - (-2.0 * to).exp();
    let exact = (part(0.0, 0.45) + part(1.95, 2.4)) * 8.0 / (8.0 * PI);
    let got = slab_value(&medium, FRONT);
    assert!((got / exact - 1.0).abs() < 1e-3, "{got} {exact}");
}

#[test]
fn fresnel_factors_at_normal_incidence() {
    // Each of camera ray and shadow ray passes one face at normal incidence: 0.96² at n = 1.5. From behind the light
    // passes the far face instead.
    for (lights, exact) in [
        (FRONT, (1.0 - (-2.8f64).exp()) * 8.0 / (8.0 * PI)),
        (BACK, 1.4 * (-1.4f64).exp() * 8.0 / (4.0 * PI)),
    ] {
        let got = slab_value(&uniform(1.0, Phase::Isotropic, 1.5), lights);
        assert!((got / (exact * 0.96 * 0.96) - 1.0).abs() < 1e-3, "{got} {exact}");
    }
}

#[test]
fn a_light_inside_ends_its_own_depth() {
    // A point light on the view axis at z = 0 in a box: from z in front of it the depth is |z|, nothing beyond it
    // counts. The scene's axis passes 1e-9 beside the light, so the clamp at 1e-3 diagonal acts:
    // ∫ e^{-κ(0.7-z)} κ/4π e^{-κ|z|} / max(|z|, c)² dz.
    let mesh = cuboid([0.5, 0.6, 0.7], 3).to_mesh().unwrap();
    let clamp = 1e-3 * mesh.diagonal();
    let n = 2_000_000;
    let exact: f64 = (0..n)
        .map(|i| {
            let z = -0.7 + 1.4 * (f64::from(i) + 0.5) / f64::from(n);
            (-(0.7 - z) - z.abs()).exp() / (4.0 * PI) / z.abs().max(clamp).powi(2)
        })
        .sum::<f64>()
        * 1.4
        / f64::from(n);
    let light = "[[lights]]\ntype='point'\nposition=[0.13,0.07,0]\nintensity=[1,1,1]\n";
    let got = slab_value(&uniform(1.0, Phase::Isotropic, 1.0), light);
    assert!((got / exact - 1.0).abs() < 3e-3, "{got} {exact}");
}

#[test]
fn a_thin_medium_in_a_white_environment_glows_like_its_chord() {
    // τ → 0: L = κ · chord · ∫ p dω = κ · chord for any phase function.
    let mesh = cuboid([0.5, 0.6, 0.7], 3).to_mesh().unwrap();
    for phase in [Phase::Isotropic, Phase::HenyeyGreenstein { g: 0.6 }] {
        let mut s = scene(NARROW);
        let mut sky = Picture::new(16, 8);
        sky.pixels.fill([0.5; 3]);
        s.environment = Some(Environment { picture: sky, scale: 2.0 });
        let p = picture(&mesh, &uniform(1e-6, phase, 1.0), &s, 1e-3);
        let got = f64::from(p.pixels[0][0]) / 1.4e-6;
        assert!((got - 1.0).abs() < 3e-3, "{got}");
    }
}

#[test]
fn a_furnace_is_never_exceeded() {
    // Radiance 1 from everywhere and albedo 1: single scattering alone stays below 1 - e^{-τ}, the part of the view
    // ray that meets anything, and above that times the least transmittance to the outside.
    let mesh = icosphere(1.0, 4).to_mesh().unwrap();
    let mut s = scene(
        "[camera]\nposition=[0,0,4]\ntarget=[0,0,0]\nvertical_fov_degrees=32\n[image]\nwidth=24\nheight=24\n",
    );
    let mut sky = Picture::new(16, 8);
    sky.pixels.fill([1.0; 3]);
    s.environment = Some(Environment { picture: sky, scale: 1.0 });
    let frame = s.ray_frame().unwrap();
    for kappa in [0.1, 1.0, 4.0] {
        let p = picture(&mesh, &uniform(kappa, Phase::Isotropic, 1.0), &s, 4e-3);
        for (i, value) in p.pixels.iter().enumerate().filter(|(i, _)| p.coverage.as_ref().unwrap()[*i] == 1.0)
        {
            // The pixel's chord lies between those of its corners nearest to and farthest from the centre.
            let corners = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(x, y)| {
                let d = frame.direction((i % 24 + x) as f64, (i / 24 + y) as f64, 24.0, 24.0);
                let b = frame.origin.dot(d);
                2.0 * (b * b - 15.0).max(0.0).sqrt()
            });
            let longest = corners.iter().fold(0.0f64, |m, c| m.max(*c));
            let shortest = corners.iter().fold(2.0f64, |m, c| m.min(*c)) * 0.98;
            let met = |chord: f64| 1.0 - (-kappa * chord).exp();
            let value = f64::from(value[0]);
            assert!(value < met(longest) * 1.05, "κ {kappa}, pixel {i}: {value} above {}", met(longest));
            let least = met(shortest) * (-2.0 * kappa).exp();
            assert!(value > least * 0.95, "κ {kappa}, pixel {i}: {value} below {least}");
        }
    }
}
