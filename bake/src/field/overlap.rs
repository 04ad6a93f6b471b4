//! Whether shells of the mesh overlap, so that signed sums of crossings would count the medium twice.

use crate::Input;
use crate::params::{Params, Visibility};
use diaphane_formats::mesh::{Mesh, Winding};
use glam::DVec3;
use rayon::prelude::*;

/// Places along each edge of the box that are looked at.
const PLACES: usize = 32;

/// Share of the inside that may count twice before it matters to the depths.
const NEGLIGIBLE: f64 = 1e-3;

/// Share of the inside where the winding number is above 1, on a lattice of places in the box.
fn doubled(mesh: &Mesh) -> f64 {
    let winding = Winding::new((0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect());
    let (low, high) = mesh.bounds();
    let [inside, doubled] = (0..PLACES.pow(3))
        .into_par_iter()
        .map(|i| {
            let place =
                DVec3::new((i % PLACES) as f64, (i / PLACES % PLACES) as f64, (i / PLACES.pow(2)) as f64);
            let w = winding.at(low + (high - low) * (place + 0.5) / PLACES as f64);
            [usize::from(w > 0.5), usize::from(w > 1.5)]
        })
        .reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    doubled as f64 / inside.max(1) as f64
}

/// The parameters, with depths traced where shells overlap: only tracing counts the medium once there. Meshes in which
/// nothing crosses, overlaps or has common edges are not looked at.
pub(crate) fn suited(input: &Input<'_>, params: &Params) -> Params {
    let mut params = params.clone();
    let report = input.mesh_report;
    let suspects = report.self_intersections + report.mending.overlapping + report.non_manifold_edges;
    if suspects > 0 && doubled(input.mesh) > NEGLIGIBLE {
        params.visibility = Visibility::Trace;
    }
    params
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(list: &[(f64, f64)]) -> Mesh {
        let mut mesh = Mesh { positions: Vec::new(), triangles: Vec::new() };
        for (low, high) in list {
            let base = mesh.positions.len() as u32;
            let pick = |k: u32, bit: u32| if k >> bit & 1 == 0 { *low } else { *high };
            mesh.positions.extend((0..8).map(|k| DVec3::new(pick(k, 0), pick(k, 1), pick(k, 2))));
            for [a, b, c, d] in
                [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
            {
                mesh.triangles.extend([[a, b, c], [a, c, d]].map(|t: [u32; 3]| t.map(|i| i + base)));
            }
        }
        mesh
    }

    #[test]
    fn the_doubled_share_of_two_cubes() {
        // Unit cubes that share an eighth of each: 1/8 of 15/8. A place is 1/64 of the box's edge from its cell's faces.
        let share = doubled(&boxes(&[(0.0, 1.0), (0.5, 1.5)]));
        assert!((share - 1.0 / 15.0).abs() < 0.015, "{share}");
        assert_eq!(doubled(&boxes(&[(0.0, 1.0)])), 0.0);
        assert_eq!(doubled(&boxes(&[(0.0, 1.0), (1.0, 2.0)])), 0.0);
    }
}
