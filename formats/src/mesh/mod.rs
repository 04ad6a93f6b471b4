//! Triangle meshes: reading OBJ, repairing what can be repaired, and saying what was found.

mod close;
mod fill;
mod islands;
mod load;
mod loops;
mod pieces;
mod repair;
mod report;
mod seams;
mod self_intersection;
mod sheets;
mod shells;
mod weld;
mod winding;

pub use load::{load_obj, parse_obj};
pub use report::{Mending, MeshReport};
pub use winding::Winding;

use crate::{Error, Result};
use glam::DVec3;

/// A closed, consistently oriented triangle mesh in mesh units: every directed edge is matched by its opposite, so
/// that signed crossing sums along any line are well defined. Normals point outwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<DVec3>,
    /// Counter-clockwise vertex indices, seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Welds, cleans, closes and orients raw triangles; see [`MeshReport`] for what is counted.
    ///
    /// # Errors
    /// Non-finite vertices, indices out of range, nothing left, no enclosed volume.
    pub fn from_triangles(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<(Self, MeshReport)> {
        repair::repair(positions, triangles)
    }

    /// A mesh that is known to be closed and oriented, as read back from an asset.
    ///
    /// # Errors
    /// Non-finite vertices or indices out of range.
    pub fn from_trusted(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self> {
        let count = positions.len();
        if positions.iter().any(|p| !p.is_finite()) {
            return Err(Error::invalid("the mesh has a vertex that is not finite"));
        }
        if triangles.iter().flatten().any(|&i| i as usize >= count) {
            return Err(Error::invalid("the mesh has a triangle that names a missing vertex"));
        }
        if triangles.is_empty() {
            return Err(Error::invalid("the mesh has no triangles"));
        }
        Ok(Self { positions, triangles })
    }

    /// A hash (BLAKE3) of all vertices and triangles.
    pub fn content_hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        for p in &self.positions {
            p.to_array().iter().for_each(|c| _ = hasher.update(&c.to_le_bytes()));
        }
        hasher.update(bytemuck::cast_slice(&self.triangles));
        *hasher.finalize().as_bytes()
    }

    /// The corners of triangle `i`.
    pub fn corners(&self, i: usize) -> [DVec3; 3] {
        self.triangles[i].map(|v| self.positions[v as usize])
    }

    /// Twice the area times the outward normal of triangle `i`.
    pub fn area_normal(&self, i: usize) -> DVec3 {
        let [a, b, c] = self.corners(i);
        (b - a).cross(c - a)
    }

    /// Smallest and largest corner of the bounding box.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let first = self.positions.first().copied().unwrap_or_default();
        self.positions.iter().fold((first, first), |(low, high), p| (low.min(*p), high.max(*p)))
    }

    /// Middle of the bounding box.
    pub fn centre(&self) -> DVec3 {
        let (low, high) = self.bounds();
        0.5 * (low + high)
    }

    /// Length of the bounding box's diagonal.
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.bounds();
        (high - low).length()
    }

    /// Enclosed volume, positive for outward normals (divergence theorem).
    pub fn volume(&self) -> f64 {
        let (low, high) = self.bounds();
        let centre = 0.5 * (low + high);
        (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i);
                (a - centre).dot((b - centre).cross(c - centre)) / 6.0
            })
            .sum()
    }

    /// Total surface area.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|i| 0.5 * self.area_normal(i).length()).sum()
    }
}
