//! Loops of the edges that a shell lacks.
//!
//! At a vertex where several gaps meet, an edge that comes in goes on with the one across its own gap: both bound the gap
//! between two neighbouring fans of faces around the vertex. So gaps that touch at a vertex become loops of their own, and
//! an island of faces that hangs on others by a vertex is bridged, not closed by itself.

use super::pieces::corner;
use glam::DVec3;
use std::collections::HashMap;

/// Closed loops of vertices along the directed edges `missing` from `faces`, which are sorted and come into each vertex as
/// often as they leave it.
pub(super) fn trace(positions: &[DVec3], faces: &[[u32; 3]], missing: &[(u32, u32)]) -> Vec<Vec<u32>> {
    let next = successors(positions, faces, missing);
    let mut seen = vec![false; missing.len()];
    let mut loops = Vec::new();
    for first in 0..missing.len() {
        let (mut at, mut ring) = (first, Vec::new());
        while !std::mem::replace(&mut seen[at], true) {
            ring.push(missing[at].0);
            at = next[at];
        }
        if !ring.is_empty() {
            loops.push(ring);
        }
    }
    loops
}

/// For each edge the one that goes on where it ends.
fn successors(positions: &[DVec3], faces: &[[u32; 3]], missing: &[(u32, u32)]) -> Vec<usize> {
    let mut coming: Vec<usize> = (0..missing.len()).collect();
    coming.sort_by_key(|e| (missing[*e].1, missing[*e].0));
    // Edges that leave a vertex lie together, in the order of the vertices, and so do those that come in.
    let mut end = 0;
    let leaving = missing.chunk_by(|x, y| x.0 == y.0).map(|group| {
        end += group.len();
        (end - group.len(), group.len())
    });
    let groups: Vec<(usize, usize)> = leaving.collect();
    let pinched = groups.iter().filter(|(_, n)| *n > 1).map(|(start, _)| missing[*start].0);
    let normals = normals(positions, faces, pinched.collect());
    let mut next = vec![0; missing.len()];
    for (start, n) in groups {
        let coming = &coming[start..start + n];
        let Some(normal) = normals.get(&missing[start].0) else {
            next[coming[0]] = start;
            continue;
        };
        let ends = Ends::new(positions[missing[start].0 as usize], *normal);
        let mut around: Vec<(f64, bool, usize)> = Vec::with_capacity(2 * n);
        around.extend((start..start + n).map(|e| (ends.angle(positions[missing[e].1 as usize]), false, e)));
        around.extend(coming.iter().map(|&e| (ends.angle(positions[missing[e].0 as usize]), true, e)));
        around.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        pair(&around, &mut next);
    }
    next
}

/// Pairs ends counter-clockwise around a vertex: an edge that leaves opens a gap, the next one that comes in closes it.
fn pair(around: &[(f64, bool, usize)], next: &mut [usize]) {
    let (mut open, mut late) = (Vec::new(), Vec::new());
    for &(_, comes, e) in around {
        if !comes {
            open.push(e);
        } else if let Some(out) = open.pop() {
            next[e] = out;
        } else {
            late.push(e);
        }
    }
    // Gaps across the start of the round.
    for e in late {
        next[e] = open.pop().unwrap_or(e);
    }
}

/// Sums of the faces' normals at some vertices, weighted with the angles of their corners there.
fn normals(positions: &[DVec3], faces: &[[u32; 3]], vertices: Vec<u32>) -> HashMap<u32, DVec3> {
    let mut sums: HashMap<u32, DVec3> = vertices.into_iter().map(|v| (v, DVec3::ZERO)).collect();
    if !sums.is_empty() {
        for (t, k) in faces.iter().flat_map(|t| (0..3).map(move |k| (t, k))) {
            if let Some(sum) = sums.get_mut(&t[k]) {
                *sum += corner(positions, *t, k);
            }
        }
    }
    sums
}

/// The tangent plane of a vertex.
struct Ends {
    at: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Ends {
    fn new(at: DVec3, normal: DVec3) -> Self {
        let normal = normal.try_normalize().unwrap_or(DVec3::Z);
        let x = normal.any_orthonormal_vector();
        Self { at, x, y: normal.cross(x) }
    }

    fn angle(&self, p: DVec3) -> f64 {
        let along = p - self.at;
        along.dot(self.y).atan2(along.dot(self.x))
    }
}

#[cfg(test)]
mod tests {
    use super::super::close::missing;
    use super::*;

    /// The loops around what is left of an octahedron, each from its lowest vertex on.
    fn around(gone: impl Fn(usize) -> bool) -> Vec<Vec<u32>> {
        let (positions, all) = super::super::close::tests::octahedron();
        let faces: Vec<[u32; 3]> = (0..8).filter(|i| !gone(*i)).map(|i| all[i]).collect();
        let mut loops = trace(&positions, &faces, &missing(&faces));
        for ring in &mut loops {
            let lowest = (0..ring.len()).min_by_key(|i| ring[*i]).unwrap();
            ring.rotate_left(lowest);
        }
        loops
    }

    #[test]
    fn gaps_that_touch_at_vertices_are_loops_of_their_own() {
        let (_, all) = super::super::close::tests::octahedron();
        // Every other face: each vertex is met by two gaps, each face that is left is an island.
        let every_other = |i: usize| (i.count_ones() % 2) == 1;
        let mut expected: Vec<Vec<u32>> =
            (0..8).filter(|i| every_other(*i)).map(|i| all[i].to_vec()).collect();
        for ring in &mut expected {
            let lowest = (0..3).min_by_key(|i| ring[*i]).unwrap();
            ring.rotate_left(lowest);
        }
        expected.sort();
        let mut found = around(every_other);
        found.sort();
        assert_eq!(found, expected);
    }

    #[test]
    fn gaps_side_by_side_are_one_loop() {
        assert_eq!(around(|i| i < 2).iter().map(Vec::len).collect::<Vec<_>>(), [4]);
        // All four faces of the upper half.
        assert_eq!(around(|i| i < 4).iter().map(Vec::len).collect::<Vec<_>>(), [4]);
        assert!(around(|_| false).is_empty());
    }
}
