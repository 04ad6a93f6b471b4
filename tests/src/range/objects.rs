//! The objects of the table.

use diaphane_assets::shapes::{Triangles, bird, cuboid, torus};
use diaphane_formats::Result;
use diaphane_formats::mesh::{Mesh, MeshReport};
use glam::DVec3;

/// One of the project's own meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Object {
    /// The bird on its plinth: thin and thick parts, overhangs.
    Bird,
    /// A ring around the y axis: light leaves and enters again.
    Torus,
    /// Flat faces and sharp edges.
    Cube,
}

/// An object's mesh with what the rows need to know about it.
pub struct Placed {
    /// Which one.
    pub object: Object,
    /// The mesh.
    pub mesh: Mesh,
    /// What was found in it.
    pub report: MeshReport,
    /// Middle of its bounding box.
    pub centre: DVec3,
    /// Diagonal of its bounding box, mesh units.
    pub diagonal: f64,
}

impl Object {
    /// File-like name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bird => "bird",
            Self::Torus => "torus",
            Self::Cube => "cube",
        }
    }

    /// A point well inside, in diagonals from the middle of the bounding box.
    pub fn inner_point(self) -> DVec3 {
        match self {
            Self::Bird => DVec3::new(0.02, 0.03, 0.0),
            Self::Torus => DVec3::new(0.0, 0.0, 0.24),
            Self::Cube => DVec3::new(-0.1, 0.05, 0.1),
        }
    }

    /// Makes the mesh.
    ///
    /// # Errors
    /// None for these shapes.
    pub fn place(self) -> Result<Placed> {
        let Triangles { positions, triangles } = match self {
            Self::Bird => bird(),
            Self::Torus => torus(0.7, 0.3, 64, 32),
            Self::Cube => cuboid([0.577_350_27; 3], 12),
        };
        let (mesh, report) = Mesh::from_triangles(positions, triangles)?;
        let (low, high) = mesh.bounds();
        let diagonal = mesh.diagonal();
        Ok(Placed { object: self, mesh, report, centre: 0.5 * (low + high), diagonal })
    }
}

impl Placed {
    /// World position of a point given in diagonals from the middle of the bounding box.
    pub fn at(&self, offset: DVec3) -> DVec3 {
        self.centre + offset * self.diagonal
    }

    /// The point at `gap` diagonals straight `towards` (unit) from the vertex that lies farthest that way: no point
    /// of the surface is nearer.
    pub fn beside(&self, towards: DVec3, gap: f64) -> DVec3 {
        let far = |p: &&DVec3| p.dot(towards);
        let farthest = self.mesh.positions.iter().max_by(|a, b| far(a).total_cmp(&far(b)));
        farthest.copied().unwrap_or(self.centre) + towards * (gap * self.diagonal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::visibility::Accel;

    const ALL: [Object; 3] = [Object::Bird, Object::Torus, Object::Cube];

    #[test]
    fn inner_points_are_inside_and_points_beside_keep_their_distance() {
        for object in ALL {
            let placed = object.place().unwrap();
            assert!(placed.report.warnings().is_empty(), "{object:?}");
            let accel = Accel::new(&placed.mesh);
            let mut crossings = Vec::new();
            let inner = placed.at(object.inner_point());
            accel.crossings(inner, DVec3::new(0.36, 0.48, 0.8), 0.0, f64::INFINITY, &mut crossings);
            assert_eq!(crossings.iter().map(|c| c.sign).sum::<i32>(), 1, "{object:?}");
            assert!(accel.nearest(inner, 0.03 * placed.diagonal).is_none(), "{object:?}");
            let gap = 0.05;
            let beside = placed.beside(DVec3::new(0.6, 0.64, 0.48), gap);
            assert!(accel.nearest(beside, 0.99 * gap * placed.diagonal).is_none(), "{object:?}");
            assert!(accel.nearest(beside, 1.01 * gap * placed.diagonal).is_some(), "{object:?}");
        }
    }
}
