//! Closed triangle meshes made by code. Each is deterministic, consistently oriented and manifold.

mod bird;
mod cuboid;
mod isosurface;
mod round;

pub use bird::bird;
pub use cuboid::{cuboid, rounded_cuboid};
pub use isosurface::isosurface;
pub use round::{icosphere, torus};

use diaphane_formats::Result;
use diaphane_formats::mesh::Mesh;
use glam::DVec3;
use std::fmt::Write;

/// Raw triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Vertices.
    pub positions: Vec<DVec3>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

impl Triangles {
    /// As a Wavefront OBJ file. Coordinates keep the precision of 32-bit floats, which is what readers use.
    pub fn to_obj(&self) -> String {
        let mut text = String::with_capacity(60 * self.positions.len());
        // Writing to a String cannot fail.
        for p in self.positions.iter().map(|p| p.as_vec3()) {
            let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
        }
        for t in self.triangles.iter().map(|t| t.map(|i| i + 1)) {
            let _ = writeln!(text, "f {} {} {}", t[0], t[1], t[2]);
        }
        text
    }

    /// As a mesh, in full precision.
    ///
    /// # Errors
    /// None for the shapes of this module.
    pub fn to_mesh(&self) -> Result<Mesh> {
        Ok(Mesh::from_triangles(self.positions.clone(), self.triangles.clone())?.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume by the divergence theorem; panics unless every directed edge has exactly one opposite.
    pub(super) fn checked_volume(t: &Triangles) -> f64 {
        let mut edges = std::collections::HashSet::new();
        for [a, b, c] in &t.triangles {
            for edge in [(*a, *b), (*b, *c), (*c, *a)] {
                assert!(edges.insert(edge), "edge {edge:?} is used twice in one direction");
            }
        }
        assert!(edges.iter().all(|(a, b)| edges.contains(&(*b, *a))), "the surface has a hole");
        t.triangles
            .iter()
            .map(|i| {
                let [a, b, c] = i.map(|k| t.positions[k as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    #[test]
    fn volumes() {
        use std::f64::consts::PI;
        assert!((checked_volume(&icosphere(1.0, 5)) / (4.0 / 3.0 * PI) - 1.0).abs() < 2e-3);
        assert!((checked_volume(&torus(0.7, 0.3, 96, 48)) / (2.0 * PI * PI * 0.7 * 0.09) - 1.0).abs() < 5e-3);
        assert!((checked_volume(&cuboid([0.5, 1.0, 0.25], 5)) - 1.0).abs() < 1e-12);
        // Box, three pairs of slabs, edges that make three cylinders, and a ball.
        let (a, b, c, r) = (1.2, 0.8, 0.8, 0.1);
        let exact = a * b * c
            + 2.0 * r * (a * b + b * c + c * a)
            + PI * r * r * (a + b + c)
            + 4.0 / 3.0 * PI * r * r * r;
        let rounded = rounded_cuboid([0.7, 0.5, 0.5], 0.1, 8);
        assert!((checked_volume(&rounded) / exact - 1.0).abs() < 2e-3);
    }

    #[test]
    fn an_isosurface_of_a_ball_is_the_ball() {
        let ball = isosurface(DVec3::splat(-1.1), DVec3::splat(1.1), 24, |p| p.length() - 1.0);
        assert!(ball.positions.iter().all(|p| (p.length() - 1.0).abs() < 1e-4));
        assert!((checked_volume(&ball) / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 1e-2);
    }

    #[test]
    fn the_bird_is_closed() {
        let volume = checked_volume(&bird());
        assert!((0.2..1.0).contains(&volume), "{volume}");
    }

    #[test]
    fn obj_text_keeps_single_precision() {
        let t = icosphere(0.3, 2);
        let mesh = diaphane_formats::mesh::parse_obj(t.to_obj().as_bytes()).unwrap().0;
        assert_eq!(mesh.triangles.len(), t.triangles.len());
        let single: Vec<_> = t.positions.iter().map(|p| p.as_vec3().as_dvec3()).collect();
        assert!(mesh.positions.iter().all(|p| single.contains(p)));
    }
}
