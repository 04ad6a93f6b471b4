//! A homogeneous ball baked by hand, and its single scattering in closed form along rays.

#![allow(dead_code)] // each test file uses its own part

use diaphane_formats::asset::{Asset, Info, Provenance, Samples};
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::harmonics::Coefficients;
use diaphane_formats::mesh::{Mesh, MeshReport};
use diaphane_formats::phase::Phase;
use diaphane_formats::scene::{Camera, ImageSize, Light, Scene, Surface};
use diaphane_formats::sh;
use glam::DVec3;

/// Bands of the ball's spherical harmonics.
pub const ORDER: usize = 5;

/// κ of the ball.
pub const EXTINCTION: f64 = 4.0;

/// A unit sphere of `20 · 4^levels` triangles with its vertices on the sphere.
pub fn sphere_mesh(levels: usize) -> Mesh {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut positions = Vec::new();
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        positions.push(DVec3::new(0.0, a, b));
        positions.push(DVec3::new(a, b, 0.0));
        positions.push(DVec3::new(b, 0.0, a));
    }
    // Faces of the icosahedron: triples of vertices at the edge length 2 from each other.
    let near = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let (a, b, c) = (positions[i], positions[j], positions[k]);
                if near(a, b) && near(b, c) && near(a, c) {
                    triangles.push([a, b, c]);
                }
            }
        }
    }
    for _ in 0..levels {
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let unit = |p: DVec3| p.normalize();
                let (ab, bc, ca) =
                    (unit(unit(a) + unit(b)), unit(unit(b) + unit(c)), unit(unit(c) + unit(a)));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let corners: Vec<DVec3> = triangles.iter().flatten().map(|p| p.normalize()).collect();
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    // Midpoints of an edge come out the same from both sides up to rounding: weld on a fine lattice.
    let lattice = corners.iter().map(|p| (*p * 1e9).round() / 1e9).collect();
    Mesh::from_triangles(lattice, indices).unwrap().0
}

/// Distance from `x` inside the unit sphere to the sphere along the unit vector `w`.
pub fn chord(x: DVec3, w: DVec3) -> f64 {
    let b = x.dot(w);
    (b * b + 1.0 - x.length_squared()).max(0.0).sqrt() - b
}

/// The ball around `centre`: samples on a jittered grid of this spacing, those near the surface moved onto it.
pub fn ball(spacing: f64, centre: DVec3, phase: Phase) -> Asset {
    let mut places = Vec::new();
    let half = (1.0 / spacing).ceil() as i64 + 1;
    for (i, j, k) in
        (-half..=half).flat_map(|i| (-half..=half).flat_map(move |j| (-half..=half).map(move |k| (i, j, k))))
    {
        let seed = hash(17, (((i + 1000) * 4000 + j + 1000) * 4000 + k + 1000) as u64);
        let jitter = |n| (hash(seed, n) as f64 / 2f64.powi(64) - 0.5) * 0.6;
        let p = DVec3::new(i as f64 + jitter(0), j as f64 + jitter(1), k as f64 + jitter(2)) * spacing;
        if p.length() < 1.0 + 0.3 * spacing {
            let onto = p.length() > 1.0 - 0.3 * spacing;
            places.push(if onto { p.normalize() * 0.999 } else { p });
        }
    }
    let encoding = Encoding::RECIPROCAL;
    let directions = even_directions(256, 1);
    let basis: Vec<[f64; ORDER * ORDER]> = directions
        .iter()
        .map(|w| {
            let mut y = [0.0; ORDER * ORDER];
            sh::evaluate(ORDER, w.to_array(), &mut y);
            y
        })
        .collect();
    let solid_angle = 4.0 * std::f64::consts::PI / directions.len() as f64;
    let mut samples = Samples::default();
    let mut depth = Coefficients::zeros(vec![ORDER as u8; places.len()]);
    for (i, p) in places.iter().enumerate() {
        let mut coefficients = [0.0; ORDER * ORDER];
        for (w, y) in directions.iter().zip(&basis) {
            let value = encoding.encode(EXTINCTION * chord(*p, *w)) * solid_angle;
            coefficients.iter_mut().zip(y).for_each(|(c, y)| *c += value * y);
        }
        let q = p.as_vec3();
        samples.offset.push([0; 4]);
        samples.position_radius.push([q.x, q.y, q.z, spacing as f32]);
        samples.weight.push(1.0);
        depth.of_mut(i).copy_from_slice(&coefficients.map(|c| c as f32));
    }
    samples.depth = depth.quantised();
    let mesh = sphere_mesh(4);
    let (low, high) = mesh.bounds();
    Asset {
        info: Info {
            provenance: Provenance {
                program: "test".to_owned(),
                mesh_name: "ball".to_owned(),
                mesh_hash: [0; 32],
                material_name: "ball".to_owned(),
                seed: 17,
                directions: 256,
                mesh_report: MeshReport::default(),
            },
            centre: centre.to_array(),
            bounds: [low.as_vec3().to_array(), high.as_vec3().to_array()],
            extinction: [EXTINCTION; 3],
            albedo: [0.8, 0.6, 0.4],
            phase,
            ior: 1.0,
            uniform_density: 1.0,
            samples: samples.len() as u64,
            discarded: 0,
            order: ORDER as u32,
            light_error: 0.0,
            boundary_order: 0,
            encoding,
            reference_extinction: EXTINCTION,
            width_factor: 1.4,
            certificate: None,
        },
        samples,
        levels: Vec::new(),
        mesh_positions: mesh.positions.iter().map(|p| p.as_vec3().to_array()).collect(),
        mesh_triangles: mesh.triangles.clone(),
        density: None,
    }
}

/// The ball seen from +z with the given lights.
pub fn scene(centre: DVec3, side: u32, rays: u32, lights: Vec<Light>) -> Scene {
    Scene {
        camera: Camera {
            position: centre + DVec3::new(0.4, 0.6, 4.6),
            target: centre,
            up: DVec3::Y,
            vertical_fov_degrees: 28.0,
        },
        image: ImageSize { width: side, height: side, samples_per_pixel: rays },
        surface: Surface { reflection: false, specular: 0.5, roughness: 0.3 },
        environment: None,
        lights,
        exact: Vec::new(),
    }
}

/// A point light at a place relative to `centre`.
pub fn point(centre: DVec3, position: DVec3, intensity: f64) -> Light {
    Light::Point { position: centre + position, intensity: DVec3::splat(intensity) }
}

/// Single scattering of the ball along a ray (relative to its centre), by the midpoint rule with exact light
/// attenuation: the step of 1/300 mean free path or finer makes an error below 1e-4.
pub fn reference(asset: &Asset, lights: &[Light], origin: DVec3, direction: DVec3) -> DVec3 {
    let b = origin.dot(direction);
    let inside = b * b + 1.0 - origin.length_squared();
    if inside <= 0.0 {
        return DVec3::ZERO;
    }
    let (start, end) = ((-b - inside.sqrt()).max(0.0), -b + inside.sqrt());
    if end <= start {
        return DVec3::ZERO;
    }
    let steps = 600;
    let h = (end - start) / f64::from(steps);
    let mut sum = DVec3::ZERO;
    for i in 0..steps {
        let t = start + (f64::from(i) + 0.5) * h;
        let x = origin + direction * t;
        for light in lights {
            let (to, distance, irradiance) = light.at(x, 1e-3);
            let depth = EXTINCTION * chord(x, to).min(distance);
            let phase = asset.info.phase.value(to.dot(direction));
            sum += irradiance * (phase * (-depth - EXTINCTION * (t - start)).exp() * EXTINCTION * h);
        }
    }
    sum * DVec3::from(asset.info.albedo)
}
