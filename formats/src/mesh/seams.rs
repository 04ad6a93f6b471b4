//! Seams that were torn by a hair: edges that belong together but differ by rounding, or by vertices that only one side
//! has.

use super::MeshReport;
use super::pieces::edges;
use super::weld::clean;
use glam::{DVec3, I64Vec3};
use std::cell::Cell;
use std::collections::HashMap;

/// Vertices on open edges nearer to each other than this, in diagonals, are taken for one, and one as near to an open edge
/// for a part of it: a hundred times the rounding of coordinates of 32 bits.
const HAIR: f64 = 1e-5;

/// Rounds of splitting: each splits at most one edge of a triangle.
const ROUNDS: usize = 4;

/// Triangles that splitting may leave for each one before it, and vertices that are looked at for each open edge: a seam needs
/// a few, while thousands of edges on one line would be split at each other without end. Edges beyond that stay open.
const MOST_TRIANGLES: usize = 8;
const MOST_TESTS: usize = 1000;

/// Mends seams of triangles whose edges without a partner are `lone`; `None` if there is nothing to mend.
pub(super) fn mend(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    lone: &[(u32, u32)],
    report: &mut MeshReport,
) -> Option<Vec<[u32; 3]>> {
    let used = || triangles.iter().flatten().map(|v| positions[*v as usize]);
    let low = used().fold(DVec3::INFINITY, DVec3::min);
    let high = used().fold(DVec3::NEG_INFINITY, DVec3::max);
    let reach = HAIR * low.distance(high);
    if lone.is_empty() || !(reach > 0.0 && reach.is_finite()) {
        return None;
    }
    let merged = merge(positions, &vertices(lone), low, reach);
    let one = |v: u32| merged.get(&v).copied().unwrap_or(v);
    let mut mended = triangles.to_vec();
    if !merged.is_empty() {
        report.mending.stitched = merged.len();
        mended = clean(positions, mended.into_iter().map(|t| t.map(one)).collect(), report);
    }
    let most = MOST_TRIANGLES.saturating_mul(mended.len());
    for _ in 0..ROUNDS {
        let lone = lone_edges(&mended);
        let splits = split(positions, &mut mended, &lone, (low, reach), most);
        if splits == 0 {
            break;
        }
        report.mending.split += splits;
    }
    (!merged.is_empty() || report.mending.split > 0).then_some(mended)
}

/// Edges of a single triangle, lower vertex first, in order.
fn lone_edges(triangles: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let mut all: Vec<(u32, u32)> =
        triangles.iter().flat_map(|t| edges(*t)).map(|(a, b)| (a.min(b), a.max(b))).collect();
    all.sort_unstable();
    all.chunk_by(|x, y| x == y).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

fn vertices(lone: &[(u32, u32)]) -> Vec<u32> {
    let mut all: Vec<u32> = lone.iter().flat_map(|edge| [edge.0, edge.1]).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// For each vertex within `reach` of one before it: that.
fn merge(positions: &[DVec3], open: &[u32], low: DVec3, reach: f64) -> HashMap<u32, u32> {
    let mut places: HashMap<I64Vec3, Vec<u32>> = HashMap::new();
    let mut merged = HashMap::new();
    for &v in open {
        let p = positions[v as usize];
        let cell = ((p - low) / reach).floor().as_i64vec3();
        let around = (0..27).map(|k| cell + I64Vec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
        let near = around
            .filter_map(|c| places.get(&c))
            .flatten()
            .map(|&w| (positions[w as usize].distance(p), w))
            .filter(|(distance, _)| *distance <= reach)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match near {
            Some((_, w)) => _ = merged.insert(v, w),
            None => places.entry(cell).or_default().push(v),
        }
    }
    merged
}

/// Splits triangles at vertices of other open edges that lie on their own, until there are `most`; says how many edges were
/// split.
fn split(
    positions: &[DVec3],
    triangles: &mut Vec<[u32; 3]>,
    lone: &[(u32, u32)],
    (low, reach): (DVec3, f64),
    most: usize,
) -> usize {
    let at = |v: u32| positions[v as usize];
    let open = vertices(lone);
    // Cells as large as the edges are long on average.
    let length = lone.iter().map(|&(a, b)| at(a).distance(at(b))).sum::<f64>() / lone.len().max(1) as f64;
    let cell = |p: DVec3| ((p - low) / length.max(reach)).floor().as_i64vec3();
    let mut places: HashMap<I64Vec3, Vec<u32>> = HashMap::new();
    open.iter().for_each(|&v| places.entry(cell(at(v))).or_default().push(v));
    let left = Cell::new(MOST_TESTS.saturating_mul(lone.len()));
    // Vertices on the open edge from a to b, in their order along it.
    let between = |a: u32, b: u32| {
        let (p, along) = (at(a), at(b) - at(a));
        let on = |v: u32| {
            left.set(left.get().saturating_sub(1));
            let t = (at(v) - p).dot(along) / along.length_squared();
            let beside = (p + along * t).distance(at(v));
            (v != a && v != b && t > 0.0 && t < 1.0 && beside <= reach).then_some((t, v))
        };
        let (first, last) = (cell(at(a).min(at(b)) - reach), cell(at(a).max(at(b)) + reach));
        let size = last - first + 1;
        let cells = size.x.saturating_mul(size.y).saturating_mul(size.z);
        let mut found: Vec<(f64, u32)> = if cells > places.len() as i64 {
            open.iter().filter_map(|v| on(*v)).collect()
        } else {
            (0..cells)
                .map(|k| first + I64Vec3::new(k % size.x, k / size.x % size.y, k / (size.x * size.y)))
                .filter_map(|c| places.get(&c))
                .flatten()
                .filter_map(|v| on(*v))
                .collect()
        };
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().map(|(_, v)| v).collect::<Vec<_>>()
    };
    let mut splits = 0;
    for i in 0..triangles.len() {
        let t = triangles[i];
        for k in 0..3 {
            let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            if lone.binary_search(&(a.min(b), a.max(b))).is_err() {
                continue;
            }
            if left.get() == 0 || triangles.len() > most {
                return splits;
            }
            let mut line = between(a, b);
            line.retain(|v| *v != c);
            if line.is_empty() {
                continue;
            }
            splits += 1;
            line.push(b);
            triangles[i] = [a, line[0], c];
            triangles.extend(line.windows(2).map(|pair| [pair[0], pair[1], c]));
            break;
        }
    }
    splits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;

    /// A unit square in the plane through `corner` in `n` × `n` squares, with vertices of its own.
    fn square(
        corner: DVec3,
        u: DVec3,
        v: DVec3,
        n: u32,
        positions: &mut Vec<DVec3>,
        out: &mut Vec<[u32; 3]>,
    ) {
        let base = positions.len() as u32;
        for k in 0..(n + 1) * (n + 1) {
            let part = |i: u32| f64::from(i) / f64::from(n);
            positions.push(corner + u * part(k % (n + 1)) + v * part(k / (n + 1)));
        }
        for k in 0..n * n {
            let a = base + k / n * (n + 1) + k % n;
            out.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
        }
    }

    #[test]
    fn faces_of_a_cube_that_share_corners_only() {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let sides =
            [(DVec3::X, DVec3::Y, DVec3::Z), (DVec3::Y, DVec3::Z, DVec3::X), (DVec3::Z, DVec3::X, DVec3::Y)];
        for (k, (w, u, v)) in sides.into_iter().enumerate() {
            square(w, u, v, 2 + k as u32, &mut positions, &mut triangles);
            square(DVec3::ZERO, v, u, 5 - k as u32, &mut positions, &mut triangles);
        }
        let (mesh, report) = Mesh::from_triangles(positions, triangles).unwrap();
        assert!(report.mending.split > 0);
        assert_eq!((report.components, report.open_edges, report.holes), (1, 0, 0));
        assert!((mesh.volume() - 1.0).abs() < 1e-12 && (mesh.area() - 6.0).abs() < 1e-12);
    }
}
