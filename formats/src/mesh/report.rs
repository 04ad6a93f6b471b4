//! What was found and mended in a mesh.

use serde::{Deserialize, Serialize};

/// Counts of everything that was noticed while a mesh was made usable.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshReport {
    /// Vertices and triangles of the result.
    pub vertices: usize,
    /// Triangles of the result.
    pub triangles: usize,
    /// Objects or groups that were merged.
    pub objects: usize,
    /// Vertices that coincided with another and were welded to it.
    pub welded: usize,
    /// Triangles without area, dropped.
    pub degenerate: usize,
    /// Triangles present more than once, dropped.
    pub duplicate: usize,
    /// Triangles whose winding was turned round.
    pub flipped: usize,
    /// Edges shared by more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges without a partner.
    pub open_edges: usize,
    /// Holes that were closed with a fan of triangles.
    pub holes: usize,
    /// Connected pieces.
    pub components: usize,
    /// Pairs of triangles that cross each other.
    pub self_intersections: usize,
    /// The file named materials, normals or texture coordinates, which are not used.
    pub ignored_attributes: bool,
}

impl MeshReport {
    /// One plain sentence for each thing that a user should know; empty for a clean mesh.
    pub fn warnings(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let mut say = |count: usize, text: &str| {
            if count > 0 {
                lines.push(format!("{count} {text}"));
            }
        };
        say(self.degenerate, "triangles without area were dropped");
        say(self.duplicate, "duplicate triangles were dropped");
        say(self.flipped, "triangles were turned round to make the winding consistent");
        say(self.non_manifold_edges, "edges are shared by more than two triangles");
        if self.holes > 0 {
            lines
                .push(format!("{} holes ({} open edges) were closed with fans", self.holes, self.open_edges));
        }
        if self.self_intersections > 0 {
            lines.push(format!(
                "{} pairs of triangles cross each other; where shells overlap the medium counts twice",
                self.self_intersections
            ));
        }
        if self.objects > 1 {
            lines.push(format!("{} objects were merged into one", self.objects));
        }
        if self.ignored_attributes {
            lines.push("materials, normals and texture coordinates of the mesh file are not used".to_owned());
        }
        lines
    }
}
