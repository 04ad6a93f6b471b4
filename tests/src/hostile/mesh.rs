//! Meshes.

use super::{Use, words};
use diaphane_formats::mesh::parse_obj;
use diaphane_formats::visibility::{Accel, inside_pieces};
use glam::DVec3;
use std::collections::HashMap;

/// An OBJ file, mended.
pub(super) fn obj(bytes: &[u8]) -> Result<Use, String> {
    let (mesh, report) = parse_obj(bytes).map_err(words)?;
    Ok(Box::new(move || {
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (report.vertices, report.triangles));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        // Closed: each edge is passed as often one way as the other.
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        for [a, b, c] in &mesh.triangles {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                *edges.entry([*from.min(to), *from.max(to)]).or_default() += if from < to { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|sum| *sum == 0), "the mesh is open");
        assert!(mesh.volume().is_finite() && mesh.area().is_finite());
        report.warnings();
        let accel = Accel::new(&mesh);
        let (mut crossings, mut pieces) = (Vec::new(), Vec::new());
        for at in [mesh.centre(), mesh.bounds().0] {
            let direction = DVec3::new(0.36, 0.48, 0.8);
            inside_pieces(&accel, 1.3, at, direction, &mut crossings, &mut pieces);
            assert!(pieces.iter().all(|p| p.start <= p.end && p.end.is_finite()));
            accel.nearest(at, f64::INFINITY);
        }
    }))
}
