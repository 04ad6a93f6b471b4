//! Depth of many points along one direction and its opposite at once, by projecting the mesh.
//!
//! Points and triangles are projected onto the plane across ω; points are bucketed in a grid; every triangle adds
//! its signed crossing to the points that it covers. For a homogeneous medium the signed sum of z_triangle - z_point
//! is the density length (exits positive, entries negative): exact, and nothing is sorted. Otherwise each crossing
//! adds the signed running integral of ρ. Edge functions are antisymmetric with a fixed rule for ties (no fused
//! multiply-add), so no winding is ever wrong because two neighbours disagree. Results do not depend on threads: each
//! direction is one task.

use crate::fresnel;
use crate::medium::{Medium, SampledDensity};
use crate::mesh::Mesh;
use glam::DVec3;

/// Depths of all points along one direction.
#[derive(Clone, Debug)]
pub struct DepthRows {
    /// m of each point along ω.
    pub forward: Vec<f32>,
    /// m of each point along -ω.
    pub backward: Vec<f32>,
    /// Fresnel transmittance products along ω and -ω; empty when the boundary is index matched.
    pub boundary: [Vec<f32>; 2],
    /// Winding number seen along ω and along -ω: 1 for points inside a clean mesh.
    pub winding: [Vec<i8>; 2],
}

impl DepthRows {
    /// m of each point along ω (side 0) or -ω (side 1).
    pub fn lengths(&self, side: usize) -> &[f32] {
        if side == 0 { &self.forward } else { &self.backward }
    }
}

/// Points projected along one direction, sorted by grid cell so that a row of cells is contiguous.
struct Buckets {
    order: Vec<u32>,
    u: Vec<f64>,
    v: Vec<f64>,
    z: Vec<f64>,
    start: Vec<u32>,
    low: [f64; 2],
    inverse_cell: f64,
    size: [usize; 2],
}

impl Buckets {
    fn new(points: &[DVec3], frame: &[DVec3; 3]) -> Self {
        let projected: Vec<[f64; 3]> = points.iter().map(|p| frame.map(|axis| p.dot(axis))).collect();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in &projected {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let extent = [(high[0] - low[0]).max(1e-300), (high[1] - low[1]).max(1e-300)];
        // About two points a cell, and never more cells along an axis than a square grid four times as fine.
        let target = (points.len() as f64 / 2.0).max(1.0);
        let cell = (extent[0] * extent[1] / target)
            .sqrt()
            .max(extent[0].max(extent[1]) / (2.0 * target.sqrt()).ceil());
        let inverse_cell = 1.0 / cell;
        let size = extent.map(|e| (e * inverse_cell) as usize + 1);
        let cell_of = |p: &[f64; 3]| {
            let x = (((p[0] - low[0]) * inverse_cell) as usize).min(size[0] - 1);
            let y = (((p[1] - low[1]) * inverse_cell) as usize).min(size[1] - 1);
            y * size[0] + x
        };
        let mut start = vec![0u32; size[0] * size[1] + 1];
        for p in &projected {
            start[cell_of(p) + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let n = points.len();
        let (mut order, mut u, mut v, mut z) = (vec![0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for (i, p) in projected.iter().enumerate() {
            let slot = &mut next[cell_of(p)];
            let k = *slot as usize;
            *slot += 1;
            (order[k], u[k], v[k], z[k]) = (i as u32, p[0], p[1], p[2]);
        }
        Self { order, u, v, z, start, low, inverse_cell, size }
    }

    /// Calls `visit` with index ranges of points that a box may cover.
    fn for_each_range(&self, low: [f64; 2], high: [f64; 2], mut visit: impl FnMut(std::ops::Range<usize>)) {
        let mut cells = [[0usize; 2]; 2];
        for k in 0..2 {
            let from = (low[k] - self.low[k]) * self.inverse_cell;
            let to = (high[k] - self.low[k]) * self.inverse_cell;
            if to < 0.0 || from >= self.size[k] as f64 {
                return;
            }
            cells[k] = [from.max(0.0) as usize, (to as usize).min(self.size[k] - 1)];
        }
        for y in cells[1][0]..=cells[1][1] {
            let row = y * self.size[0];
            let from = self.start[row + cells[0][0]] as usize;
            let to = self.start[row + cells[0][1] + 1] as usize;
            if from < to {
                visit(from..to);
            }
        }
    }
}

/// A projected triangle: edge functions in the order of the vertex indices, and its plane.
struct Projected {
    /// Start point and direction of each edge in canonical order, and whether the triangle runs along it.
    edges: [([f64; 2], [f64; 2], bool); 3],
    z: [f64; 3],
    low: [f64; 2],
    high: [f64; 2],
}

impl Projected {
    fn new(corners: &[[f64; 3]], indices: [u32; 3]) -> Self {
        let p = indices.map(|i| corners[i as usize]);
        let edges = [0, 1, 2].map(|k| {
            let (i, j) = (k, (k + 1) % 3);
            let along = indices[i] < indices[j];
            let (a, b) = if along { (p[i], p[j]) } else { (p[j], p[i]) };
            ([a[0], a[1]], [b[0] - a[0], b[1] - a[1]], along)
        });
        let low = [0, 1].map(|k| p[0][k].min(p[1][k]).min(p[2][k]));
        let high = [0, 1].map(|k| p[0][k].max(p[1][k]).max(p[2][k]));
        Self { edges, z: p.map(|c| c[2]), low, high }
    }

    /// Height of the plane over (u, v) and the crossing's sign, if the triangle covers that point.
    #[inline]
    fn cover(&self, u: f64, v: f64) -> Option<(f64, f64)> {
        let mut e = [0.0; 3];
        let mut left = 0;
        for (k, (a, d, along)) in self.edges.iter().enumerate() {
            let value = d[0] * (v - a[1]) - d[1] * (u - a[0]);
            left += u32::from((value >= 0.0) == *along);
            e[k] = if *along { value } else { -value };
        }
        let sign = match left {
            3 => 1.0,
            0 => -1.0,
            _ => return None,
        };
        let sum = e[0] + e[1] + e[2];
        if sum == 0.0 {
            return None;
        }
        Some(((e[1] * self.z[0] + e[2] * self.z[1] + e[0] * self.z[2]) / sum, sign))
    }
}

/// Depths of `points` through `mesh` along the unit vector `direction` and its opposite, with the medium's own
/// integrals along each ray.
pub fn project(mesh: &Mesh, medium: &Medium, points: &[DVec3], direction: DVec3) -> DepthRows {
    project_with(mesh, medium, None, points, direction)
}

/// As [`project`], with the density taken from a sampled field where one is given (for fields without closed form).
pub fn project_with(
    mesh: &Mesh,
    medium: &Medium,
    sampled: Option<&SampledDensity>,
    points: &[DVec3],
    direction: DVec3,
) -> DepthRows {
    let running = sampled.map(|s| s.running(direction));
    let at_point: Vec<f64> = running.iter().flat_map(|r| points.iter().map(|p| r.at(*p))).collect();
    let n = points.len();
    let (u_axis, v_axis) = direction.any_orthonormal_pair();
    let frame = [u_axis, v_axis, direction];
    let buckets = Buckets::new(points, &frame);
    let corners: Vec<[f64; 3]> = mesh.positions.iter().map(|p| frame.map(|axis| p.dot(axis))).collect();
    let matched = medium.ior() == 1.0;
    let homogeneous = medium.is_homogeneous();
    // Sums per sorted point, along ω and -ω.
    let mut depth = [vec![0.0f64; n], vec![0.0f64; n]];
    let mut winding = [vec![0i8; n], vec![0i8; n]];
    let mut boundary = if matched { [vec![], vec![]] } else { [vec![1.0f32; n], vec![1.0f32; n]] };
    for (index, indices) in mesh.triangles.iter().enumerate() {
        let triangle = Projected::new(&corners, *indices);
        let mut through = None;
        buckets.for_each_range(triangle.low, triangle.high, |range| {
            for k in range {
                let Some((z, sign)) = triangle.cover(buckets.u[k], buckets.v[k]) else { continue };
                let distance = z - buckets.z[k];
                // Seen along -ω both the distance and the sign of the crossing turn round.
                let side = usize::from(distance < 0.0);
                winding[side][k] += if side == 0 { sign as i8 } else { -sign as i8 };
                depth[side][k] += if homogeneous {
                    sign * distance
                } else if let Some(running) = &running {
                    let i = buckets.order[k] as usize;
                    sign * (running.at(points[i] + direction * distance) - at_point[i])
                } else {
                    let origin = points[buckets.order[k] as usize];
                    let (along, length) =
                        if side == 0 { (direction, distance) } else { (-direction, -distance) };
                    let signed = if side == 0 { sign } else { -sign };
                    signed * medium.density_length(origin, along, 0.0, length)
                };
                if !matched {
                    let t = *through.get_or_insert_with(|| {
                        let cosine = mesh.area_normal(index).normalize_or_zero().dot(direction);
                        fresnel::transmittance(cosine, medium.ior()) as f32
                    });
                    boundary[side][k] *= t;
                }
            }
        });
    }
    let scale = if homogeneous { medium.uniform_density() } else { 1.0 };
    let unsort = |values: &[f64]| {
        let mut out = vec![0.0f32; n];
        for (k, &i) in buckets.order.iter().enumerate() {
            out[i as usize] = (values[k] * scale).max(0.0) as f32;
        }
        out
    };
    fn unsort_copy<T: Copy + Default>(order: &[u32], values: &[T]) -> Vec<T> {
        let mut out = vec![T::default(); values.len()];
        for (&i, &value) in order.iter().zip(values) {
            out[i as usize] = value;
        }
        out
    }
    DepthRows {
        forward: unsort(&depth[0]),
        backward: unsort(&depth[1]),
        boundary: boundary.map(|b| unsort_copy(&buckets.order, &b)),
        winding: winding.map(|w| unsort_copy(&buckets.order, &w)),
    }
}
