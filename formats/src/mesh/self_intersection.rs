//! Counts pairs of triangles that cross, by a box hierarchy and edge-against-triangle tests.

use super::Mesh;
use crate::visibility::Accel;
use glam::DVec3;
use rayon::prelude::*;

/// Triangles that each is tested with, at the most: where everything crosses everything, the exact count is not worth its
/// time.
const MOST_LOOKED: usize = 1000;

/// Pairs of triangles without a common vertex, one of which an edge of the other passes through;
/// a lower bound where a triangle has very many neighbours.
pub(super) fn count(mesh: &Mesh) -> usize {
    let accel = Accel::new(mesh);
    (0..mesh.triangles.len())
        .into_par_iter()
        .map(|i| {
            let own = mesh.triangles[i];
            let corners = mesh.corners(i);
            let low = corners[0].min(corners[1]).min(corners[2]);
            let high = corners[0].max(corners[1]).max(corners[2]);
            let (mut crossings, mut looked) = (0, 0);
            accel.for_each_in_box(low, high, |j| {
                if j > i
                    && !mesh.triangles[j].iter().any(|v| own.contains(v))
                    && (pierces(corners, mesh.corners(j)) || pierces(mesh.corners(j), corners))
                {
                    crossings += 1;
                }
                looked += 1;
                looked < MOST_LOOKED
            });
            crossings
        })
        .sum()
}

/// Whether an edge of `a` passes through the interior of `b`.
fn pierces(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let normal = (b[1] - b[0]).cross(b[2] - b[0]);
    (0..3).any(|k| {
        let (p, q) = (a[k], a[(k + 1) % 3]);
        let (dp, dq) = ((p - b[0]).dot(normal), (q - b[0]).dot(normal));
        if dp * dq >= 0.0 {
            return false;
        }
        let x = p + (q - p) * (dp / (dp - dq));
        (0..3).all(|e| (b[(e + 1) % 3] - b[e]).cross(x - b[e]).dot(normal) > 0.0)
    })
}
