//! A closed mesh with as many triangles as wanted.

use diaphane_formats::mesh::Mesh;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A bumpy ball of about `triangles` triangles (at least 12): rows of equal polar angle, twice as many columns.
///
/// # Errors
/// None that its closed surface could cause.
pub fn bumpy_ball(triangles: usize) -> diaphane_formats::Result<Mesh> {
    let rows = ((triangles as f64 / 4.0).sqrt().round() as usize).max(3);
    let columns = 2 * rows;
    let at = |row: usize, column: usize| {
        let (polar, turn) = (PI * row as f64 / rows as f64, TAU * column as f64 / columns as f64);
        let bumps = 0.15 * (5.0 * turn).sin() * polar.sin().powi(3) * (4.0 * polar).cos();
        let radius = 1.0 + bumps + 0.1 * (7.0 * polar).cos();
        radius * DVec3::new(polar.sin() * turn.cos(), polar.cos(), polar.sin() * turn.sin())
    };
    let mut positions = vec![at(0, 0), at(rows, 0)];
    positions.extend((1..rows).flat_map(|row| (0..columns).map(move |column| at(row, column))));
    let index = |row: usize, column: usize| match row {
        0 => 0,
        row if row == rows => 1,
        row => (2 + (row - 1) * columns + column % columns) as u32,
    };
    let mut faces = Vec::with_capacity(2 * rows * columns);
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [index(row, column), index(row, column + 1)];
            let [c, d] = [index(row + 1, column), index(row + 1, column + 1)];
            if row > 0 {
                faces.push([a, b, d]);
            }
            if row + 1 < rows {
                faces.push([a, d, c]);
            }
        }
    }
    Mesh::from_trusted(positions, faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_closed_and_as_large_as_asked() {
        for wanted in [12, 1_000, 20_000] {
            let mesh = bumpy_ball(wanted).unwrap();
            let count = mesh.triangles.len() as f64;
            assert!(wanted < 100 || (count / wanted as f64 - 1.0).abs() < 0.1, "{count} of {wanted}");
            let (mended, report) =
                Mesh::from_triangles(mesh.positions.clone(), mesh.triangles.clone()).unwrap();
            assert!(report.warnings().is_empty(), "{:?}", report.warnings());
            assert!(
                (mended.volume() - mesh.volume()).abs() < 1e-9 && mesh.volume() > 0.5,
                "{}",
                mesh.volume()
            );
        }
    }
}
