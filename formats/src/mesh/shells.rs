//! Shells: closed surfaces, which of them lie in which, and which way round each belongs.
//!
//! The inside is where the winding number is positive. A shell in no other is turned outwards. One that lies in another
//! keeps its turn relative to that: opposite, it bounds a cavity; the same, it changes nothing and is dropped. So a mesh
//! and the same mesh inside out mean the same.

use super::MeshReport;
use super::close::close;
use super::pieces::{Pieces, edges};
use super::winding::Winding;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Share of a shell's faces that must lie in another for the shell to count as within it.
const WITHIN: f64 = 0.9;

/// Faces of a shell that are looked from, at the most.
const FACES: usize = 128;

/// How far behind a face, as a part of the root of its area: touching shells are not in each other.
const BEHIND: f64 = 1e-4;

/// A shell whose volume is below this part of its cubed diagonal is a sheet seen from both sides.
const FLAT: f64 = 1e-12;

/// One closed surface.
pub(super) struct Shell {
    /// Its triangles in the mesh.
    pub members: Vec<u32>,
    /// What closes it.
    pub patches: Vec<[u32; 3]>,
    low: DVec3,
    high: DVec3,
    /// Signed, as the shell came.
    volume: f64,
    /// Places just behind some of its faces.
    witnesses: Vec<DVec3>,
    /// Empty where there are no other shells.
    corners: Vec<[DVec3; 3]>,
    /// Made when a shell near this one asks for it.
    winding: OnceLock<Winding>,
}

/// What becomes of a shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fate {
    Keep,
    Turn,
    /// Encloses nothing.
    Flat,
    /// Lies in the inside of others and bounds no cavity.
    Nested,
}

/// Joins open pieces that share edges, and closes what they leave open.
pub(super) fn gather(
    positions: &mut Vec<DVec3>,
    triangles: &[[u32; 3]],
    pieces: &Pieces,
    report: &mut MeshReport,
) -> Vec<Shell> {
    let open = &pieces.open;
    let mut parent: Vec<usize> = (0..pieces.members.len()).collect();
    let mut owner: HashMap<(u32, u32), usize> = HashMap::new();
    for p in (0..parent.len()).filter(|p| open[*p]) {
        for (a, b) in pieces.members[p].iter().flat_map(|t| edges(triangles[*t as usize])) {
            let other = *owner.entry((a.min(b), a.max(b))).or_insert(p);
            let (x, y) = (root(&mut parent, other), root(&mut parent, p));
            parent[x.max(y)] = x.min(y);
        }
    }
    let mut slot = vec![usize::MAX; parent.len()];
    let mut joined: Vec<(Vec<u32>, bool)> = Vec::new();
    for (p, &open) in open.iter().enumerate() {
        let r = root(&mut parent, p);
        if slot[r] == usize::MAX {
            slot[r] = joined.len();
            joined.push((Vec::new(), open));
        }
        joined[slot[r]].0.extend(&pieces.members[p]);
    }
    let mut drafts = Vec::with_capacity(joined.len());
    for (mut members, open) in joined {
        members.sort_unstable();
        let mut faces: Vec<[u32; 3]> = members.iter().map(|t| triangles[*t as usize]).collect();
        if open {
            close(positions, &mut faces, report);
        }
        drafts.push((members, faces));
    }
    let several = drafts.len() > 1;
    drafts.into_par_iter().map(|(members, faces)| Shell::new(positions, members, faces, several)).collect()
}

fn root(parent: &mut [usize], mut p: usize) -> usize {
    while parent[p] != p {
        parent[p] = parent[parent[p]];
        p = parent[p];
    }
    p
}

impl Shell {
    /// `faces` are the members and the patches; `several` says whether there are other shells to look for.
    fn new(positions: &[DVec3], members: Vec<u32>, faces: Vec<[u32; 3]>, several: bool) -> Self {
        let corners: Vec<[DVec3; 3]> = faces.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let low = corners.iter().flatten().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().flatten().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let centre = 0.5 * (low + high);
        let six = |[a, b, c]: &[DVec3; 3]| (a - centre).dot((b - centre).cross(c - centre));
        let volume = corners.iter().map(six).sum::<f64>() / 6.0;
        let patches = faces[members.len()..].to_vec();
        let mut shell = Self {
            members,
            patches,
            low,
            high,
            volume,
            witnesses: Vec::new(),
            corners: Vec::new(),
            winding: OnceLock::new(),
        };
        if several {
            let behind = |[a, b, c]: &[DVec3; 3]| {
                let normal = (b - a).cross(c - a) * volume.signum();
                (a + b + c) / 3.0 - normal.normalize_or_zero() * BEHIND * normal.length().sqrt()
            };
            let step = corners.len().div_ceil(FACES).max(1);
            shell.witnesses = corners.iter().step_by(step).map(behind).collect();
            shell.corners = corners;
        }
        shell
    }

    fn is_flat(&self) -> bool {
        !(self.volume.abs() > FLAT * self.low.distance(self.high).powi(3))
    }

    /// Share of the witnesses that lie in `other`.
    fn share_in(&self, other: &Self) -> f64 {
        if self.high.cmplt(other.low).any() || self.low.cmpgt(other.high).any() {
            return 0.0;
        }
        let winding = other.winding.get_or_init(|| Winding::new(other.corners.clone()));
        let inside = self.witnesses.iter().filter(|p| winding.at(**p).abs() > 0.5).count();
        inside as f64 / self.witnesses.len().max(1) as f64
    }
}

/// What becomes of each shell, the larger ones decided first.
pub(super) fn nest(shells: &[Shell], report: &mut MeshReport) -> Vec<Fate> {
    let mut fates = vec![Fate::Flat; shells.len()];
    // +1 or -1: how each shell counts in the winding number once turned.
    let mut sign = vec![0; shells.len()];
    let mut order: Vec<usize> = (0..shells.len()).filter(|s| !shells[*s].is_flat()).collect();
    order.sort_by(|a, b| shells[*b].volume.abs().total_cmp(&shells[*a].volume.abs()).then(a.cmp(b)));
    for (k, &s) in order.iter().enumerate() {
        let mut around: Vec<(usize, f64)> = order[..k]
            .par_iter()
            .map(|&other| (other, shells[s].share_in(&shells[other])))
            .filter(|(_, share)| *share > 0.0)
            .collect();
        let touched = around.len();
        around.retain(|(_, share)| *share > WITHIN);
        report.mending.overlapping += touched - around.len();
        let came = if shells[s].volume < 0.0 { -1 } else { 1 };
        let turned_with = around.last().map(|(other, _)| fate_turns(*other, shells, &sign));
        let own = if turned_with.unwrap_or(came < 0) { -came } else { came };
        let depth: i32 = around.iter().map(|(other, _)| sign[*other]).sum();
        let entirely: i32 =
            around.iter().filter(|(_, share)| *share == 1.0).map(|(other, _)| sign[*other]).sum();
        // A cavity in nothing is a shell the wrong way round.
        sign[s] = if own < 0 && depth <= 0 { 1 } else { own };
        // What is inside on both sides bounds nothing.
        let both = entirely + sign[s].min(0) > 0;
        fates[s] = match (both, sign[s] == came) {
            (true, _) => Fate::Nested,
            (_, true) => Fate::Keep,
            _ => Fate::Turn,
        };
    }
    fates
}

/// Whether a shell counts the other way round than it came.
fn fate_turns(shell: usize, shells: &[Shell], sign: &[i32]) -> bool {
    (shells[shell].volume < 0.0) == (sign[shell] > 0)
}
