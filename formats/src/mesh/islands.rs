//! Islands: open pieces that hang together by vertices only, as those do that are left where many faces are missing. By
//! themselves they would be sheets; with what lies around them they are one surface with holes.
//!
//! Where all neighbours over edges agreed in winding, islands keep theirs. Otherwise each is turned as the faces around its
//! vertices are, the strongest agreements first. What is so torn that its holes say more than its faces is left as it is.

use super::pieces::{Pieces, corner, edges, keep_majority};
use super::{close, loops, sheets};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Neighbours of an island at one vertex that it is compared with, at the most.
const NEAR: usize = 4;

/// Normals whose product is within this of 0, as at the edges of a box, tell nothing.
const SQUARE: f64 = 1e-6;

/// Share of the edges that belong to a single face, above which islands may be torn. Where a share s of the faces is missing
/// at random it is 2 s / (1 + s); a piece that hangs together by edges has less, from five faces on.
const LONE: f64 = 0.6;

/// Such islands are torn if an open edge lies on a loop longer than this on average, and than that where windings are a guess
/// too. Of balls, tori, boxes and birds without half of their faces it is 9 to 12, without three fifths 21 to 44.
const LOOP: f64 = 20.0;
const LOOP_GUESSED: f64 = 8.0;

/// Share above which a piece is no sheet: of 72 faces, a square one has 0.22. Where a share s of the faces is missing it is
/// 2 s / (1 + s).
const RAGGED: f64 = 0.25;

/// Sheets that are looked for at the vertices of what they hang on, at the most: each look is at all of it.
const HANGING: usize = 16;

/// Fewer faces are never torn: shares of so few mean nothing.
pub(super) const FEW: usize = 64;

/// The normals of a piece's faces around an open vertex, weighted with their corners' angles.
struct Fan {
    vertex: u32,
    piece: usize,
    normal: DVec3,
}

/// Makes one piece of open pieces that share vertices at which every edge belongs to one triangle or two.
pub(super) fn join(positions: &[DVec3], triangles: &mut [[u32; 3]], pieces: &mut Pieces) {
    let links = links(&fans(positions, triangles, pieces));
    if links.is_empty() {
        return;
    }
    let trusted = !pieces.turned.contains(&true);
    let mut groups = Groups::new(pieces.members.len());
    for (p, q, agreement) in links {
        groups.link(p, q, !trusted && agreement < -SQUARE);
    }
    let mut sets: Vec<Vec<usize>> = vec![Vec::new(); pieces.members.len()];
    for p in 0..pieces.members.len() {
        let (first, turn) = groups.root(p);
        sets[first].push(p);
        for &t in pieces.members[p].iter().filter(|_| turn) {
            triangles[t as usize].swap(1, 2);
            pieces.turned[t as usize] ^= true;
        }
    }
    for set in sets.iter_mut().filter(|set| set.len() > 1) {
        leave_sheets(positions, triangles, pieces, set);
        let all: Vec<u32> = set.iter().flat_map(|p| &pieces.members[*p]).copied().collect();
        let faces: Vec<[u32; 3]> = all.iter().map(|t| triangles[*t as usize]).collect();
        if is_torn(positions, &faces, if trusted { LOOP } else { LOOP_GUESSED }) {
            set.iter().for_each(|p| pieces.torn[*p] = true);
            continue;
        }
        // A sheet that hangs on something would make a sheet of that.
        let corners: Vec<[DVec3; 3]> = faces.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        if !sheets::wraps(&corners) {
            continue;
        }
        if !trusted {
            keep_majority(positions, triangles, &mut pieces.turned, &all);
        }
        set.iter().for_each(|p| pieces.members[*p].clear());
        pieces.members[set[0]] = all;
    }
    pieces.drop_empty();
}

/// Leaves sheets out that hang at a vertex: what is left wraps around itself more without them. Bits may be anything.
fn leave_sheets(positions: &[DVec3], triangles: &[[u32; 3]], pieces: &Pieces, set: &mut Vec<usize>) {
    let closed = |set: &[usize]| {
        let all = set.iter().flat_map(|p| &pieces.members[*p]);
        let corners: Vec<[DVec3; 3]> =
            all.map(|t| triangles[*t as usize].map(|v| positions[v as usize])).collect();
        sheets::around_itself(&corners).abs()
    };
    let large = set.iter().copied().filter(|p| pieces.members[*p].len() >= FEW);
    let hanging: Vec<usize> = large.filter(|p| closed(&[*p]) < sheets::WRAPS).take(HANGING).collect();
    if hanging.is_empty() {
        return;
    }
    let mut whole = closed(set);
    for p in hanging {
        let rest: Vec<usize> = set.iter().copied().filter(|q| *q != p).collect();
        let without = closed(&rest);
        if without > whole {
            (*set, whole) = (rest, without);
        }
    }
}

/// Share of the edges that belong to a single face.
fn lone_share(faces: &[[u32; 3]]) -> f64 {
    let all: HashSet<(u32, u32)> =
        faces.iter().flat_map(|t| edges(*t)).map(|(a, b)| (a.min(b), a.max(b))).collect();
    close::missing(faces).len() as f64 / all.len().max(1) as f64
}

/// Whether a piece is no sheet but what is left of something.
pub(super) fn is_ragged(faces: &[[u32; 3]]) -> bool {
    faces.len() < FEW || lone_share(faces) > RAGGED
}

/// Whether nearly every face stands alone and holes are long.
fn is_torn(positions: &[DVec3], faces: &[[u32; 3]], longest: f64) -> bool {
    if faces.len() < FEW || lone_share(faces) <= LONE {
        return false;
    }
    let missing = close::missing(faces);
    let rings = loops::trace(positions, faces, &missing);
    let squares: f64 = rings.iter().map(|ring| (ring.len() as f64).powi(2)).sum();
    squares > longest * missing.len() as f64
}

/// The fans of open pieces around vertices of edges of a single triangle, by vertex and piece.
fn fans(positions: &[DVec3], triangles: &[[u32; 3]], pieces: &Pieces) -> Vec<Fan> {
    let vertices = |edges: &[(u32, u32)]| edges.iter().flat_map(|e| [e.0, e.1]).collect::<HashSet<u32>>();
    let crowded = vertices(&pieces.crowded_edges);
    let mut lone = vertices(&pieces.lone_edges);
    lone.retain(|v| !crowded.contains(v));
    let mut fans: Vec<Fan> = Vec::new();
    for (piece, own) in pieces.members.iter().enumerate() {
        if !pieces.open[piece] || pieces.one_sided[piece] {
            continue;
        }
        for (t, k) in own.iter().flat_map(|t| (0..3).map(|k| (triangles[*t as usize], k))) {
            if lone.contains(&t[k]) {
                fans.push(Fan { vertex: t[k], piece, normal: corner(positions, t, k) });
            }
        }
    }
    fans.sort_by_key(|fan| (fan.vertex, fan.piece));
    fans.dedup_by(|next, fan| {
        let same = (next.vertex, next.piece) == (fan.vertex, fan.piece);
        if same {
            fan.normal += next.normal;
        }
        same
    });
    fans
}

/// Pairs of pieces with how much their normals agree at common vertices, the most telling first.
fn links(fans: &[Fan]) -> Vec<(usize, usize, f64)> {
    let mut sums: HashMap<(usize, usize), f64> = HashMap::new();
    for at in fans.chunk_by(|a, b| a.vertex == b.vertex) {
        for (i, fan) in at.iter().enumerate() {
            for other in at[i + 1..].iter().take(NEAR) {
                *sums.entry((fan.piece, other.piece)).or_default() += fan.normal.dot(other.normal);
            }
        }
    }
    let mut links: Vec<_> = sums.into_iter().map(|((p, q), sum)| (p, q, sum)).collect();
    links.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()).then((a.0, a.1).cmp(&(b.0, b.1))));
    links
}

/// Pieces joined so far, and which of them are turned against the first of their group.
struct Groups {
    parent: Vec<usize>,
    turned: Vec<bool>,
}

impl Groups {
    fn new(n: usize) -> Self {
        Self { parent: (0..n).collect(), turned: vec![false; n] }
    }

    /// The first of a piece's group, and whether the piece is turned against it.
    fn root(&mut self, piece: usize) -> (usize, bool) {
        let (mut root, mut turn) = (piece, false);
        while self.parent[root] != root {
            turn ^= self.turned[root];
            root = self.parent[root];
        }
        // The way there is kept short.
        let (mut at, mut rest) = (piece, turn);
        while self.parent[at] != root {
            let (next, own) = (self.parent[at], self.turned[at]);
            (self.parent[at], self.turned[at]) = (root, rest);
            rest ^= own;
            at = next;
        }
        (root, turn)
    }

    /// Joins two groups, `turned` against each other at these pieces; nothing where they are one already.
    fn link(&mut self, p: usize, q: usize, turned: bool) {
        let ((a, x), (b, y)) = (self.root(p), self.root(q));
        if a != b {
            self.parent[a.max(b)] = a.min(b);
            self.turned[a.max(b)] = x ^ y ^ turned;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::Mesh;
    use crate::mesh::close::tests::octahedron;
    use glam::DVec3;

    /// An octahedron whose faces are cut into `n`² each.
    fn ball(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let (corners, faces) = octahedron();
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for [a, b, c] in faces.map(|t| t.map(|v| corners[v as usize])) {
            for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
                let mut add = |corners: [(u32, u32); 3]| {
                    let base = positions.len() as u32;
                    let at = |(i, j): (u32, u32)| {
                        (a * f64::from(n - i - j) + b * f64::from(i) + c * f64::from(j)) / f64::from(n)
                    };
                    positions.extend(corners.map(at));
                    triangles.push([base, base + 1, base + 2]);
                };
                add([(i, j), (i + 1, j), (i, j + 1)]);
                if i + j + 1 < n {
                    add([(i + 1, j), (i + 1, j + 1), (i, j + 1)]);
                }
            }
        }
        (positions, triangles)
    }

    #[test]
    fn faces_that_share_vertices_only_are_one_surface() {
        let (positions, faces) = octahedron();
        for way in [0, 1] {
            let some = (0..8_usize).filter(|i| i.count_ones() % 2 == way).map(|i| faces[i]).collect();
            let (mesh, report) = Mesh::from_triangles(positions.to_vec(), some).unwrap();
            assert_eq!((report.components, report.holes, report.triangles), (1, 4, 8));
            assert!((mesh.volume() - 4.0 / 3.0).abs() < 1e-12);
        }
    }

    #[test]
    fn islands_are_turned_as_what_is_around_them() {
        let (positions, mut triangles) = ball(4);
        // Cut in pieces of two faces; in every third of them one is turned, and one piece altogether.
        triangles = triangles.chunks(3).flat_map(|three| three[..2.min(three.len())].to_vec()).collect();
        let kept = triangles.len();
        triangles.iter_mut().skip(3).step_by(6).for_each(|t| t.swap(1, 2));
        let (mesh, report) = Mesh::from_triangles(positions, triangles).unwrap();
        assert!(report.flipped > 0 && report.holes > 0 && kept < report.triangles);
        assert!((mesh.volume() - 4.0 / 3.0).abs() < 0.02, "{}", mesh.volume());
    }

    #[test]
    fn tatters_are_refused() {
        for keep in [3, 4, 6, 9] {
            let (positions, triangles) = ball(12);
            let some = triangles
                .into_iter()
                .enumerate()
                .filter(|(i, _)| crate::directions::hash(1, *i as u64) % 10 < keep);
            match Mesh::from_triangles(positions, some.map(|(_, t)| t).collect()) {
                Ok((mesh, _)) => {
                    assert!(
                        keep > 3 && (mesh.volume() - 4.0 / 3.0).abs() < 0.02,
                        "{keep}: {}",
                        mesh.volume()
                    );
                }
                Err(e) => assert!(keep < 5 && e.to_string().contains("open sheets"), "{keep}: {e}"),
            }
        }
    }
}
