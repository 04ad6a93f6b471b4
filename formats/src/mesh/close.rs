//! Closing holes.
//!
//! The directed edges of a shell that lack their opposite always form closed loops, because the boundary of a set of
//! triangles has no boundary itself. Each loop is closed with a fan.

use super::MeshReport;
use super::pieces::edges;
use glam::DVec3;
use std::collections::HashMap;

/// Closes every loop of unmatched directed edges of a shell with a fan around its centroid.
pub(super) fn close(positions: &mut Vec<DVec3>, shell: &mut Vec<[u32; 3]>, report: &mut MeshReport) {
    let mut balance: HashMap<(u32, u32), i32> = HashMap::with_capacity(shell.len() * 2);
    for (a, b) in shell.iter().flat_map(|t| edges(*t)) {
        *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
    }
    // An edge used once too often as (a,b) needs a patch that runs (b,a).
    let mut missing: Vec<(u32, u32)> = Vec::new();
    for (&(a, b), &n) in &balance {
        let edge = if n > 0 { (b, a) } else { (a, b) };
        missing.extend(std::iter::repeat_n(edge, n.unsigned_abs() as usize));
    }
    missing.sort_unstable();
    report.open_edges += missing.len();
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
                fill(positions, shell, &ring);
                report.holes += 1;
            }
            path.push(at);
        }
    }
}

fn fill(positions: &mut Vec<DVec3>, shell: &mut Vec<[u32; 3]>, ring: &[u32]) {
    if let [a, b, c] = *ring {
        shell.push([a, b, c]);
        return;
    }
    if ring.len() < 3 {
        return;
    }
    let centre = ring.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / ring.len() as f64;
    let hub = positions.len() as u32;
    positions.push(centre);
    for (i, &a) in ring.iter().enumerate() {
        shell.push([a, ring[(i + 1) % ring.len()], hub]);
    }
}
