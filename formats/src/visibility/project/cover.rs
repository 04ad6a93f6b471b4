//! Which points a projected triangle covers, as many at a time as the machine has lanes.
//!
//! No fused multiply-add, so that every machine decides alike and both triangles at an edge see the same number.

use super::buckets::Buckets;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Arrays are padded by so many values that full vectors can be read from any place.
pub(super) const PADDING: usize = 7;

/// A projected triangle: edge functions in the order of the vertex indices, and its plane.
struct Projected {
    /// Start point of each edge in canonical order, and its direction, turned round where the triangle runs against it:
    /// every product and difference changes its sign with that and nothing else.
    start: [[f64; 2]; 3],
    along: [[f64; 2]; 3],
    /// Least value of the edge function that counts as left of the edge. Of the two triangles at an edge one has
    /// 0, the other the least positive number: exactly one of them owns the edge.
    least: [f64; 3],
    z: [f64; 3],
}

/// What a triangle is to some points.
pub(super) struct Cover<S: Simd> {
    /// 1 or -1 where it covers them, facing along the direction or against it, else 0.
    pub sign: S::f64s,
    /// Height of its plane there; any value, NaN too, where the sign is 0.
    pub z: S::f64s,
}

impl Projected {
    #[inline(always)]
    fn new(p: &[[f64; 3]; 3], indices: [u32; 3]) -> Self {
        let mut out = Self { start: [[0.0; 2]; 3], along: [[0.0; 2]; 3], least: [0.0; 3], z: [0.0; 3] };
        for k in 0..3 {
            let (i, j) = (k, (k + 1) % 3);
            let along = indices[i] < indices[j];
            let (a, b) = if along { (p[i], p[j]) } else { (p[j], p[i]) };
            let turn = if along { 1.0 } else { -1.0 };
            out.start[k] = [a[0], a[1]];
            out.along[k] = [turn * (b[0] - a[0]), turn * (b[1] - a[1])];
            out.least[k] = if along { 0.0 } else { f64::from_bits(1) };
            out.z[k] = p[k][2];
        }
        out
    }

    /// `None` if it covers none of them.
    #[inline(always)]
    fn cover<S: Simd>(&self, simd: S, u: S::f64s, v: S::f64s) -> Option<Cover<S>> {
        let all = |x: f64| simd.splat_f64s(x);
        let edge = |k: usize| {
            let ([a, b], [x, y]) = (self.start[k], self.along[k]);
            let (du, dv) = (simd.sub_f64s(u, all(a)), simd.sub_f64s(v, all(b)));
            simd.sub_f64s(simd.mul_f64s(all(x), dv), simd.mul_f64s(all(y), du))
        };
        let e = [edge(0), edge(1), edge(2)];
        let is_left = |k: usize| simd.greater_than_or_equal_f64s(e[k], all(self.least[k]));
        let left = [is_left(0), is_left(1), is_left(2)];
        let every = simd.and_m64s(simd.and_m64s(left[0], left[1]), left[2]);
        let some = simd.or_m64s(simd.or_m64s(left[0], left[1]), left[2]);
        let sum = simd.add_f64s(simd.add_f64s(e[0], e[1]), e[2]);
        let zero = all(0.0);
        // Seen from the side it covers nothing.
        let flat = simd.equal_f64s(sum, zero);
        let covered = simd.and_m64s(simd.or_m64s(every, simd.not_m64s(some)), simd.not_m64s(flat));
        if simd.first_true_m64s(covered) == S::F64_LANES {
            return None;
        }
        let heights = simd.add_f64s(
            simd.add_f64s(simd.mul_f64s(e[1], all(self.z[0])), simd.mul_f64s(e[2], all(self.z[1]))),
            simd.mul_f64s(e[0], all(self.z[2])),
        );
        let facing = simd.select_f64s(every, all(1.0), all(-1.0));
        Some(Cover { sign: simd.select_f64s(covered, facing, zero), z: simd.div_f64s(heights, sum) })
    }
}

/// What becomes of crossings.
pub(super) trait Visit {
    /// Triangle `triangle` meets the sorted points of `range`, of which `cover` tells as many as there are lanes.
    fn add<S: Simd>(&mut self, simd: S, triangle: usize, range: Range<usize>, cover: Cover<S>);
}

/// All triangles against all points.
pub(super) struct Crossings<'a, V> {
    /// The mesh's vertices: across the direction twice, along it.
    pub corners: &'a [[f64; 3]],
    pub triangles: &'a [[u32; 3]],
    pub buckets: &'a Buckets,
    pub visit: &'a mut V,
}

impl<V: Visit> WithSimd for Crossings<'_, V> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (index, indices) in self.triangles.iter().enumerate() {
            let p = indices.map(|i| self.corners[i as usize]);
            let low = [0, 1].map(|k| p[0][k].min(p[1][k]).min(p[2][k]));
            let high = [0, 1].map(|k| p[0][k].max(p[1][k]).max(p[2][k]));
            let Some(rows) = self.buckets.rows(low, high) else { continue };
            let triangle = Projected::new(&p, *indices);
            for range in rows {
                let mut from = range.start;
                while from < range.end {
                    let (u, v) = (load(simd, &self.buckets.u, from), load(simd, &self.buckets.v, from));
                    if let Some(cover) = triangle.cover(simd, u, v) {
                        self.visit.add(simd, index, from..range.end, cover);
                    }
                    from += S::F64_LANES;
                }
            }
        }
    }
}

/// The values from place `from` on.
#[inline(always)]
pub(super) fn load<S: Simd>(_: S, values: &[f64], from: usize) -> S::f64s {
    S::as_simd_f64s(&values[from..from + S::F64_LANES]).0[0]
}

/// Adds to the values from place `from` on.
#[inline(always)]
pub(super) fn add_to<S: Simd>(simd: S, values: &mut [f64], from: usize, more: S::f64s) {
    let there = &mut S::as_mut_simd_f64s(&mut values[from..from + S::F64_LANES]).0[0];
    *there = simd.add_f64s(*there, more);
}

/// Lane numbers.
#[inline(always)]
pub(super) fn lanes<S: Simd>(simd: S) -> S::f64s {
    load(simd, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], 0)
}
