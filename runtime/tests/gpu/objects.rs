//! Synthetic assets: round meshes with jittered samples, light depths from closed forms. No bake is involved.

use diaphane_formats::asset::{Asset, DensityGrid, Info, Provenance, Samples};
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::encoding::Encoding;
use diaphane_formats::fresnel;
use diaphane_formats::harmonics::Coefficients;
use diaphane_formats::lobe;
use diaphane_formats::mesh::MeshReport;
use diaphane_formats::phase::Phase;
use diaphane_formats::sh;
use glam::{DVec3, Vec3};
use half::f16;
use std::collections::HashMap;

/// What varies between the assets.
pub struct Object {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub extinction: [f64; 3],
    pub phase: Phase,
    pub ior: f64,
    pub order: u32,
    pub encoding: Encoding,
    pub density: Option<DensityGrid>,
    /// Samples on a jittered lattice of this spacing where `inside` says so.
    pub spacing: f32,
    pub inside: fn(Vec3) -> bool,
}

/// The unit ball, grey and isotropic.
pub fn ball() -> Object {
    let (positions, triangles) = icosphere(4);
    Object {
        positions,
        triangles,
        extinction: [4.0; 3],
        phase: Phase::Isotropic,
        ior: 1.0,
        order: 5,
        encoding: Encoding::RECIPROCAL,
        density: None,
        spacing: 0.16,
        inside: |p| p.length() < 0.995,
    }
}

/// A torus around y: radii 0.75 and 0.25.
pub fn torus() -> Object {
    let (around, across) = (96u32, 48u32);
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let u = std::f32::consts::TAU * i as f32 / around as f32;
            let v = std::f32::consts::TAU * j as f32 / across as f32;
            let r = 0.75 + 0.25 * v.cos();
            positions.push(Vec3::new(r * u.cos(), 0.25 * v.sin(), r * u.sin()));
            let at = |i: u32, j: u32| (i % around) * across + j % across;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            triangles.extend([[a, d, c], [a, c, b]]);
        }
    }
    Object {
        positions,
        triangles,
        spacing: 0.09,
        inside: |p| Vec3::new(p.x.hypot(p.z) - 0.75, p.y, 0.0).length() < 0.248,
        ..ball()
    }
}

/// Density and its scattering part that vary over the cube around the ball.
pub fn uneven_grid() -> DensityGrid {
    let n = [9u32, 7, 8];
    let mut values = Vec::new();
    for z in 0..n[2] {
        for y in 0..n[1] {
            for x in 0..n[0] {
                let random = hash(11, u64::from((z * n[1] + y) * n[0] + x)) as f32 / 2f32.powi(64);
                let density = 0.3 + 1.6 * random;
                values.push([f16::from_f32(density), f16::from_f32(density * (0.5 + 0.5 * random))]);
            }
        }
    }
    DensityGrid { size: n, min: [-1.1; 3], max: [1.1; 3], values }
}

impl Object {
    /// The asset, with one set of coefficients for each sample.
    pub fn build(&self) -> Asset {
        let points = self.points();
        let n = self.order as usize * self.order as usize;
        let directions = even_directions(256, 5);
        let bases: Vec<Vec<f64>> = directions
            .iter()
            .map(|d| {
                let mut basis = vec![0.0; n];
                sh::evaluate(self.order as usize, d.to_array(), &mut basis);
                basis
            })
            .collect();
        let solid_angle = 4.0 * std::f64::consts::PI / directions.len() as f64;
        let project = |f: &dyn Fn(DVec3) -> f64| {
            let mut sum = vec![0.0; n];
            for (direction, basis) in directions.iter().zip(&bases) {
                let value = f(*direction) * solid_angle;
                sum.iter_mut().zip(basis).for_each(|(s, y)| *s += value * y);
            }
            sum.into_iter().map(|c| c as f32).collect::<Vec<f32>>()
        };
        let reference = self.extinction.iter().sum::<f64>() / 3.0;
        let mut samples = Samples::default();
        // Fewer bands for every third sample, as a bake has them.
        let orders =
            (0..points.len()).map(|i| (self.order - u32::from(i % 3 == 0 && self.order > 2)) as u8).collect();
        let mut depth = Coefficients::zeros(orders);
        let boundary = if self.ior == 1.0 { 0 } else { self.order };
        let mut through =
            Coefficients::zeros(vec![boundary as u8; if boundary > 0 { points.len() } else { 0 }]);
        for (i, p) in points.iter().enumerate() {
            let x = p.as_dvec3();
            samples.offset.push([0; 4]);
            samples.position_radius.push([p.x, p.y, p.z, 0.55 * self.spacing]);
            samples.weight.push(0.5 + hash(3, u64::from(p.x.to_bits())) as f32 / 2f32.powi(64));
            let stored = project(&|d| self.encoding.encode(reference * chord(x, d)));
            let own = depth.of_mut(i);
            own.copy_from_slice(&stored[..own.len()]);
            if self.encoding.has_lobe() {
                // Every fourth has none, as in a bake.
                let a = if i % 4 == 1 { Vec3::ZERO } else { x.normalize().as_vec3() * 0.3 };
                samples.lobe.push(lobe::vector(lobe::code(a)));
            }
            if self.ior != 1.0 {
                let exit = |d: DVec3| (x + d * chord(x, d)).normalize().dot(d);
                let stored = project(&|d| fresnel::transmittance(exit(d), self.ior));
                through.of_mut(i).copy_from_slice(&stored);
            }
        }
        samples.depth = depth.quantised();
        samples.boundary = through.quantised();
        let low = self.positions.iter().fold(Vec3::INFINITY, |a, p| a.min(*p));
        let high = self.positions.iter().fold(Vec3::NEG_INFINITY, |a, p| a.max(*p));
        let asset = Asset {
            info: Info {
                provenance: Provenance {
                    program: "test".to_owned(),
                    mesh_name: String::new(),
                    mesh_hash: [0; 32],
                    material_name: String::new(),
                    seed: 0,
                    directions: 256,
                    mesh_report: MeshReport::default(),
                },
                centre: [10.0, -20.0, 5.0],
                bounds: [low.to_array(), high.to_array()],
                extinction: self.extinction,
                albedo: [0.9, 0.8, 0.6],
                phase: self.phase,
                ior: self.ior,
                uniform_density: 1.0,
                samples: points.len() as u64,
                discarded: 0,
                order: self.order,
                light_error: 0.0,
                boundary_order: boundary,
                encoding: self.encoding,
                reference_extinction: reference,
                width_factor: 1.5,
                certificate: None,
            },
            samples,
            levels: Vec::new(),
            mesh_positions: self.positions.iter().map(|p| p.to_array()).collect(),
            mesh_triangles: self.triangles.clone(),
            density: self.density.clone(),
        };
        asset.validate().unwrap();
        asset
    }

    fn points(&self) -> Vec<Vec3> {
        let half = (1.0 / self.spacing).ceil() as i32;
        let mut points = Vec::new();
        for z in -half..=half {
            for y in -half..=half {
                for x in -half..=half {
                    let cell = ((z + half) * 1000 + y + half) * 1000 + x + half;
                    let random = |k: u64| hash(k, cell as u64) as f32 / 2f32.powi(64) - 0.5;
                    let jitter = Vec3::new(random(1), random(2), random(3)) * 0.5;
                    let p = (Vec3::new(x as f32, y as f32, z as f32) + jitter) * self.spacing;
                    if (self.inside)(p) {
                        points.push(p);
                    }
                }
            }
        }
        points
    }
}

/// Distance from `x` inside the unit ball to its surface along `d`.
fn chord(x: DVec3, d: DVec3) -> f64 {
    let along = x.dot(d);
    (along * along + 1.0 - x.length_squared()).max(0.0).sqrt() - along
}

/// An icosahedron, divided `levels` times and blown up to the unit sphere.
fn icosphere(levels: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5f32.sqrt());
    let mut positions = Vec::new();
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        positions.extend([Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)]);
    }
    // All triples of mutual neighbours (distance 2), turned outwards.
    let mut triangles = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| positions[i as usize]);
                if [p.distance(q), q.distance(r), r.distance(p)].iter().all(|d| (d - 2.0).abs() < 1e-3) {
                    let outwards = (q - p).cross(r - p).dot(p) > 0.0;
                    triangles.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    positions.iter_mut().for_each(|p| *p = p.normalize());
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for t in triangles {
            let m: [u32; 3] = std::array::from_fn(|k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push((positions[a as usize] + positions[b as usize]).normalize());
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[t[0], m[0], m[2]], [m[0], t[1], m[1]], [m[2], m[1], t[2]], m]);
        }
        triangles = finer;
    }
    (positions, triangles)
}
