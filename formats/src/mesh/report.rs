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
    /// Holes that were closed.
    pub holes: usize,
    /// Connected pieces.
    pub components: usize,
    /// Pairs of triangles that cross each other.
    pub self_intersections: usize,
    /// The file named materials, normals or texture coordinates, which are not used.
    pub ignored_attributes: bool,
    /// Rarer repairs, which an asset tells of in a section of its own.
    #[serde(skip)]
    pub mending: Mending,
}

/// Counts of the repairs that decide what is inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mending {
    /// Vertices of open edges that were merged with another a hair away.
    pub stitched: usize,
    /// Open edges that were split where a vertex of another lies on them.
    pub split: usize,
    /// Open sheets, dropped.
    pub sheets: usize,
    /// One-sided surfaces (such as a Möbius band), dropped.
    pub one_sided: usize,
    /// Shells inside others that bound no cavity, dropped.
    pub nested: usize,
    /// Pairs of shells that overlap, neither within the other.
    pub overlapping: usize,
}

impl Mending {
    /// All counts, in the order of the fields.
    pub fn counts(&self) -> [u64; 6] {
        [self.stitched, self.split, self.sheets, self.one_sided, self.nested, self.overlapping]
            .map(|n| n as u64)
    }

    /// From [`Mending::counts`].
    pub fn from_counts(counts: [u64; 6]) -> Self {
        let [stitched, split, sheets, one_sided, nested, overlapping] =
            counts.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        Self { stitched, split, sheets, one_sided, nested, overlapping }
    }
}

impl MeshReport {
    /// Whether faces were added, dropped or turned, or cross each other: what was read was not a clean boundary.
    pub fn is_mended(&self) -> bool {
        let counts = [
            self.degenerate,
            self.duplicate,
            self.flipped,
            self.non_manifold_edges,
            self.open_edges,
            self.self_intersections,
        ];
        counts.iter().any(|n| *n > 0) || self.mending != Mending::default()
    }

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
        say(self.mending.stitched, "vertices of open edges were merged with one a hair away");
        say(self.mending.split, "open edges were split at vertices that lie on them");
        say(self.mending.sheets, "open sheets, which have no inside, were dropped");
        say(self.mending.one_sided, "one-sided surfaces, which have no inside, were dropped");
        say(self.mending.nested, "shells inside others, which bound no cavity, were dropped");
        say(self.mending.overlapping, "pairs of shells overlap; the medium counts once there");
        say(
            self.self_intersections,
            "pairs of triangles cross each other; where shells overlap the medium counts once",
        );
        if self.holes > 0 {
            lines.push(format!("{} holes ({} open edges) were closed", self.holes, self.open_edges));
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
