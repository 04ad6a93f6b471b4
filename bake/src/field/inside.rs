//! Which points are inside.
//!
//! A mesh that came clean is closed and oriented: the winding numbers along three lines are whole numbers, found for many
//! points at once by projecting the mesh, and the majority decides. In one that had to be mended surfaces may touch, cross
//! or coincide, where single lines slip through: there the generalized winding number decides, which is a mean over all
//! directions and so does not depend on any of them.

use crate::Result;
use crate::report::Tested;
use diaphane_formats::directions::even_directions;
use diaphane_formats::medium::{Density, Medium};
use diaphane_formats::mesh::{Mesh, MeshReport, Winding};
use diaphane_formats::phase::Phase;
use diaphane_formats::visibility::project;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The inside of a mesh.
pub(crate) struct Inside<'a> {
    mesh: &'a Mesh,
    /// Of a mesh that had to be mended.
    winding: Option<Winding>,
    tested: AtomicUsize,
}

impl<'a> Inside<'a> {
    pub fn new(mesh: &'a Mesh, report: &MeshReport) -> Self {
        let corners = || (0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect();
        let winding = report.is_mended().then(|| Winding::new(corners()));
        Self { mesh, winding, tested: AtomicUsize::new(0) }
    }

    /// Whether each point is inside.
    pub fn test(&self, points: &[DVec3]) -> Result<Vec<bool>> {
        self.tested.fetch_add(points.len(), Ordering::Relaxed);
        match &self.winding {
            Some(winding) => Ok(points.par_iter().map(|p| winding.at(*p) > 0.5).collect()),
            None => by_majority(self.mesh, points),
        }
    }

    /// What was tested so far.
    pub fn tested(&self) -> Tested {
        let count = self.tested.load(Ordering::Relaxed);
        match self.winding {
            Some(_) => Tested { by_winding_number: count, ..Tested::default() },
            None => Tested { by_majority: count, ..Tested::default() },
        }
    }
}

/// Points of one task of [`by_majority`], at the least.
const VOTING: usize = 1 << 15;

/// Majority vote over three lines through each node, each seen from both ends. The third is looked along only where the
/// first two leave it open.
fn by_majority(mesh: &Mesh, nodes: &[DVec3]) -> Result<Vec<bool>> {
    let unit = Medium::new(DVec3::ONE, DVec3::ZERO, Phase::Isotropic, 1.0, Density::Uniform(1.0))?;
    let axes = even_directions(6, 0x5eed);
    let vote = |nodes: &[DVec3], axis: usize, votes: &mut dyn FnMut(usize)| {
        let sides = project(mesh, &unit, nodes, axes[2 * axis]).winding;
        sides.iter().for_each(|w| w.iter().enumerate().filter(|(_, w)| **w > 0).for_each(|(i, _)| votes(i)));
    };
    // Every task goes through all triangles.
    let together = VOTING.max(mesh.triangles.len() / 4);
    let votes: Vec<Vec<u8>> = nodes
        .par_chunks(together)
        .map(|nodes| {
            let mut votes = vec![0u8; nodes.len()];
            (0..2).for_each(|axis| vote(nodes, axis, &mut |i| votes[i] += 1));
            let open: Vec<usize> = (0..nodes.len()).filter(|i| matches!(votes[*i], 2 | 3)).collect();
            let places: Vec<DVec3> = open.iter().map(|i| nodes[*i]).collect();
            if !places.is_empty() {
                vote(&places, 2, &mut |k| votes[open[k]] += 1);
            }
            votes
        })
        .collect();
    Ok(votes.concat().into_iter().map(|votes| votes > 3).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_agree() {
        // A ball from whose surface a face is missing, closed again.
        let raw = diaphane_assets::shapes::icosphere(1.0, 3);
        let (mesh, report) = Mesh::from_triangles(raw.positions, raw.triangles[1..].to_vec()).unwrap();
        assert!(report.is_mended());
        let points: Vec<DVec3> = (0..4096)
            .map(|i| DVec3::new((i % 16) as f64, (i / 16 % 16) as f64, (i / 256) as f64) / 7.3 - 1.03)
            .collect();
        let mended = Inside::new(&mesh, &report);
        let clean = Inside::new(&mesh, &MeshReport::default());
        assert_eq!(mended.test(&points).unwrap(), clean.test(&points).unwrap());
        assert_eq!(mended.tested(), Tested { by_majority: 0, by_winding_number: 4096 });
        assert_eq!(clean.tested(), Tested { by_majority: 4096, by_winding_number: 0 });
    }
}
