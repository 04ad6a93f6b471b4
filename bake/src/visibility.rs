//! Depths of many points along a direction and its opposite, by the method that the bake was asked for.

use crate::Prepared;
use crate::field::Shape;
use crate::params::Visibility;
use diaphane_formats::visibility::{DepthRows, project_with, trace};
use glam::DVec3;

/// Triangles that are projected in the time in which one point is traced both ways (measured: both methods take as long
/// for 350 points in a mesh of 30,000 triangles, 2,500 in 500,000, 8,000 in 2,000,000; `diaphane-validate bake-speed
/// --ball 500000 --points 2500 --no-bakes`).
const TRIANGLES_PER_POINT: usize = 120;

/// The method for so many points and triangles: projecting costs a fixed time for every triangle, however few points it
/// could cover.
pub(crate) fn chosen(asked: Visibility, points: usize, triangles: usize) -> Visibility {
    match asked {
        Visibility::Auto if triangles > TRIANGLES_PER_POINT * points => Visibility::Trace,
        Visibility::Auto => Visibility::Project,
        asked => asked,
    }
}

/// Depths of `points` along `axis` and its opposite.
pub(crate) fn depths(
    shape: &Shape<'_>,
    medium: &Prepared<'_>,
    asked: Visibility,
    points: &[DVec3],
    axis: DVec3,
) -> DepthRows {
    match chosen(asked, points.len(), shape.mesh.triangles.len()) {
        Visibility::Trace => trace(&shape.accel, medium.medium, medium.for_rays(), points, axis),
        _ => project_with(shape.mesh, medium.medium, medium.for_rays(), points, axis),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_points_in_a_large_mesh_are_traced() {
        assert_eq!(chosen(Visibility::Auto, 50_000, 30_000), Visibility::Project);
        assert_eq!(chosen(Visibility::Auto, 1_000, 2_000_000), Visibility::Trace);
        assert_eq!(chosen(Visibility::Project, 1, 2_000_000), Visibility::Project);
    }
}
