//! From raw triangles to a closed mesh.
//!
//! ```text
//! weld ─ clean ─ pieces that agree in winding (seams mended if open) ─ islands joined ─ sheets dropped ─ shells closed ─ shells turned or dropped
//! ```
//!
//! A clean mesh comes out as it was. What is inside is decided by winding numbers ([`super::winding`]).

use super::pieces::{self, Pieces};
use super::shells::{self, Fate};
use super::{Mesh, MeshReport, islands, seams, self_intersection, sheets, weld};
use crate::{Error, Result};
use glam::DVec3;

pub(super) fn repair(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<(Mesh, MeshReport)> {
    let mut report = MeshReport { objects: 1, ..MeshReport::default() };
    if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
        return Err(Error::invalid(format!("vertex {} is not finite; remove or mend it", i + 1)));
    }
    if triangles.iter().flatten().any(|&i| i as usize >= positions.len()) {
        return Err(Error::invalid("a face names a vertex that does not exist"));
    }
    let (mut positions, triangles) = weld::weld(&positions, &triangles, &mut report);
    let mut triangles = weld::clean(&positions, triangles, &mut report);
    if triangles.is_empty() {
        return Err(Error::invalid("has only triangles without area; a closed mesh with volume is needed"));
    }
    let faces = triangles.len();
    let (mut turned, pieces, tatters) = oriented(&positions, &mut triangles, &mut report);
    let shells = shells::gather(&mut positions, &triangles, &pieces, &mut report);
    let fates = shells::nest(&shells, &mut report);
    // Of what is torn, bits may have an inside by chance, and one part may be turned against another.
    let (flat, solid): (Vec<_>, Vec<_>) =
        shells.iter().zip(&fates).partition(|(_, fate)| **fate == Fate::Flat);
    let count = |some: &[(&shells::Shell, &Fate)]| some.iter().map(|(s, _)| s.members.len()).sum::<usize>();
    let are_open = solid.iter().all(|(shell, _)| !shell.patches.is_empty());
    let (left, lost) = (count(&solid), count(&flat) + tatters);
    let times = if faces < islands::FEW { 1 } else { LOST };
    if are_open && left > 0 && lost * times > left {
        return Err(torn(lost, faces));
    }
    // Members in their old order, patches after them.
    let mut kept = vec![false; triangles.len()];
    let mut patches = Vec::new();
    for (shell, fate) in shells.iter().zip(&fates) {
        match fate {
            Fate::Flat => report.mending.sheets += 1,
            Fate::Nested => report.mending.nested += 1,
            Fate::Keep | Fate::Turn => {
                let turn = *fate == Fate::Turn;
                for &t in &shell.members {
                    kept[t as usize] = true;
                    if turn {
                        triangles[t as usize].swap(1, 2);
                        turned[t as usize] ^= true;
                    }
                }
                patches
                    .extend(shell.patches.iter().map(|&[a, b, c]| if turn { [a, c, b] } else { [a, b, c] }));
            }
        }
    }
    report.flipped = turned.iter().zip(&kept).filter(|(turned, kept)| **turned && **kept).count();
    retain(&mut triangles, |i| kept[i]);
    triangles.extend(patches);
    weld::compact(&mut positions, &mut triangles);
    if triangles.is_empty() {
        return Err(no_inside(&report));
    }
    let mesh = Mesh { positions, triangles };
    report.vertices = mesh.positions.len();
    report.triangles = mesh.triangles.len();
    report.self_intersections = self_intersection::count(&mesh);
    Ok((mesh, report))
}

fn retain(triangles: &mut Vec<[u32; 3]>, keep: impl Fn(usize) -> bool) {
    let mut i = 0;
    triangles.retain(|_| {
        i += 1;
        keep(i - 1)
    });
}

/// Pieces without open sheets, which triangles were turned, and how many faces of tatters went with the sheets. Where a sheet goes,
/// what it hung on may hang together.
fn oriented(
    positions: &[DVec3],
    triangles: &mut Vec<[u32; 3]>,
    report: &mut MeshReport,
) -> (Vec<bool>, Pieces, usize) {
    let given = triangles.clone();
    let mut pieces = pieces::orient(positions, triangles);
    if let Some(mended) = seams::mend(positions, &given, &pieces.lone_edges, report) {
        *triangles = mended;
        pieces = pieces::orient(positions, triangles);
    }
    islands::join(positions, triangles, &mut pieces);
    pieces.describe(report);
    let mut turned = std::mem::take(&mut pieces.turned);
    let mut tatters = 0;
    loop {
        let gone = sheets::find(positions, triangles, &pieces, report);
        if !gone.contains(&true) {
            return (turned, pieces, tatters);
        }
        let went = pieces.members.iter().filter(|m| m.first().is_some_and(|t| gone[*t as usize]));
        let faces = went.map(|m| m.iter().map(|t| triangles[*t as usize]).collect::<Vec<_>>());
        tatters += faces.filter(|f| islands::is_ragged(f)).map(|f| f.len()).sum::<usize>();
        retain(triangles, |i| !gone[i]);
        let mut gone = gone.iter();
        turned.retain(|_| gone.next() == Some(&false));
        pieces = pieces::orient(positions, triangles);
        islands::join(positions, triangles, &mut pieces);
        turned.iter_mut().zip(&pieces.turned).for_each(|(all, now)| *all ^= now);
    }
}

/// Open shells are taken for torn where there is more than one such part of their faces beside them that belongs to nothing.
const LOST: usize = 16;

/// What is said of a mesh of which too much belongs to nothing.
fn torn(lost: usize, faces: usize) -> Error {
    Error::invalid(format!(
        "is torn: {lost} of {faces} faces belong to nothing that encloses a volume, and what does has holes; close the holes or remove the loose faces"
    ))
}

/// Why nothing is left.
fn no_inside(report: &MeshReport) -> Error {
    if report.mending.one_sided > 0 && report.mending.sheets == 0 {
        return Error::invalid(
            "encloses no volume: it is a one-sided surface, which has no inside; give it thickness",
        );
    }
    let what = match report.mending.sheets {
        0 | 1 => "it is an open sheet, which has no inside".to_owned(),
        n => format!("it is {n} open sheets, which have no inside"),
    };
    Error::invalid(format!("encloses no volume: {what}; close it, join its edges or give it thickness"))
}
