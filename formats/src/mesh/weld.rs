//! Welding vertices and dropping triangles that say nothing.

use super::MeshReport;
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Merges vertices with identical coordinates (-0 counts as 0) and drops those that no face uses.
pub(super) fn weld(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    report: &mut MeshReport,
) -> (Vec<DVec3>, Vec<[u32; 3]>) {
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

/// Drops triangles without area and those present already, whichever way round.
pub(super) fn clean(positions: &[DVec3], triangles: Vec<[u32; 3]>, report: &mut MeshReport) -> Vec<[u32; 3]> {
    let mut seen = HashSet::with_capacity(triangles.len());
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

/// Drops vertices that no triangle uses; the order of the others stays.
pub(super) fn compact(positions: &mut Vec<DVec3>, triangles: &mut [[u32; 3]]) {
    let mut index = vec![u32::MAX; positions.len()];
    triangles.iter().flatten().for_each(|v| index[*v as usize] = 0);
    let mut next = 0;
    for slot in index.iter_mut().filter(|slot| **slot == 0) {
        *slot = next;
        next += 1;
    }
    if next as usize == positions.len() {
        return;
    }
    let mut old = 0;
    positions.retain(|_| {
        old += 1;
        index[old - 1] != u32::MAX
    });
    triangles.iter_mut().flatten().for_each(|v| *v = index[*v as usize]);
}
