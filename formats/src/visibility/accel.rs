//! A box hierarchy (obvhs) over the triangles with exact tests in f64.
//!
//! The boxes work in f32 on coordinates scaled to the unit box and are padded by more than their rounding error, so
//! they only ever offer too many candidates; every decision is made in f64. Edge tests are evaluated once per edge
//! in a fixed vertex order with a fixed rule for ties, so that neighbouring triangles always agree and a ray through
//! an edge crosses exactly one of them.

use crate::mesh::Mesh;
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::Ray;
use obvhs::{BvhBuildParams, bvh2::node::Bvh2Node};

/// Where a line leaves (`exit`) or enters the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Ray parameter, in units of the direction's length.
    pub t: f64,
    /// +1 when the ray leaves through an outward face, -1 when it enters.
    pub sign: i32,
    /// The triangle.
    pub triangle: u32,
}

/// The surface point closest to a query.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Distance, mesh units.
    pub distance: f64,
    /// The closest point.
    pub point: DVec3,
    /// The triangle that it lies on.
    pub triangle: u32,
}

/// The hierarchy and a copy of the triangles, in local coordinates.
pub struct Accel {
    bvh: Bvh2,
    corners: Vec<[DVec3; 3]>,
    indices: Vec<[u32; 3]>,
    centre: DVec3,
    scale: f64,
}

/// Padding of boxes in local units (the object spans about 1).
const PADDING: f64 = 2e-6;

impl Accel {
    /// Builds the hierarchy. Time O(n log n), memory about 150 bytes a triangle.
    pub fn new(mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds();
        let centre = 0.5 * (low + high);
        let scale = 1.0 / (high - low).max_element().max(f64::MIN_POSITIVE);
        let corners: Vec<[DVec3; 3]> =
            (0..mesh.triangles.len()).map(|i| mesh.corners(i).map(|p| (p - centre) * scale)).collect();
        let boxes: Vec<Aabb> = corners
            .iter()
            .map(|c| {
                let low = c[0].min(c[1]).min(c[2]) - PADDING;
                let high = c[0].max(c[1]).max(c[2]) + PADDING;
                Aabb::new(low.as_vec3a(), high.as_vec3a())
            })
            .collect();
        // The slower presets split triangles and would report hits twice.
        let bvh = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Default::default());
        Self { bvh, corners, indices: mesh.triangles.clone(), centre, scale }
    }

    fn local(&self, p: DVec3) -> DVec3 {
        (p - self.centre) * self.scale
    }

    /// All crossings of the ray `origin` + t · `direction` with t in `t_min..t_max`, unsorted, into `out` (cleared).
    /// The direction need not be a unit vector.
    pub fn crossings(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_min: f64,
        t_max: f64,
        out: &mut Vec<Crossing>,
    ) {
        out.clear();
        if self.corners.is_empty() {
            return;
        }
        let mut start = self.local(origin);
        // A far origin would cost the f32 boxes their precision: move it next to the object first.
        let length = direction.length() * self.scale;
        let unit = direction.normalize_or_zero();
        if unit == DVec3::ZERO {
            return;
        }
        let shift = if start.length() > 4.0 { (-start.dot(unit) - 2.0).max(0.0) } else { 0.0 };
        start += unit * shift;
        let shear = Shear::new(unit);
        let ray = Ray::new(start.as_vec3a(), unit.as_vec3a() + Vec3A::ZERO, 0.0, f32::INFINITY);
        let indices = &self.bvh.primitive_indices;
        self.bvh.ray_traverse_anyhit(ray, |_, slot| {
            let i = indices[slot] as usize;
            if let Some((t, sign)) = shear.intersect(start, self.corners[i], self.indices[i]) {
                let t = (t + shift) / length;
                if t >= t_min && t < t_max {
                    out.push(Crossing { t, sign, triangle: i as u32 });
                }
            }
        });
    }

    /// The closest surface point within `limit` (mesh units) of `point`.
    pub fn nearest(&self, point: DVec3, limit: f64) -> Option<Nearest> {
        let p = self.local(point);
        let p32 = p.as_vec3a();
        let mut best = limit * self.scale;
        let mut best2 = best * best;
        let mut found = None;
        let mut stack: Vec<(f32, u32)> = Vec::with_capacity(64);
        if !self.bvh.nodes.is_empty() {
            stack.push((box_distance2(&self.bvh.nodes[0], p32), 0));
        }
        while let Some((bound, index)) = stack.pop() {
            if f64::from(bound) * (1.0 - 1e-5) > best2 {
                continue;
            }
            let node = &self.bvh.nodes[index as usize];
            if node.is_leaf() {
                for slot in node.first_index..node.first_index + node.prim_count {
                    let i = self.bvh.primitive_indices[slot as usize];
                    let q = closest_on_triangle(p, self.corners[i as usize]);
                    let d2 = (p - q).length_squared();
                    if d2 < best2 {
                        best2 = d2;
                        best = d2.sqrt();
                        found = Some((q, i));
                    }
                }
            } else {
                let [l, r] = [node.first_index, node.first_index + 1];
                let dl = box_distance2(&self.bvh.nodes[l as usize], p32);
                let dr = box_distance2(&self.bvh.nodes[r as usize], p32);
                let (near, far) = if dl < dr { ((dl, l), (dr, r)) } else { ((dr, r), (dl, l)) };
                stack.push(far);
                stack.push(near);
            }
        }
        found.map(|(q, triangle)| Nearest {
            distance: best / self.scale,
            point: q / self.scale + self.centre,
            triangle,
        })
    }

    /// Calls `visit` with every triangle whose padded box meets the given box, until it says that this is enough.
    pub fn for_each_in_box(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(usize) -> bool) {
        let query = Aabb::new(self.local(low).as_vec3a(), self.local(high).as_vec3a());
        self.bvh.aabb_traverse(query, |bvh, index| {
            let node = &bvh.nodes[index as usize];
            for slot in node.first_index..node.first_index + node.prim_count {
                if !visit(bvh.primitive_indices[slot as usize] as usize) {
                    return false;
                }
            }
            true
        });
    }

    /// Outward unit normal of a triangle.
    pub fn normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners[triangle as usize];
        (b - a).cross(c - a).normalize_or_zero()
    }
}

fn box_distance2(node: &Bvh2Node, p: Vec3A) -> f32 {
    let b = node.aabb();
    (b.min - p).max(p - b.max).max(Vec3A::ZERO).length_squared()
}

/// Ericson, Real-Time Collision Detection, section 5.1.5.
fn closest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let denominator = 1.0 / (va + vb + vc);
    a + ab * (vb * denominator) + ac * (vc * denominator)
}

/// A ray's own frame in which it runs along z (Woop, Benthin and Wald 2013, with a rotation instead of a shear).
struct Shear {
    u: DVec3,
    v: DVec3,
    w: DVec3,
}

impl Shear {
    fn new(w: DVec3) -> Self {
        let (u, v) = w.any_orthonormal_pair();
        Self { u, v, w }
    }

    /// Distance along the ray and +1 (exit) or -1 (entry).
    fn intersect(&self, origin: DVec3, corners: [DVec3; 3], indices: [u32; 3]) -> Option<(f64, i32)> {
        let p = corners.map(|c| {
            let d = c - origin;
            (d.dot(self.u), d.dot(self.v), d.dot(self.w))
        });
        let mut e = [0.0; 3];
        let mut left = [false; 3];
        for k in 0..3 {
            let (i, j) = (k, (k + 1) % 3);
            // Edge function at the ray (the origin of this frame), in the order of the vertex indices.
            if indices[i] < indices[j] {
                let value = p[i].0 * p[j].1 - p[i].1 * p[j].0;
                (e[k], left[k]) = (value, value >= 0.0);
            } else {
                let value = p[j].0 * p[i].1 - p[j].1 * p[i].0;
                (e[k], left[k]) = (-value, value < 0.0);
            }
        }
        let sign = match left {
            [true, true, true] => 1,
            [false, false, false] => -1,
            _ => return None,
        };
        let sum = e[0] + e[1] + e[2];
        if sum == 0.0 {
            return None;
        }
        // Edge k is opposite vertex k+2.
        let t = (e[1] * p[0].2 + e[2] * p[1].2 + e[0] * p[2].2) / sum;
        Some((t, sign))
    }
}
