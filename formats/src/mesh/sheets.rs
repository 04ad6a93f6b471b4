//! Open sheets: pieces that neither wrap around anything nor close what the others leave open.
//!
//! A closed piece seen from its own surface has the winding number 1/2 (1 on its inner side, 0 on its outer one), a flat
//! sheet has 0. What an open piece has on average tells how far it is from being closed. A piece near 0 is still needed
//! if the others wrap around half of it, as the last face does that a box lacks; it is not if it stands outside the others
//! (fins) or inside them (walls), where they wrap around none or all of it, nor if they have another face in the same place,
//! which leaves all of it on one side and nothing on the other. Torn islands are sheets.

use super::MeshReport;
use super::pieces::Pieces;
use super::winding::{Winding, solid_angle};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Mean winding number around its own surface below which a piece wraps around nothing. A hemisphere has 1/π, a
/// round dish an eighth as deep as it is wide 0.105.
pub(super) const WRAPS: f64 = 0.1;

/// The others wrap around half of a needed piece: their winding number on both its sides is 1/2, give or take this.
const NEEDED: f64 = 0.25;

/// Faces of a piece that are looked from, at the most.
const FACES: usize = 256;

/// How far in front of a face and behind it, as a part of the root of its area.
const BESIDE: f64 = 1e-3;

/// Dropped triangles that are summed plainly before the hierarchy is made anew.
const PLAIN: usize = 1024;

type Corners = [DVec3; 3];

/// Means over the faces, by area, of the winding number in front of them and behind.
fn means_beside(faces: &[Corners], winding: impl Fn(DVec3) -> f64 + Sync) -> [f64; 2] {
    let step = faces.len().div_ceil(FACES).max(1);
    let some: Vec<&Corners> = faces.iter().step_by(step).collect();
    let each: Vec<(f64, [f64; 2])> = some
        .par_iter()
        .map(|[a, b, c]| {
            let (middle, normal) = ((a + b + c) / 3.0, 0.5 * (b - a).cross(c - a));
            let area = normal.length();
            let beside = normal.normalize_or_zero() * BESIDE * area.sqrt();
            (area, [beside, -beside].map(|offset| area * winding(middle + offset)))
        })
        .collect();
    let area = each.iter().map(|(area, _)| area).sum::<f64>().max(f64::MIN_POSITIVE);
    [0, 1].map(|side| each.iter().map(|(_, w)| w[side]).sum::<f64>() / area)
}

/// Mean winding number of a piece around its own surface, a face itself left out.
pub(super) fn around_itself(faces: &[Corners]) -> f64 {
    let tree = Winding::new(faces.to_vec());
    0.5 * means_beside(faces, |q| tree.at(q)).iter().sum::<f64>()
}

/// Whether a piece is more than a sheet.
pub(super) fn wraps(faces: &[Corners]) -> bool {
    around_itself(faces).abs() >= WRAPS
}

/// Says of each triangle whether it belongs to an open sheet.
pub(super) fn find(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    pieces: &Pieces,
    report: &mut MeshReport,
) -> Vec<bool> {
    let corners = |t: u32| triangles[t as usize].map(|v| positions[v as usize]);
    let faces = |piece: usize| pieces.members[piece].iter().map(|t| corners(*t)).collect::<Vec<_>>();
    let mut gone = vec![false; triangles.len()];
    for p in (0..pieces.members.len()).filter(|p| pieces.torn[*p]) {
        pieces.members[p].iter().for_each(|t| gone[*t as usize] = true);
        report.mending.sheets += 1;
    }
    let candidates: Vec<usize> = (0..pieces.members.len())
        .into_par_iter()
        .filter(|p| pieces.open[*p] && !pieces.torn[*p])
        .filter(|p| !wraps(&faces(*p)))
        .collect();
    if candidates.is_empty() {
        return gone;
    }
    let rest = |gone: &[bool]| {
        let left = (0..triangles.len()).filter(|t| !gone[*t]);
        Winding::new(left.map(|t| corners(t as u32)).collect())
    };
    let mut all = rest(&gone);
    let mut since: Vec<Corners> = Vec::new();
    for p in candidates {
        let own = faces(p);
        let tree = Winding::new(own.clone());
        let plain = |q: DVec3| since.iter().map(|t| solid_angle(t, q)).sum::<f64>() / (4.0 * PI);
        let [front, back] = means_beside(&own, |q| all.at(q) - tree.at(q) - plain(q));
        let is_needed = (0.5 * (front + back).abs() - 0.5).abs() < NEEDED && (front - back).abs() < NEEDED;
        if is_needed {
            continue;
        }
        pieces.members[p].iter().for_each(|t| gone[*t as usize] = true);
        *if pieces.one_sided[p] { &mut report.mending.one_sided } else { &mut report.mending.sheets } += 1;
        since.extend(own);
        if since.len() > PLAIN {
            all = rest(&gone);
            since.clear();
        }
    }
    gone
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The part of the unit sphere within this angle of the y axis.
    fn cap(angle: f64) -> Vec<Corners> {
        let n = 48;
        let at = |ring: usize, k: usize| {
            let (polar, turn) = (angle * ring as f64 / n as f64, 2.0 * PI * (k % n) as f64 / n as f64);
            DVec3::new(polar.sin() * turn.cos(), polar.cos(), polar.sin() * turn.sin())
        };
        let quads = (0..n * n).map(|i| (i / n, i % n));
        let both = |(ring, k): (usize, usize)| {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            [[a, b, c], [a, c, d]]
        };
        quads.flat_map(both).filter(|[a, b, c]| (b - a).cross(c - a).length() > 1e-12).collect()
    }

    #[test]
    fn how_far_caps_are_from_being_closed() {
        // 1/2 less the solid angle of the disc that would close the cap, over 4π, averaged over the cap by quadrature; 1/π for
        // the hemisphere.
        for (degrees, expected) in [(90.0, 1.0 / PI), (60.0, 0.2181), (30.0, 0.1122), (15.0, 0.0612)] {
            let faces = cap(f64::to_radians(degrees));
            let mean = around_itself(&faces).abs();
            assert!((mean - expected).abs() < 0.02, "{degrees}: {mean}, expected {expected}");
        }
    }
}
