//! Rays through the mesh: the stretches inside it and the boundary factors on the way, from raw crossings.

use diaphane_formats::fresnel;
use diaphane_formats::visibility::{Accel, Crossing};
use glam::DVec3;

/// A stretch of a ray inside the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Ray parameter where it begins; 0 if the ray starts inside.
    pub start: f64,
    /// Ray parameter where it ends.
    pub end: f64,
    /// Product of the Fresnel transmittances 1 - F of all crossings up to and including its beginning.
    pub reached: f64,
    /// 1 - F of its end.
    pub leaving: f64,
}

/// Reusable memory of one worker.
#[derive(Default)]
pub struct Scratch {
    crossings: Vec<Crossing>,
    /// The result of [`trace`].
    pub stretches: Vec<Stretch>,
}

/// Fills `scratch.stretches` with the parts of the ray `origin` + t `direction` (unit), t in 0..`limit`, where the
/// winding number is positive, in order. Where shells overlap the medium counts once.
///
/// A stretch that `limit` ends has `leaving` = 1: the ray stops there without meeting the boundary.
pub fn trace(accel: &Accel, ior: f64, origin: DVec3, direction: DVec3, limit: f64, scratch: &mut Scratch) {
    let Scratch { crossings, stretches } = scratch;
    stretches.clear();
    accel.crossings(origin, direction, 0.0, f64::INFINITY, crossings);
    // Exits before entries at equal distance: touching shells do not overlap.
    crossings.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(b.sign.cmp(&a.sign)));
    let mut winding: i32 = crossings.iter().map(|c| c.sign).sum();
    let through = |c: &Crossing| {
        if ior == 1.0 { 1.0 } else { fresnel::transmittance(direction.dot(accel.normal(c.triangle)), ior) }
    };
    let mut reached = 1.0;
    let mut open = (winding > 0).then_some(0.0);
    for c in crossings.iter() {
        if c.t >= limit {
            break;
        }
        winding -= c.sign;
        match open {
            None if winding > 0 => {
                reached *= through(c);
                open = Some(c.t);
            }
            Some(start) if winding <= 0 => {
                let leaving = through(c);
                if c.t > start {
                    stretches.push(Stretch { start, end: c.t, reached, leaving });
                }
                reached *= leaving;
                open = None;
            }
            _ => {}
        }
    }
    if let Some(start) = open
        && limit.is_finite()
        && limit > start
    {
        stretches.push(Stretch { start, end: limit, reached, leaving: 1.0 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::mesh::Mesh;

    fn boxes(list: &[(DVec3, DVec3)]) -> Accel {
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for (low, high) in list {
            let base = positions.len() as u32;
            for k in 0..8 {
                let pick = |bit: usize, a: f64, b: f64| if k >> bit & 1 == 0 { a } else { b };
                positions.push(DVec3::new(
                    pick(0, low.x, high.x),
                    pick(1, low.y, high.y),
                    pick(2, low.z, high.z),
                ));
            }
            for [a, b, c, d] in
                [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
            {
                triangles.extend([[a, b, c], [a, c, d]].map(|t: [u32; 3]| t.map(|i| i + base)));
            }
        }
        Accel::new(&Mesh::from_triangles(positions, triangles).unwrap().0)
    }

    fn stretches(accel: &Accel, ior: f64, origin: DVec3, limit: f64) -> Vec<Stretch> {
        let mut scratch = Scratch::default();
        trace(accel, ior, origin, DVec3::X, limit, &mut scratch);
        scratch.stretches
    }

    #[test]
    fn two_boxes_from_outside_from_inside_and_up_to_a_light() {
        let accel = boxes(&[
            (DVec3::new(0.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 1.0)),
            (DVec3::new(2.0, -1.0, -1.0), DVec3::new(4.0, 1.0, 1.0)),
        ]);
        let ends = |v: Vec<Stretch>| v.iter().map(|s| (s.start, s.end)).collect::<Vec<_>>();
        let off = DVec3::new(0.0, 0.1, 0.3);
        let near = |got: Vec<(f64, f64)>, want: &[(f64, f64)]| {
            assert_eq!(got.len(), want.len(), "{got:?}");
            for (g, w) in got.iter().zip(want) {
                assert!((g.0 - w.0).abs() < 1e-12 && (g.1 - w.1).abs() < 1e-12, "{got:?}");
            }
        };
        near(ends(stretches(&accel, 1.0, off - DVec3::X, f64::INFINITY)), &[(1.0, 2.0), (3.0, 5.0)]);
        near(ends(stretches(&accel, 1.0, off + DVec3::X * 0.5, f64::INFINITY)), &[(0.0, 0.5), (1.5, 3.5)]);
        near(ends(stretches(&accel, 1.0, off + DVec3::X * 0.5, 2.5)), &[(0.0, 0.5), (1.5, 2.5)]);
        near(ends(stretches(&accel, 1.0, off + DVec3::X * 0.5, 1.0)), &[(0.0, 0.5)]);
        near(ends(stretches(&accel, 1.0, off + DVec3::X * 5.0, f64::INFINITY)), &[]);
    }

    #[test]
    fn boundary_factors_accumulate() {
        let accel = boxes(&[
            (DVec3::new(0.0, -1.0, -1.0), DVec3::new(1.0, 1.0, 1.0)),
            (DVec3::new(2.0, -1.0, -1.0), DVec3::new(4.0, 1.0, 1.0)),
        ]);
        // Normal incidence at n = 1.5 lets 96 % through at each face.
        let v = stretches(&accel, 1.5, DVec3::new(-1.0, 0.1, 0.3), f64::INFINITY);
        assert!((v[0].reached - 0.96).abs() < 1e-12 && (v[0].leaving - 0.96).abs() < 1e-12);
        assert!((v[1].reached - 0.96f64.powi(3)).abs() < 1e-12);
        let v = stretches(&accel, 1.5, DVec3::new(0.5, 0.1, 0.3), 2.0);
        assert_eq!((v[0].reached, v[1].leaving), (1.0, 1.0));
    }

    #[test]
    fn overlapping_boxes_count_once() {
        let accel = boxes(&[
            (DVec3::new(0.0, -1.0, -1.0), DVec3::new(2.0, 1.0, 1.0)),
            (DVec3::new(1.0, -0.9, -0.9), DVec3::new(3.0, 0.9, 0.9)),
        ]);
        let v = stretches(&accel, 1.5, DVec3::new(-1.0, 0.1, 0.3), f64::INFINITY);
        assert_eq!(v.len(), 1);
        assert!((v[0].end - v[0].start - 3.0).abs() < 1e-12);
        assert!((v[0].reached - 0.96).abs() < 1e-12);
    }
}
