//! Boxes with subdivided faces, sharp or rounded.

use super::Triangles;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_4;

/// Segments of a quarter turn at a rounded edge, halved: from the face to the diagonal.
const RIM: usize = 3;

/// A box around the origin, `half` its half edges, each face in `cells` × `cells` squares.
pub fn cuboid(half: [f64; 3], cells: usize) -> Triangles {
    let lines = half.map(|h| (0..=cells).map(|i| h * (2.0 * i as f64 / cells as f64 - 1.0)).collect());
    faces(&lines)
}

/// A box whose edges and corners are rounded with `radius`; `cells` squares along the flat part of each edge.
pub fn rounded_cuboid(half: [f64; 3], radius: f64, cells: usize) -> Triangles {
    // Lines in the rim stand where they part the quarter turn evenly once pushed onto the round.
    let rim = |i: usize| radius * (FRAC_PI_4 * i as f64 / RIM as f64).tan();
    let lines = half.map(|h| {
        let flat = h - radius;
        let mut line: Vec<f64> = (1..=RIM).rev().map(|i| -flat - rim(i)).collect();
        line.extend((0..=cells).map(|i| flat * (2.0 * i as f64 / cells as f64 - 1.0)));
        line.extend((1..=RIM).map(|i| flat + rim(i)));
        line
    });
    let mut t = faces(&lines);
    let flat = DVec3::from(half) - radius;
    for p in &mut t.positions {
        let inner = p.clamp(-flat, flat);
        *p = inner + (*p - inner).normalize_or_zero() * radius;
    }
    t
}

/// The surface of the lattice of three sets of lines, with shared vertices.
fn faces(lines: &[Vec<f64>; 3]) -> Triangles {
    let mut t = Triangles::default();
    let mut index: HashMap<[usize; 3], u32> = HashMap::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (side, level) in [(0, 0), (1, lines[axis].len() - 1)] {
            for i in 0..lines[u].len() - 1 {
                for j in 0..lines[v].len() - 1 {
                    let mut vertex = |i: usize, j: usize| {
                        let mut key = [0; 3];
                        (key[axis], key[u], key[v]) = (level, i, j);
                        *index.entry(key).or_insert_with(|| {
                            let p = std::array::from_fn(|k| lines[k][key[k]]);
                            t.positions.push(DVec3::from_array(p));
                            t.positions.len() as u32 - 1
                        })
                    };
                    let (a, b) = (vertex(i, j), vertex(i + 1, j));
                    let (c, d) = (vertex(i + 1, j + 1), vertex(i, j + 1));
                    let outwards = if side == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                    t.triangles.extend(outwards);
                }
            }
        }
    }
    t
}
