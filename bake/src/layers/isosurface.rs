//! Isosurfaces by surface nets (Gibson 1998, in the form without relaxation): one vertex in every cell that the
//! surface passes, at the mean of the crossings on the cell's edges, and one quad around every crossed edge.

use super::Layer;
use crate::field::DistanceGrid;
use glam::DVec3;
use std::collections::HashMap;

/// The surface depth = `level`; normals point deeper.
pub(super) fn extract(grid: &DistanceGrid, level: f32) -> Layer {
    let mut layer = Layer {
        offset: 0.0,
        thickness: 0.0,
        positions: Vec::new(),
        inward: Vec::new(),
        triangles: Vec::new(),
    };
    let [nx, ny, nz] = grid.size;
    let mut vertex_of_cell: HashMap<usize, u32> = HashMap::new();
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                if let Some((p, n)) = cell_vertex(grid, level, [i, j, k]) {
                    vertex_of_cell.insert(grid.index(i, j, k), layer.positions.len() as u32);
                    layer.positions.push(p);
                    layer.inward.push(n);
                }
            }
        }
    }
    let strides = [1, nx, nx * ny];
    for k in 1..nz - 1 {
        for j in 1..ny - 1 {
            for i in 1..nx - 1 {
                let at = grid.index(i, j, k);
                let here = grid.depth[at] >= level;
                for axis in 0..3 {
                    let there = grid.depth[at + strides[axis]] >= level;
                    if here == there {
                        continue;
                    }
                    let (u, v) = (strides[(axis + 1) % 3], strides[(axis + 2) % 3]);
                    let cells = [at, at - u, at - u - v, at - v].map(|c| vertex_of_cell.get(&c).copied());
                    if let [Some(a), Some(b), Some(c), Some(d)] = cells {
                        layer.triangles.push([a, b, c]);
                        layer.triangles.push([a, c, d]);
                    }
                }
            }
        }
    }
    layer
}

fn cell_vertex(grid: &DistanceGrid, level: f32, [i, j, k]: [usize; 3]) -> Option<(DVec3, DVec3)> {
    let mut depth = [0.0f32; 8];
    let mut inside = 0;
    for (c, d) in depth.iter_mut().enumerate() {
        *d = grid.depth[grid.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] - level;
        inside += u32::from(*d >= 0.0);
    }
    if inside == 0 || inside == 8 {
        return None;
    }
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for axis in 0..3 {
        for c in (0..8).filter(|c| c >> axis & 1 == 0) {
            let (a, b) = (depth[c], depth[c | 1 << axis]);
            if (a >= 0.0) != (b >= 0.0) {
                let mut p = DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
                p[axis] = f64::from(a / (a - b));
                sum += p;
                count += 1.0;
            }
        }
    }
    let mut gradient = DVec3::ZERO;
    for (c, d) in depth.iter().enumerate() {
        let side = |bit: usize| if c >> bit & 1 == 1 { 1.0 } else { -1.0 };
        gradient += DVec3::new(side(0), side(1), side(2)) * f64::from(*d);
    }
    let corner = grid.origin + DVec3::new(i as f64, j as f64, k as f64) * grid.cell;
    Some((corner + sum / count * grid.cell, gradient.try_normalize()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_has_the_area_of_a_ball() {
        let n = 40;
        let cell = 2.4 / (n - 1) as f64;
        let mut grid = DistanceGrid {
            size: [n; 3],
            origin: DVec3::splat(-1.2),
            cell,
            depth: vec![0.0; n * n * n],
            skipped: 0,
        };
        for i in 0..n * n * n {
            grid.depth[i] = (1.0 - grid.node(i).length()) as f32;
        }
        let layer = extract(&grid, 0.2);
        let area: f64 = layer
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| layer.positions[v as usize]);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        let exact = 4.0 * std::f64::consts::PI * 0.8 * 0.8;
        assert!((area / exact - 1.0).abs() < 0.03, "{area} {exact}");
        for (p, n) in layer.positions.iter().zip(&layer.inward) {
            assert!((p.length() - 0.8).abs() < 0.3 * cell);
            assert!(n.dot(-p.normalize()) > 0.97);
        }
    }
}
