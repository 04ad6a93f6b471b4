//! Balls and rings.

use super::Triangles;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// A ball around the origin: an icosahedron whose triangles are split into four `levels` times, every vertex on the
/// sphere. 20 · 4^levels triangles.
pub fn icosphere(radius: f64, levels: u32) -> Triangles {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let corners = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    let mut positions: Vec<DVec3> = corners.iter().map(|c| DVec3::from(*c).normalize()).collect();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..levels {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    positions.iter_mut().for_each(|p| *p *= radius);
    Triangles { positions, triangles }
}

/// A ring around the y axis: `tube` is the radius of the tube whose centre circle has `radius`; `around` and `across`
/// count the segments.
pub fn torus(radius: f64, tube: f64, around: u32, across: u32) -> Triangles {
    let mut t = Triangles::default();
    for i in 0..around {
        let (sin_a, cos_a) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
        for j in 0..across {
            let (sin_b, cos_b) = (TAU * f64::from(j) / f64::from(across)).sin_cos();
            let r = radius + tube * cos_b;
            t.positions.push(DVec3::new(r * cos_a, tube * sin_b, r * sin_a));
            let at = |di: u32, dj: u32| (i + di) % around * across + (j + dj) % across;
            t.triangles.push([at(0, 0), at(0, 1), at(1, 1)]);
            t.triangles.push([at(0, 0), at(1, 1), at(1, 0)]);
        }
    }
    t
}
