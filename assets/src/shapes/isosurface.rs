//! The surface where a function of space is zero, by naive surface nets (Gibson 1998): one vertex in every cell that
//! the surface passes, one quadrilateral across every lattice edge that it crosses; the vertices are then moved onto
//! the surface along the gradient. Manifold as long as no cell holds two sheets; the tests check the results.

use super::Triangles;
use glam::{DVec3, I64Vec3};
use std::collections::HashMap;

/// The surface value = 0 (negative inside) within a box, on cubic cells, `cells` of them along its longest edge. The
/// function must be positive on the box's faces.
pub fn isosurface(low: DVec3, high: DVec3, cells: usize, value: impl Fn(DVec3) -> f64) -> Triangles {
    let step = (high - low).max_element() / cells as f64;
    let size: [usize; 3] = std::array::from_fn(|k| ((high - low)[k] / step).ceil() as usize + 1);
    let at = |i: [usize; 3]| low + step * DVec3::from_array(i.map(|n| n as f64));
    let slot = |i: [usize; 3]| (i[2] * size[1] + i[1]) * size[0] + i[0];
    let mut values = Vec::with_capacity(size.iter().product());
    for z in 0..size[2] {
        for y in 0..size[1] {
            values.extend((0..size[0]).map(|x| value(at([x, y, z]))));
        }
    }
    let mut t = Triangles::default();
    let mut vertex: HashMap<I64Vec3, u32> = HashMap::new();
    let mut corner = |t: &mut Triangles, cell: I64Vec3| {
        *vertex.entry(cell).or_insert_with(|| {
            t.positions.push(place(cell, step, low, &value));
            t.positions.len() as u32 - 1
        })
    };
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                for axis in 0..3 {
                    let here = [x, y, z];
                    let mut next = here;
                    next[axis] += 1;
                    if next[axis] == size[axis] {
                        continue;
                    }
                    let inside = values[slot(here)] < 0.0;
                    if inside == (values[slot(next)] < 0.0) {
                        continue;
                    }
                    // The four cells around the edge, counter-clockwise seen from its far end.
                    let (u, v) = (I64Vec3::AXES[(axis + 1) % 3], I64Vec3::AXES[(axis + 2) % 3]);
                    let cell = I64Vec3::from_array(here.map(|n| n as i64));
                    let [a, b, c, d] = [cell - u - v, cell - v, cell, cell - u].map(|k| corner(&mut t, k));
                    t.triangles.extend(if inside { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
                }
            }
        }
    }
    t
}

/// The cell's vertex: the mean of the points where the surface crosses the cell's edges, then a few Newton steps along
/// the gradient, which are short.
fn place(cell: I64Vec3, step: f64, low: DVec3, value: &impl Fn(DVec3) -> f64) -> DVec3 {
    let corner =
        |bits: i64| low + step * (cell + I64Vec3::new(bits & 1, bits >> 1 & 1, bits >> 2 & 1)).as_dvec3();
    let values: [f64; 8] = std::array::from_fn(|k| value(corner(k as i64)));
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for a in 0..8usize {
        for b in [a | 1, a | 2, a | 4].into_iter().filter(|b| *b != a) {
            if (values[a] < 0.0) != (values[b] < 0.0) {
                let share = values[a] / (values[a] - values[b]);
                sum += corner(a as i64).lerp(corner(b as i64), share);
                count += 1.0;
            }
        }
    }
    // A vertex is only asked for in a cell with a crossing edge.
    let mut p = sum / f64::max(count, 1.0);
    for _ in 0..4 {
        let e = 1e-4 * step;
        let slope = |axis: DVec3| (value(p + axis * e) - value(p - axis * e)) / (2.0 * e);
        let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        p -= (gradient * (value(p) / gradient.length_squared().max(1e-12))).clamp_length_max(0.1 * step);
    }
    p
}
