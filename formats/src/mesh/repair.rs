//! Welding, cleaning, orienting and closing.
//!
//! After dropping what has no area, neighbouring triangles are made to agree in winding (breadth first over edges
//! shared by two), each piece is turned so that its volume is positive unless it lies inside another piece (then it
//! is a cavity and keeps its sign), and the directed edges without an opposite, which always form closed loops
//! because the boundary of a set of triangles has no boundary itself, are closed with fans.

use super::{Mesh, MeshReport, self_intersection};
use crate::{Error, Result};
use glam::DVec3;
use std::collections::HashMap;

pub(super) fn repair(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<(Mesh, MeshReport)> {
    let mut report = MeshReport { objects: 1, ..MeshReport::default() };
    if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
        return Err(Error::invalid(format!("vertex {} is not finite; remove or mend it", i + 1)));
    }
    if triangles.iter().flatten().any(|&i| i as usize >= positions.len()) {
        return Err(Error::invalid("a face names a vertex that does not exist"));
    }
    let (positions, triangles) = weld(&positions, &triangles, &mut report);
    let mut triangles = clean(&positions, triangles, &mut report);
    if triangles.is_empty() {
        return Err(Error::invalid("has only triangles without area; a closed mesh with volume is needed"));
    }
    let component = orient(&positions, &mut triangles, &mut report);
    let mut mesh = Mesh { positions, triangles };
    close(&mut mesh, &mut report);
    turn_components_outwards(&mut mesh, &component, &mut report);
    let (low, high) = mesh.bounds();
    let size = (high - low).length();
    if !(mesh.volume() > 1e-12 * size.powi(3)) {
        return Err(Error::invalid("encloses no volume (an open sheet?); a closed mesh is needed"));
    }
    report.vertices = mesh.positions.len();
    report.triangles = mesh.triangles.len();
    report.self_intersections = self_intersection::count(&mesh);
    Ok((mesh, report))
}

/// Merges vertices with identical coordinates (-0 counts as 0) and drops those that no face uses.
fn weld(positions: &[DVec3], triangles: &[[u32; 3]], report: &mut MeshReport) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut first: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len());
    let mut index = vec![u32::MAX; positions.len()];
    let mut kept = Vec::with_capacity(positions.len());
    let mut welded = Vec::with_capacity(triangles.len());
    for t in triangles {
        welded.push(t.map(|v| {
            let slot = &mut index[v as usize];
            if *slot == u32::MAX {
                let p = positions[v as usize] + DVec3::ZERO;
                let next = kept.len() as u32;
                *slot = *first.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                    kept.push(p);
                    next
                });
                if *slot != next {
                    report.welded += 1;
                }
            }
            *slot
        }));
    }
    (kept, welded)
}

fn clean(positions: &[DVec3], triangles: Vec<[u32; 3]>, report: &mut MeshReport) -> Vec<[u32; 3]> {
    let mut seen = std::collections::HashSet::with_capacity(triangles.len());
    let mut kept = Vec::with_capacity(triangles.len());
    for t in triangles {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let area = (b - a).cross(c - a).length();
        if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || !(area > 1e-14 * longest) {
            report.degenerate += 1;
            continue;
        }
        let mut key = t;
        key.sort_unstable();
        if seen.insert(key) {
            kept.push(t);
        } else {
            report.duplicate += 1;
        }
    }
    kept
}

fn edges(t: [u32; 3]) -> [(u32, u32); 3] {
    [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]
}

/// Makes neighbours agree in winding and returns each triangle's component.
fn orient(positions: &[DVec3], triangles: &mut [[u32; 3]], report: &mut MeshReport) -> Vec<u32> {
    let mut users: HashMap<(u32, u32), Vec<u32>> = HashMap::with_capacity(triangles.len() * 2);
    for (i, t) in triangles.iter().enumerate() {
        for (a, b) in edges(*t) {
            users.entry((a.min(b), a.max(b))).or_default().push(i as u32);
        }
    }
    report.non_manifold_edges = users.values().filter(|u| u.len() > 2).count();
    let mut component = vec![u32::MAX; triangles.len()];
    let mut turned = vec![false; triangles.len()];
    let mut members = Vec::new();
    let mut count = 0;
    for seed in 0..triangles.len() {
        if component[seed] != u32::MAX {
            continue;
        }
        members.clear();
        members.push(seed as u32);
        component[seed] = count;
        let mut next = 0;
        while next < members.len() {
            let t = members[next] as usize;
            next += 1;
            for (a, b) in edges(triangles[t]) {
                let Some([x, y]) = users.get(&(a.min(b), a.max(b))).map(Vec::as_slice) else { continue };
                let other = if *x as usize == t { *y } else { *x } as usize;
                if component[other] != u32::MAX {
                    continue;
                }
                // Consistent neighbours run through their common edge in opposite directions.
                if edges(triangles[other]).contains(&(a, b)) {
                    triangles[other].swap(1, 2);
                    turned[other] = true;
                }
                component[other] = count;
                members.push(other as u32);
            }
        }
        keep_majority(positions, triangles, &mut turned, &members);
        count += 1;
    }
    report.flipped = turned.iter().filter(|&&t| t).count();
    report.components = count as usize;
    component
}

/// If most triangles of a piece had to be turned, the seed was the wrong one: undo.
fn keep_majority(positions: &[DVec3], triangles: &mut [[u32; 3]], turned: &mut [bool], members: &[u32]) {
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

/// Closes every loop of unmatched directed edges with a fan around its centroid.
fn close(mesh: &mut Mesh, report: &mut MeshReport) {
    let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
    for t in &mesh.triangles {
        for (a, b) in edges(*t) {
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    // An edge used once too often as (a,b) needs a patch that runs (b,a).
    let mut missing: Vec<(u32, u32)> = Vec::new();
    for (&(a, b), &n) in &balance {
        let edge = if n > 0 { (b, a) } else { (a, b) };
        missing.extend(std::iter::repeat_n(edge, n.unsigned_abs() as usize));
    }
    missing.sort_unstable();
    report.open_edges = missing.len();
    let mut leaving: HashMap<u32, Vec<u32>> = HashMap::new();
    for &(a, b) in missing.iter().rev() {
        leaving.entry(a).or_default().push(b);
    }
    for &(start, _) in &missing {
        let mut at = start;
        let mut path = vec![start];
        while let Some(next) = leaving.get_mut(&at).and_then(Vec::pop) {
            at = next;
            // A vertex met twice closes a simple loop: fill it and go on with the rest of the path.
            if let Some(k) = path.iter().position(|&v| v == at) {
                let ring: Vec<u32> = path.drain(k..).collect();
                fill(mesh, &ring);
                report.holes += 1;
            }
            path.push(at);
        }
    }
}

fn fill(mesh: &mut Mesh, ring: &[u32]) {
    if let [a, b, c] = *ring {
        mesh.triangles.push([a, b, c]);
        return;
    }
    if ring.len() < 3 {
        return;
    }
    let centre = ring.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / ring.len() as f64;
    let hub = mesh.positions.len() as u32;
    mesh.positions.push(centre);
    for (i, &a) in ring.iter().enumerate() {
        mesh.triangles.push([a, ring[(i + 1) % ring.len()], hub]);
    }
}

/// Turns pieces with negative volume round, unless they lie inside another piece and so bound a cavity.
fn turn_components_outwards(mesh: &mut Mesh, component: &[u32], report: &mut MeshReport) {
    let count = report.components;
    // Patches belong to the piece of the vertices that they close.
    let mut owner_of_vertex = vec![u32::MAX; mesh.positions.len()];
    for (t, &c) in mesh.triangles.iter().zip(component) {
        for v in t {
            owner_of_vertex[*v as usize] = c;
        }
    }
    let owners: Vec<u32> = mesh
        .triangles
        .iter()
        .enumerate()
        .map(|(i, t)| component.get(i).copied().unwrap_or(owner_of_vertex[t[0] as usize]))
        .collect();
    let (low, high) = mesh.bounds();
    let centre = 0.5 * (low + high);
    let mut volume = vec![0.0; count];
    let mut witness = vec![DVec3::ZERO; count];
    for (i, &c) in owners.iter().enumerate() {
        let [a, b, d] = mesh.corners(i);
        volume[c as usize] += (a - centre).dot((b - centre).cross(d - centre)) / 6.0;
        witness[c as usize] = a;
    }
    let turn: Vec<bool> = (0..count)
        .map(|c| volume[c] < 0.0 && (count == 1 || !inside_another(mesh, &owners, c as u32, witness[c])))
        .collect();
    for (i, &c) in owners.iter().enumerate() {
        if turn[c as usize] {
            mesh.triangles[i].swap(1, 2);
            report.flipped += 1;
        }
    }
}

/// Solid-angle winding number (van Oosterom and Strackee 1983) of the other pieces around `point`, in absolute value.
fn inside_another(mesh: &Mesh, owners: &[u32], own: u32, point: DVec3) -> bool {
    let mut winding: HashMap<u32, f64> = HashMap::new();
    for (i, &c) in owners.iter().enumerate() {
        if c == own {
            continue;
        }
        let [a, b, d] = mesh.corners(i).map(|p| p - point);
        let (la, lb, ld) = (a.length(), b.length(), d.length());
        let denominator = la * lb * ld + a.dot(b) * ld + b.dot(d) * la + d.dot(a) * lb;
        *winding.entry(c).or_default() += 2.0 * a.dot(b.cross(d)).atan2(denominator);
    }
    winding.values().any(|w| w.abs() > std::f64::consts::TAU)
}
