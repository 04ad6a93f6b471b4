//! What is done to clean triangles to break them. All choices come from a hash of the index.

use diaphane_assets::shapes::Triangles;
use diaphane_formats::directions::hash;
use glam::DVec3;

/// A number in 0..1 that looks random.
fn chance(seed: u64, i: usize) -> f64 {
    (hash(seed, i as u64) >> 11) as f64 / (1u64 << 53) as f64
}

/// All faces the other way round.
pub fn reversed(mut t: Triangles) -> Triangles {
    t.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    t
}

pub fn moved(mut t: Triangles, by: DVec3) -> Triangles {
    t.positions.iter_mut().for_each(|p| *p += by);
    t
}

pub fn scaled(mut t: Triangles, by: f64) -> Triangles {
    t.positions.iter_mut().for_each(|p| *p *= by);
    t
}

/// All in one list, nothing welded.
pub fn joined(parts: &[Triangles]) -> Triangles {
    let mut all = Triangles::default();
    for part in parts {
        let base = all.positions.len() as u32;
        all.positions.extend(&part.positions);
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    all
}

fn middle(t: &Triangles, face: [u32; 3]) -> DVec3 {
    face.iter().map(|i| t.positions[*i as usize]).sum::<DVec3>() / 3.0
}

/// Without the faces whose middle is chosen.
pub fn without(mut t: Triangles, gone: impl Fn(DVec3) -> bool) -> Triangles {
    let all = t.clone();
    t.triangles.retain(|face| !gone(middle(&all, *face)));
    t
}

/// Without this share of the faces, chosen at random.
pub fn pierced(mut t: Triangles, share: f64) -> Triangles {
    let mut i = 0;
    t.triangles.retain(|_| {
        i += 1;
        chance(1, i) >= share
    });
    t
}

/// Without all faces around a vertex.
pub fn without_star(mut t: Triangles, vertex: u32) -> Triangles {
    t.triangles.retain(|face| !face.contains(&vertex));
    t
}

/// This share of the faces turned round.
pub fn turned(mut t: Triangles, share: f64) -> Triangles {
    t.triangles.iter_mut().enumerate().filter(|(i, _)| chance(2, *i) < share).for_each(|(_, t)| t.swap(1, 2));
    t
}

/// This share of the faces once more; reversed if asked.
pub fn repeated(mut t: Triangles, share: f64, reverse: bool) -> Triangles {
    let more: Vec<[u32; 3]> = (0..t.triangles.len())
        .filter(|i| chance(3, *i) < share)
        .map(|i| t.triangles[i])
        .map(|[a, b, c]| if reverse { [a, c, b] } else { [b, c, a] })
        .collect();
    t.triangles.extend(more);
    t
}

/// Every face with vertices of its own, each moved by up to `jitter`.
pub fn soup(t: &Triangles, jitter: f64) -> Triangles {
    let mut out = Triangles::default();
    for (i, face) in t.triangles.iter().enumerate() {
        for (k, v) in face.iter().enumerate() {
            let shift = DVec3::from_array(std::array::from_fn(|c| chance(4 + c as u64, 3 * i + k) - 0.5));
            out.positions.push(t.positions[*v as usize] + jitter * shift);
        }
        let n = 3 * i as u32;
        out.triangles.push([n, n + 1, n + 2]);
    }
    out
}

/// A face without area on the first edge of every `step`th face, its third corner on the edge's first.
pub fn with_slivers(mut t: Triangles, step: usize) -> Triangles {
    let more: Vec<[u32; 3]> = t.triangles.iter().step_by(step).map(|f| [f[0], f[1], f[0]]).collect();
    t.triangles.extend(more);
    t
}

/// Adds a vertex half way between two. Coordinates of a box's edges are such that it is on their line exactly.
fn add_middle(t: &mut Triangles, a: u32, b: u32) -> u32 {
    t.positions.push(0.5 * (t.positions[a as usize] + t.positions[b as usize]));
    t.positions.len() as u32 - 1
}

/// A face without area between three points of the first edge of every `step`th face.
pub fn with_flat_faces(mut t: Triangles, step: usize) -> Triangles {
    for i in (0..t.triangles.len()).step_by(step) {
        let [a, b, _] = t.triangles[i];
        let m = add_middle(&mut t, a, b);
        t.triangles.push([a, m, b]);
    }
    t
}

/// The first edge of every `step`th face is split in that face, not in its neighbour.
pub fn with_split_edges(mut t: Triangles, step: usize) -> Triangles {
    for i in (0..t.triangles.len()).step_by(step) {
        let [a, b, c] = t.triangles[i];
        let m = add_middle(&mut t, a, b);
        t.triangles[i] = [a, m, c];
        t.triangles.push([m, b, c]);
    }
    t
}

/// A fin on the first edge of every `step`th face: one more face, whose tip stands at `height` times its edge's middle.
pub fn with_fins(mut t: Triangles, step: usize, height: f64) -> Triangles {
    for i in (0..t.triangles.len()).step_by(step) {
        let [a, b, _] = t.triangles[i];
        t.positions.push(height * 0.5 * (t.positions[a as usize] + t.positions[b as usize]));
        t.triangles.push([a, b, t.positions.len() as u32 - 1]);
    }
    t
}

/// A square of `n`² cells in the plane y = 0 around the origin, raised by `height`.
pub fn sheet(half: f64, n: u32, height: impl Fn(f64, f64) -> f64) -> Triangles {
    let mut t = Triangles::default();
    for k in 0..(n + 1) * (n + 1) {
        let at = |i: u32| half * (2.0 * f64::from(i) / f64::from(n) - 1.0);
        let (x, z) = (at(k % (n + 1)), at(k / (n + 1)));
        t.positions.push(DVec3::new(x, height(x, z), z));
    }
    for k in 0..n * n {
        let a = k / n * (n + 1) + k % n;
        let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
        t.triangles.extend([[a, c, b], [a, d, c]]);
    }
    t
}

/// A strip of `n` squares with this many half twists around the y axis.
pub fn band(n: u32, half_twists: u32) -> Triangles {
    let mut t = Triangles::default();
    for i in 0..n {
        let turn = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let twist = 0.5 * turn * f64::from(half_twists);
        let out = DVec3::new(turn.cos(), 0.0, turn.sin());
        let across = out * twist.cos() + DVec3::Y * twist.sin();
        t.positions.extend([0.7 * out - 0.25 * across, 0.7 * out + 0.25 * across]);
    }
    for i in 0..n {
        let (a, b) = (2 * i, 2 * i + 1);
        let swap = i + 1 == n && half_twists % 2 == 1;
        let (mut c, mut d) = (2 * ((i + 1) % n), 2 * ((i + 1) % n) + 1);
        if swap {
            std::mem::swap(&mut c, &mut d);
        }
        t.triangles.extend([[a, b, d], [a, d, c]]);
    }
    t
}

/// Squares of two consecutive triangles, as boxes are made of, cut along the other diagonal.
pub fn other_diagonals(mut t: Triangles) -> Triangles {
    for pair in t.triangles.chunks_exact_mut(2) {
        // The corner of the second that the first lacks, between the two that they share.
        let [first, second] = [pair[0], pair[1]];
        let Some(d) = second.into_iter().find(|v| !first.contains(v)) else { continue };
        let Some(k) = (0..3).find(|k| !second.contains(&first[*k])) else { continue };
        let [b, c, a] = [first[k], first[(k + 1) % 3], first[(k + 2) % 3]];
        pair[0] = [a, b, d];
        pair[1] = [b, c, d];
    }
    t
}
