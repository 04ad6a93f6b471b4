//! Highlights of the scene's lights on the surface where a ray first enters the object.
//!
//! With V the unit vector towards the camera, L towards the light, H = normalize(V + L), n the smooth and g the
//! geometric normal at the entry, E the light's irradiance there ([`FrameLight::at`]), r the roughness:
//!
//!   n       = normalize(Σ barycentric_k · corner normal_k); g in its place where n·V ≤ 0 or n is no number
//!   α       = max(r, 0.05)²
//!   D       = α² / (π (|n×H|² + α² (n·H)²)²)           GGX (Trowbridge and Reitz 1975), 1 - (n·H)² as |n×H|²
//!   F       = 1 - transmittance(V·H, ior)               unpolarised Fresnel, see `formats::fresnel`
//!   highlight = Σ_l specular · E_l (n·L) F D / (4 max((L·H)², 0.01))
//!
//! The last quotient is the shadowing term of Kelemen and Szirmay-Kalos (2001), bounded at grazing angles. A light
//! counts only where n·L > 0 and g·L > 0; it is not shadowed by other parts of the object. Nothing is drawn when
//! `ior` is 1, `surface.reflection` is off, or the camera is inside. Lights that stand for an environment make no
//! highlights. Always finite and not negative.
//!
//! Corner normals are the mean of the adjacent faces' normals weighted by the angle at the vertex; a corner whose
//! mean turns away from its own face by more than [`CREASE_COSINE`] keeps the face's normal, so that edges stay hard.

use crate::frame::Frame;
use diaphane_formats::fresnel;
use diaphane_formats::mesh::Mesh;
use glam::{DVec3, Vec3};

/// Roughness is clamped from below at this value.
pub const LEAST_ROUGHNESS: f32 = 0.05;

/// Smallest cosine between a corner's smooth normal and its face's normal.
pub const CREASE_COSINE: f64 = 0.7;

/// Unit normals of the three corners of every triangle (zero for a triangle without area).
pub fn corner_normals(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    let faces: Vec<DVec3> =
        (0..mesh.triangles.len()).map(|i| mesh.area_normal(i).normalize_or_zero()).collect();
    for (i, t) in mesh.triangles.iter().enumerate() {
        let p = mesh.corners(i);
        for k in 0..3 {
            let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            sums[t[k] as usize] += faces[i] * a.cross(b).length().atan2(a.dot(b));
        }
    }
    let corner = |v: u32, face: DVec3| {
        let smooth = sums[v as usize].normalize_or_zero();
        if smooth.dot(face) > CREASE_COSINE { smooth.as_vec3() } else { face.as_vec3() }
    };
    mesh.triangles.iter().zip(&faces).map(|(t, &face)| t.map(|v| corner(v, face))).collect()
}

/// Where a ray enters the object.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Entry point relative to the asset's centre.
    pub point: Vec3,
    /// Smooth unit normal, interpolated; may be zero or point away from the camera.
    pub smooth: Vec3,
    /// Geometric unit normal.
    pub geometric: Vec3,
}

impl Entry {
    /// The entry at `point` of a triangle with these corners and corner normals.
    pub fn new(point: Vec3, corners: [Vec3; 3], normals: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        let area = (b - a).cross(c - a);
        let inverse = 1.0 / area.length_squared();
        let u = (c - b).cross(point - b).dot(area) * inverse;
        let v = (a - c).cross(point - c).dot(area) * inverse;
        let smooth = normals[0] * u + normals[1] * v + normals[2] * (1.0 - u - v);
        Self { point, smooth: smooth.normalize_or_zero(), geometric: area.normalize_or_zero() }
    }
}

/// Whether a frame of an object with this index of refraction has highlights at all.
pub fn is_drawn(frame: &Frame, ior: f64) -> bool {
    frame.surface.reflection && ior != 1.0 && frame.surface.specular > 0.0 && frame.scene_lights > 0
}

/// Radiance that the entry reflects towards the camera; `direction` is the camera ray's unit direction.
pub fn highlight(frame: &Frame, ior: f64, entry: &Entry, direction: Vec3) -> Vec3 {
    let towards_camera = -direction;
    let n = if entry.smooth.dot(towards_camera) > 0.0 { entry.smooth } else { entry.geometric };
    let alpha = (frame.surface.roughness as f32).max(LEAST_ROUGHNESS).powi(2);
    let mut sum = Vec3::ZERO;
    for light in &frame.lights[..frame.scene_lights] {
        let (to, _, irradiance) = light.at(entry.point, frame.least_distance);
        let cosine = n.dot(to);
        if cosine <= 0.0 || entry.geometric.dot(to) <= 0.0 {
            continue;
        }
        let half = (towards_camera + to).normalize_or_zero();
        let (nh, lh) = (n.dot(half), to.dot(half));
        let base = n.cross(half).length_squared() + alpha * alpha * nh * nh;
        let lobe = alpha * alpha / (std::f32::consts::PI * (base * base).max(1e-20));
        let fresnel = 1.0 - fresnel::transmittance(f64::from(lh), ior) as f32;
        sum += irradiance * (cosine * fresnel * lobe / (4.0 * (lh * lh).max(0.01)));
    }
    let highlight = sum * frame.surface.specular as f32;
    if highlight.is_finite() { highlight } else { Vec3::ZERO }
}
