//! Closing holes.
//!
//! The directed edges of a shell that lack their opposite always form closed loops, because the boundary of a set of
//! triangles has no boundary itself. Each loop is filled between its own vertices; one that is too long gets a fan.

use super::fill::{Rim, fill};
use super::pieces::edges;
use super::{MeshReport, loops};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// Vertices of a loop that is filled without a fan, at the most, and the sum of their cubes over all loops of a shell, the
/// shortest first: a few seconds.
const LONGEST: usize = 256;
const MOST: usize = 300_000_000;

/// Closes every loop of unmatched directed edges of a shell.
pub(super) fn close(positions: &mut Vec<DVec3>, shell: &mut Vec<[u32; 3]>, report: &mut MeshReport) {
    let missing = missing(shell);
    report.open_edges += missing.len();
    let traced = loops::trace(positions, shell, &missing);
    let (mut short, long): (Vec<_>, Vec<_>) = traced.into_iter().partition(|ring| ring.len() <= LONGEST);
    let (simple, mut long): (Vec<_>, Vec<_>) =
        long.iter().flat_map(|ring| simple(ring)).partition(|ring| ring.len() <= LONGEST);
    short.extend(simple);
    short.sort_by_key(Vec::len);
    let mut left = MOST;
    let affordable = short.iter().take_while(|ring| {
        let work = ring.len().pow(3);
        left.checked_sub(work).inspect(|rest| left = *rest).is_some()
    });
    let affordable = affordable.count();
    long.extend(short.split_off(affordable));
    report.holes += short.len() + long.len();
    let rim = rim(positions, shell, &missing);
    let filled: Vec<Vec<[u32; 3]>> = short.par_iter().map(|ring| fill(positions, ring, &rim)).collect();
    shell.extend(filled.into_iter().flatten());
    long.iter().for_each(|ring| fan(positions, shell, ring));
}

/// Directed edges that patches need: an edge used once too often as (a,b) needs one that runs (b,a). Sorted.
pub(super) fn missing(shell: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let mut balance: HashMap<(u32, u32), i32> = HashMap::with_capacity(shell.len() * 2);
    for (a, b) in shell.iter().flat_map(|t| edges(*t)) {
        *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
    }
    let mut missing: Vec<(u32, u32)> = Vec::new();
    for (&(a, b), &n) in &balance {
        let edge = if n > 0 { (b, a) } else { (a, b) };
        missing.extend(std::iter::repeat_n(edge, n.unsigned_abs() as usize));
    }
    missing.sort_unstable();
    missing
}

/// The normals along the missing edges, and all edges between their vertices.
fn rim(positions: &[DVec3], shell: &[[u32; 3]], missing: &[(u32, u32)]) -> Rim {
    let open: HashSet<u32> = missing.iter().map(|edge| edge.0).collect();
    let lacking: HashSet<(u32, u32)> = missing.iter().copied().collect();
    let mut rim = Rim { normals: HashMap::with_capacity(missing.len()), edges: HashSet::new() };
    for t in shell {
        for (a, b) in edges(*t) {
            if open.contains(&a) && open.contains(&b) {
                rim.edges.insert((a.min(b), a.max(b)));
            }
            if lacking.contains(&(b, a)) {
                let [p, q, r] = t.map(|v| positions[v as usize]);
                rim.normals.insert((a, b), (q - p).cross(r - p).normalize_or_zero());
            }
        }
    }
    rim
}

/// A loop cut where it comes through a vertex again.
fn simple(ring: &[u32]) -> Vec<Vec<u32>> {
    let mut place: HashMap<u32, usize> = HashMap::new();
    let (mut path, mut loops): (Vec<u32>, Vec<Vec<u32>>) = (Vec::new(), Vec::new());
    for &v in ring {
        if let Some(&k) = place.get(&v) {
            let cut: Vec<u32> = path.drain(k..).collect();
            cut.iter().for_each(|v| _ = place.remove(v));
            loops.push(cut);
        }
        place.insert(v, path.len());
        path.push(v);
    }
    loops.push(path);
    loops
}

/// Faces from each edge of a loop to its centroid.
fn fan(positions: &mut Vec<DVec3>, shell: &mut Vec<[u32; 3]>, ring: &[u32]) {
    let centre = ring.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / ring.len() as f64;
    let hub = positions.len() as u32;
    positions.push(centre);
    for (i, &a) in ring.iter().enumerate() {
        shell.push([a, ring[(i + 1) % ring.len()], hub]);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Corners ±x, ±y, ±z in this order; face i is the octant of the signs in i's bits (z, y, x from the first), 1 for minus.
    pub fn octahedron() -> ([DVec3; 6], [[u32; 3]; 8]) {
        let corners = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
        let faces = std::array::from_fn(|i| {
            let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2];
            let [a, b, c] = [x as u32, 2 + y as u32, 4 + z as u32];
            if (x + y + z) % 2 == 0 { [a, b, c] } else { [a, c, b] }
        });
        (corners, faces)
    }

    fn volume(positions: &[DVec3], faces: &[[u32; 3]]) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| move |t: &[u32; 3]| positions[t[k] as usize]);
        faces.iter().map(|t| a(t).dot(b(t).cross(c(t))) / 6.0).sum()
    }

    #[test]
    fn any_faces_of_an_octahedron_are_closed_without_new_vertices() {
        let (corners, all) = octahedron();
        for set in 1..255_u32 {
            let mut positions = corners.to_vec();
            let mut faces: Vec<[u32; 3]> = (0..8).filter(|i| set >> i & 1 == 1).map(|i| all[i]).collect();
            let mut report = MeshReport::default();
            close(&mut positions, &mut faces, &mut report);
            assert!(missing(&faces).is_empty(), "{set:b}");
            assert_eq!(positions.len(), 6);
            assert!(report.holes > 0 && report.open_edges >= 3);
            // The whole octahedron has 4/3.
            let inside = volume(&positions, &faces);
            assert!((-1e-12..4.0 / 3.0 + 1e-12).contains(&inside), "{set:b}: {inside}");
            let every_other = [0b0110_1001, 0b1001_0110].contains(&set);
            assert!(!every_other || (inside - 4.0 / 3.0).abs() < 1e-12);
        }
    }

    /// A tube of `n` squares around the z axis, of radius and length 1.
    fn tube(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let at = |i: u32| {
            let turn = std::f64::consts::TAU * f64::from(i / 2) / f64::from(n);
            DVec3::new(turn.cos(), turn.sin(), f64::from(i % 2))
        };
        let squares = (0..n).map(|i| [2 * i, 2 * (i + 1) % (2 * n), 2 * (i + 1) % (2 * n) + 1, 2 * i + 1]);
        ((0..2 * n).map(at).collect(), squares.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
    }

    #[test]
    fn long_loops_get_fans() {
        for (n, hubs) in [(LONGEST as u32, 0), (LONGEST as u32 + 1, 2), (50_000, 2)] {
            let (mut positions, mut faces) = tube(n);
            let vertices = positions.len();
            let mut report = MeshReport::default();
            close(&mut positions, &mut faces, &mut report);
            assert!(missing(&faces).is_empty());
            assert_eq!((report.holes, report.open_edges), (2, 2 * n as usize));
            assert_eq!(positions.len() - vertices, hubs);
            // A prism over a regular polygon.
            let expected = 0.5 * f64::from(n) * (std::f64::consts::TAU / f64::from(n)).sin();
            assert!((volume(&positions, &faces) - expected).abs() < 1e-9, "{n}");
        }
    }

    #[test]
    fn what_fills_loops_is_bounded() {
        // More loops of 200 edges than are worth n³ steps each: 60 tubes have 120.
        let (mut positions, mut faces) = (Vec::new(), Vec::new());
        for k in 0..60 {
            let (own, squares) = tube(200);
            let base = positions.len() as u32;
            positions.extend(own.iter().map(|p| *p + 3.0 * f64::from(k) * DVec3::X));
            faces.extend(squares.iter().map(|t| t.map(|v| v + base)));
        }
        let vertices = positions.len();
        close(&mut positions, &mut faces, &mut MeshReport::default());
        assert!(missing(&faces).is_empty());
        assert_eq!(positions.len() - vertices, 120 - MOST / 200_usize.pow(3));
    }

    #[test]
    fn loops_are_cut_where_they_meet_themselves() {
        assert_eq!(simple(&[1, 2, 3, 4]), [[1, 2, 3, 4]]);
        assert_eq!(simple(&[1, 2, 3, 1, 4, 5]), [[1, 2, 3], [1, 4, 5]]);
        assert_eq!(simple(&[1, 2, 3, 4, 5, 3, 6, 7, 2, 8]), [&[3, 4, 5][..], &[2, 3, 6, 7], &[1, 2, 8]]);
    }
}
