//! Pieces: triangles that hang together over edges shared by two, turned so that neighbours agree.

use super::MeshReport;
use glam::DVec3;
use std::collections::HashMap;

/// The directed edges of a triangle.
pub(super) fn edges(t: [u32; 3]) -> [(u32, u32); 3] {
    [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]
}

/// The unit normal of a triangle times the angle of its corner `k`; 0 where it has no area.
pub(super) fn corner(positions: &[DVec3], t: [u32; 3], k: usize) -> DVec3 {
    let [a, b, c] = [0, 1, 2].map(|i| positions[t[(k + i) % 3] as usize]);
    let normal = (b - a).cross(c - a);
    normal.normalize_or_zero() * normal.length().atan2((b - a).dot(c - a))
}

/// Which triangle belongs where.
pub(super) struct Pieces {
    /// Triangles of each piece.
    pub members: Vec<Vec<u32>>,
    /// Pieces in which no way round agrees for all neighbours.
    pub one_sided: Vec<bool>,
    /// Pieces that are not closed by themselves.
    pub open: Vec<bool>,
    /// Pieces of islands that are too torn to be joined.
    pub torn: Vec<bool>,
    /// Edges of a single triangle.
    pub lone_edges: Vec<(u32, u32)>,
    /// Triangles that were turned.
    pub turned: Vec<bool>,
    /// Edges shared by more than two triangles.
    pub crowded_edges: Vec<(u32, u32)>,
}

/// Makes neighbours agree in winding, breadth first over edges shared by two triangles.
pub(super) fn orient(positions: &[DVec3], triangles: &mut [[u32; 3]]) -> Pieces {
    let mut users: HashMap<(u32, u32), Vec<u32>> = HashMap::with_capacity(triangles.len() * 2);
    for (i, t) in triangles.iter().enumerate() {
        for (a, b) in edges(*t) {
            users.entry((a.min(b), a.max(b))).or_default().push(i as u32);
        }
    }
    let used = |is: fn(usize) -> bool| {
        let mut found: Vec<(u32, u32)> =
            users.iter().filter(|(_, u)| is(u.len())).map(|(edge, _)| *edge).collect();
        found.sort_unstable();
        found
    };
    let mut pieces = Pieces {
        members: Vec::new(),
        one_sided: Vec::new(),
        open: Vec::new(),
        torn: Vec::new(),
        lone_edges: used(|n| n == 1),
        turned: vec![false; triangles.len()],
        crowded_edges: used(|n| n > 2),
    };
    let mut reached = vec![false; triangles.len()];
    for seed in 0..triangles.len() {
        if std::mem::replace(&mut reached[seed], true) {
            continue;
        }
        let mut members = vec![seed as u32];
        let (mut one_sided, mut paired) = (false, true);
        let mut next = 0;
        while next < members.len() {
            let t = members[next] as usize;
            next += 1;
            for (a, b) in edges(triangles[t]) {
                let Some([x, y]) = users.get(&(a.min(b), a.max(b))).map(Vec::as_slice) else {
                    paired = false;
                    continue;
                };
                let other = if *x as usize == t { *y } else { *x } as usize;
                // Consistent neighbours run through their common edge in opposite directions.
                let agrees = !edges(triangles[other]).contains(&(a, b));
                if std::mem::replace(&mut reached[other], true) {
                    one_sided |= !agrees;
                    continue;
                }
                if !agrees {
                    triangles[other].swap(1, 2);
                    pieces.turned[other] = true;
                }
                members.push(other as u32);
            }
        }
        keep_majority(positions, triangles, &mut pieces.turned, &members);
        pieces.open.push((one_sided || !paired) && is_open(triangles, &members));
        pieces.members.push(members);
        pieces.one_sided.push(one_sided);
        pieces.torn.push(false);
    }
    pieces
}

/// If most of a piece's area had to be turned, the seed was the wrong one: undo.
pub(super) fn keep_majority(
    positions: &[DVec3],
    triangles: &mut [[u32; 3]],
    turned: &mut [bool],
    members: &[u32],
) {
    let area = |t: [u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        (b - a).cross(c - a).length()
    };
    let (mut flipped, mut all) = (0.0, 0.0);
    for &i in members {
        let a = area(triangles[i as usize]);
        all += a;
        if turned[i as usize] {
            flipped += a;
        }
    }
    if flipped > 0.5 * all {
        for &i in members {
            triangles[i as usize].swap(1, 2);
            turned[i as usize] = !turned[i as usize];
        }
    }
}

impl Pieces {
    /// Forgets pieces without triangles.
    pub fn drop_empty(&mut self) {
        let full: Vec<bool> = self.members.iter().map(|own| !own.is_empty()).collect();
        for flags in [&mut self.one_sided, &mut self.open, &mut self.torn] {
            let mut full = full.iter();
            flags.retain(|_| full.next() == Some(&true));
        }
        self.members.retain(|own| !own.is_empty());
    }

    /// Counts what was found, of the pieces as they came.
    pub fn describe(&self, report: &mut MeshReport) {
        report.components = self.members.len();
        report.non_manifold_edges = self.crowded_edges.len();
    }
}

/// Whether some edge does not run as often one way as the other.
fn is_open(triangles: &[[u32; 3]], members: &[u32]) -> bool {
    let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
    for (a, b) in members.iter().flat_map(|t| edges(triangles[*t as usize])) {
        *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
    }
    balance.values().any(|n| *n != 0)
}
