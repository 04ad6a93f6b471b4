//! The boundary of a set of cubes of a lattice: unions that need no boolean operations.

use diaphane_assets::shapes::Triangles;
use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// Surface of the union of lattice cells of edge `size`, moved so that the middle of its box is the origin, every face of
/// a cell in `split`² squares. Coordinates are exact for sizes and splits that are powers of two.
pub fn cells(set: &[[i32; 3]], size: f64, split: i32) -> Triangles {
    let low = set.iter().fold(IVec3::MAX, |low, c| low.min(IVec3::from_array(*c)));
    let high = set.iter().fold(IVec3::MIN, |high, c| high.max(IVec3::from_array(*c) + 1));
    cells_around(set, size, split, (low + high).as_dvec3() * 0.5)
}

/// As [`cells`], with this point of the lattice at the origin.
pub fn cells_around(set: &[[i32; 3]], size: f64, split: i32, origin: DVec3) -> Triangles {
    let mut t = Triangles::default();
    let mut index: HashMap<IVec3, u32> = HashMap::new();
    for cell in set {
        for axis in 0..3 {
            for side in 0..2 {
                let mut beyond = *cell;
                beyond[axis] += 2 * side - 1;
                if set.contains(&beyond) {
                    continue;
                }
                for k in 0..split * split {
                    let (u, v) = (k % split, k / split);
                    let corner = |du: i32, dv: i32| {
                        let mut p = cell.map(|c| c * split);
                        p[axis] += side * split;
                        p[(axis + 1) % 3] += u + du;
                        p[(axis + 2) % 3] += v + dv;
                        IVec3::from_array(p)
                    };
                    let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    if side == 0 {
                        quad.reverse();
                    }
                    let [a, b, c, d] = quad.map(|p| {
                        *index.entry(p).or_insert_with(|| {
                            t.positions.push((p.as_dvec3() / f64::from(split) - origin) * size);
                            t.positions.len() as u32 - 1
                        })
                    });
                    t.triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    t
}
