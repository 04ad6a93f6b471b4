//! Optical depth and inside pieces along single rays, from the crossings of [`Accel`].

use super::{Accel, Crossing};
use crate::fresnel;
use crate::medium::Medium;
use glam::DVec3;
use std::cmp::Ordering;

/// What lies between a point and the light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depth {
    /// m: ∫ρ over the inside pieces, mesh units.
    pub density_length: f64,
    /// Product of Fresnel transmittances of the crossings, 0..1.
    pub boundary: f64,
    /// Exits minus entries: the winding number of the starting point, 1 for a point inside a clean mesh.
    pub winding: i32,
}

/// Leaves only the crossings at which the inside begins or ends, so that the medium counts once where shells overlap.
/// `crossings` are all of a ray's; they stay as they are, in their order, where none overlap.
pub(super) fn count_once(crossings: &mut Vec<Crossing>) {
    if !may_overlap(crossings) {
        return;
    }
    let mut winding: i32 = crossings.iter().map(|c| c.sign).sum();
    let mut sorted = crossings.clone();
    sorted.sort_unstable_by(nearer);
    sorted.retain(|c| {
        let before = winding > 0;
        winding -= c.sign;
        before != (winding > 0)
    });
    if sorted.len() < crossings.len() {
        *crossings = sorted;
    }
}

/// The order along a ray, exits before entries at equal distance: touching shells do not overlap.
fn nearer(a: &Crossing, b: &Crossing) -> Ordering {
    a.t.total_cmp(&b.t).then(b.sign.cmp(&a.sign))
}

/// Whether some crossing neither begins nor ends the inside. Rays have few crossings, so that looking at all pairs takes a
/// fraction of sorting a copy; of many it says yes unseen.
fn may_overlap(crossings: &[Crossing]) -> bool {
    const FEW: usize = 16;
    crossings.len() > FEW
        || crossings.iter().enumerate().any(|(i, c)| {
            let behind = |(j, o): &(usize, &Crossing)| nearer(c, o).then(i.cmp(j)) == Ordering::Less;
            let beyond: i32 = crossings.iter().enumerate().filter(behind).map(|(_, o)| o.sign).sum();
            (beyond + c.sign > 0) == (beyond > 0)
        })
}

/// Depth of `origin` along the unit vector `direction` up to distance `limit` (infinity for a distant light), by the
/// signed sum over crossings: no sorting unless shells may overlap. `scratch` is reused between calls.
///
/// A point within rounding of the surface may miss its own exit: that exit would add 0, so nothing is lost.
/// Where the light itself is inside (`limit` finite) the piece that it ends is closed there.
pub fn depth_along(
    accel: &Accel,
    medium: &Medium,
    origin: DVec3,
    direction: DVec3,
    limit: f64,
    scratch: &mut Vec<Crossing>,
) -> Depth {
    accel.crossings(origin, direction, 0.0, f64::INFINITY, scratch);
    let winding = scratch.iter().map(|c| c.sign).sum();
    let mut depth = Depth { density_length: 0.0, boundary: 1.0, winding };
    count_once(scratch);
    for c in scratch.iter() {
        let t = c.t.min(limit);
        depth.density_length += f64::from(c.sign) * medium.density_length(origin, direction, 0.0, t);
        if c.t < limit && medium.ior() != 1.0 {
            depth.boundary *= fresnel::transmittance(direction.dot(accel.normal(c.triangle)), medium.ior());
        }
    }
    depth.density_length = depth.density_length.max(0.0);
    depth
}

/// One stretch of a ray inside the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InsidePiece {
    /// Where it starts (0 when the ray starts inside).
    pub start: f64,
    /// Where it ends.
    pub end: f64,
    /// Fresnel transmittance of its entry (1 when the ray starts inside), and of its exit.
    pub boundary: [f64; 2],
    /// Triangle of the entry; `u32::MAX` when the ray starts inside.
    pub entry: u32,
}

/// Sorted inside pieces of a ray for t ≥ 0: where the winding number is positive.
pub fn inside_pieces(
    accel: &Accel,
    ior: f64,
    origin: DVec3,
    direction: DVec3,
    scratch: &mut Vec<Crossing>,
    out: &mut Vec<InsidePiece>,
) {
    out.clear();
    accel.crossings(origin, direction, 0.0, f64::INFINITY, scratch);
    scratch.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(b.sign.cmp(&a.sign)));
    let mut winding: i32 = scratch.iter().map(|c| c.sign).sum();
    let unit = direction.normalize_or_zero();
    let through = |c: &Crossing| {
        if ior == 1.0 { 1.0 } else { fresnel::transmittance(unit.dot(accel.normal(c.triangle)), ior) }
    };
    let mut open = (winding > 0).then_some((0.0, 1.0, u32::MAX));
    for c in scratch.iter() {
        winding -= c.sign;
        match open {
            None if winding > 0 => open = Some((c.t, through(c), c.triangle)),
            Some((start, entry, triangle)) if winding <= 0 => {
                if c.t > start {
                    out.push(InsidePiece { start, end: c.t, boundary: [entry, through(c)], entry: triangle });
                }
                open = None;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossings(list: &[(f64, i32)]) -> Vec<Crossing> {
        list.iter().map(|&(t, sign)| Crossing { t, sign, triangle: 0 }).collect()
    }

    fn once(list: &[(f64, i32)]) -> Vec<(f64, i32)> {
        let mut all = crossings(list);
        count_once(&mut all);
        all.iter().map(|c| (c.t, c.sign)).collect()
    }

    #[test]
    fn overlapping_shells_count_once() {
        // From within two shells to the outer one's end; through two that overlap; through one and then within another.
        assert_eq!(once(&[(2.0, 1), (1.0, 1)]), [(2.0, 1)]);
        assert_eq!(once(&[(1.0, -1), (3.0, 1), (2.0, -1), (4.0, 1)]), [(1.0, -1), (4.0, 1)]);
        assert_eq!(once(&[(1.0, 1), (1.0, 1)]), [(1.0, 1)]);
        assert_eq!(
            once(&[(1.0, 1), (2.0, -1), (3.0, -1), (4.0, 1), (5.0, 1)]),
            [(1.0, 1), (2.0, -1), (5.0, 1)]
        );
    }

    #[test]
    fn crossings_without_overlap_keep_their_order() {
        for list in [
            &[(4.0, 1), (1.0, 1), (2.0, -1)][..],
            &[(1.0, -1), (2.0, 1)],
            &[(1.0, 1)],
            &[],
            &[(3.0, -1), (4.0, 1), (1.0, -1), (3.0, 1)],
        ] {
            assert_eq!(once(list), list);
        }
    }
}
