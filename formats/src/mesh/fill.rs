//! Faces that fill a loop without new vertices.
//!
//! ```text
//! W(i,k) = min over i < m < k of  W(i,m) + W(m,k) + (angle, area)(i,m,k)        + : larger angle, sum of areas
//! ```
//!
//! with the angle that a face (i,m,k) makes with those beside it, those of the mesh along the loop included, compared first,
//! and then the area. Dynamic programming in n³/6 steps: Barequet and Sharir 1995 ("Filling gaps in the boundary of a
//! polyhedron", Computer Aided Geometric Design 12(2), p. 207), with the weights of Liepa 2003 ("Filling holes in meshes",
//! Symposium on Geometry Processing, p. 200, section 3). Deviations: an edge that the mesh has already, a face without area
//! and one between a vertex and itself cost more than any angle; angles count in steps; to the area comes a little of the
//! longest edge squared, which chooses among the triangulations of a flat loop.

use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Steps of 1 - cos of an angle: 0.1 degrees near 0.
const STEPS: f64 = 1e6;

/// What costs more than any angle, in the same unit.
const FOLDED: u32 = 3_000_000;
const TAKEN: u32 = 4_000_000;

/// Part of the squared longest edge that is added to a face's area.
const LONG: f64 = 1e-3;

/// A face whose area is below this part of its squared longest edge has no normal.
const THIN: f64 = 1e-14;

/// What a shell has around its holes.
pub(super) struct Rim {
    /// Unit normals of the faces along directed edges.
    pub normals: HashMap<(u32, u32), DVec3>,
    /// Edges between vertices of loops, lower first.
    pub edges: HashSet<(u32, u32)>,
}

#[derive(Clone, Copy)]
struct Best {
    angle: u32,
    area: f64,
    /// The third corner of the face on this chord.
    third: usize,
    /// That face's normal, 0 where it has none.
    normal: DVec3,
}

/// Faces that fill `ring`, of 3 vertices or more. The ring may come through a vertex several times.
pub(super) fn fill(positions: &[DVec3], ring: &[u32], rim: &Rim) -> Vec<[u32; 3]> {
    let n = ring.len();
    let at = |i: usize| positions[ring[i] as usize];
    let beside = |i: usize, k: usize| rim.normals.get(&(ring[k], ring[i])).copied().unwrap_or_default();
    let edge = |i: usize| Best { angle: 0, area: 0.0, third: i, normal: beside(i, i + 1) };
    // Chord (i,k), i < k, at i n + k.
    let mut best = vec![Best { angle: 0, area: 0.0, third: 0, normal: DVec3::ZERO }; n * n];
    (0..n - 1).for_each(|i| best[i * n + i + 1] = edge(i));
    for (i, k) in (2..n).flat_map(|length| (0..n - length).map(move |i| (i, i + length))) {
        let whole = (i, k) == (0, n - 1);
        let chord = (ring[i].min(ring[k]), ring[i].max(ring[k]));
        let taken = if !whole && rim.edges.contains(&chord) { TAKEN } else { 0 };
        let last = beside(n - 1, 0);
        let choices = (i + 1..k).map(|m| {
            let (left, right) = (&best[i * n + m], &best[m * n + k]);
            let (normal, area) = shape([at(i), at(m), at(k)]);
            let mut angle = taken.max(left.angle).max(right.angle);
            angle = angle.max(bend(normal, left.normal)).max(bend(normal, right.normal));
            if whole {
                angle = angle.max(bend(normal, last));
            }
            Best { angle, area: left.area + right.area + area, third: m, normal }
        });
        let least = choices.min_by(|a, b| a.angle.cmp(&b.angle).then(a.area.total_cmp(&b.area)));
        if let Some(least) = least {
            best[i * n + k] = least;
        }
    }
    let mut faces = Vec::with_capacity(n - 2);
    let mut chords = vec![(0, n - 1)];
    while let Some((i, k)) = chords.pop() {
        if k > i + 1 {
            let m = best[i * n + k].third;
            let face = [ring[i], ring[m], ring[k]];
            // Between a vertex and itself there is nothing, and its two other edges are each other's opposites.
            if face[0] != face[1] && face[1] != face[2] && face[2] != face[0] {
                faces.push(face);
            }
            chords.extend([(m, k), (i, m)]);
        }
    }
    faces
}

/// Unit normal and weighed area of a face.
fn shape([a, b, c]: [DVec3; 3]) -> (DVec3, f64) {
    let normal = (b - a).cross(c - a);
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    let twice = normal.length();
    let unit = if twice > THIN * longest { normal / twice } else { DVec3::ZERO };
    (unit, 0.5 * twice + LONG * longest)
}

/// How much two faces side by side bend: 1 - cos of the angle between their normals, in steps.
fn bend(a: DVec3, b: DVec3) -> u32 {
    if a == DVec3::ZERO || b == DVec3::ZERO {
        return FOLDED;
    }
    ((1.0 - a.dot(b)) * STEPS).round() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directions::hash;

    fn bare() -> Rim {
        Rim { normals: HashMap::new(), edges: HashSet::new() }
    }

    fn weighed(positions: &[DVec3], faces: &[[u32; 3]]) -> f64 {
        faces.iter().map(|t| shape(t.map(|v| positions[v as usize])).1).sum()
    }

    /// The least weighed area of all ways to fill the vertices from i to k.
    fn least(positions: &[DVec3], i: u32, k: u32) -> f64 {
        let ways = (i + 1..k)
            .map(|m| weighed(positions, &[[i, m, k]]) + least(positions, i, m) + least(positions, m, k));
        ways.min_by(f64::total_cmp).unwrap_or(0.0)
    }

    #[test]
    fn no_way_to_fill_a_loop_has_less_area() {
        for n in 3..9 {
            for seed in 0..20 {
                let part =
                    |i: u32, c: u64| (hash(seed, u64::from(3 * i) + c) >> 11) as f64 / (1_u64 << 53) as f64;
                let positions: Vec<DVec3> =
                    (0..n).map(|i| DVec3::from_array([0, 1, 2].map(|c| part(i, c)))).collect();
                // Without faces around it every way folds at the loop, so that area alone decides.
                let faces = fill(&positions, &(0..n).collect::<Vec<_>>(), &bare());
                assert_eq!(faces.len() as u32, n - 2);
                let (found, least) = (weighed(&positions, &faces), least(&positions, 0, n - 1));
                assert!((found - least).abs() < 1e-12, "{n}, {seed}: {found}, least {least}");
            }
        }
    }

    #[test]
    fn flat_loops_are_filled_flat() {
        // An L of three unit squares, with vertices half way.
        let outline = [(0, 0), (2, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4), (0, 2)];
        let positions = outline.map(|(x, y)| DVec3::new(f64::from(x), f64::from(y), 0.0) / 2.0);
        let faces = fill(&positions, &[0, 1, 2, 3, 4, 5, 6, 7], &bare());
        assert_eq!(faces.len(), 6);
        let twice = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            (b - a).cross(c - a).z
        };
        assert!(faces.iter().all(|t| twice(t) > 0.1));
        assert!((faces.iter().map(twice).sum::<f64>() - 6.0).abs() < 1e-12);
    }

    /// A square hole across an edge of a box: two corners on the edge, one on each side.
    fn across() -> ([DVec3; 4], Rim) {
        let mut rim = bare();
        let sides = [((3, 0), DVec3::Y), ((2, 3), DVec3::Y), ((1, 2), DVec3::X), ((0, 1), DVec3::X)];
        for (edge, normal) in sides {
            rim.normals.insert(edge, normal);
        }
        ([-0.5 * DVec3::Z, -DVec3::Y, 0.5 * DVec3::Z, -DVec3::X], rim)
    }

    #[test]
    fn an_edge_of_a_box_is_kept() {
        let (positions, rim) = across();
        let faces = fill(&positions, &[0, 3, 2, 1], &rim);
        assert!(faces.iter().all(|t| t.contains(&0) && t.contains(&2)), "{faces:?}");
    }

    #[test]
    fn edges_that_exist_are_not_used_again() {
        let (positions, mut rim) = across();
        rim.edges.insert((0, 2));
        let faces = fill(&positions, &[0, 3, 2, 1], &rim);
        assert!(faces.iter().all(|t| t.contains(&1) && t.contains(&3)), "{faces:?}");
    }

    #[test]
    fn nothing_lies_between_a_vertex_and_itself() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        for ring in [&[0, 1, 0, 2][..], &[0, 1, 2, 0, 3], &[0, 1, 2, 0, 2, 1], &[0, 1, 2, 0, 1, 3]] {
            let faces = fill(&positions, ring, &bare());
            assert!(faces.iter().all(|[a, b, c]| a != b && b != c && c != a), "{faces:?}");
            // With the ring the other way round they have no boundary.
            let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
            let around = (0..ring.len()).map(|i| (ring[(i + 1) % ring.len()], ring[i]));
            for (a, b) in faces.iter().flat_map(|t| super::super::pieces::edges(*t)).chain(around) {
                *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
            assert!(balance.values().all(|n| *n == 0), "{ring:?}: {faces:?}");
        }
    }
}
