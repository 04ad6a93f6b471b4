//! Nodes of the grid: a regular lattice over the object's bounding box, and which of its nodes a march can look up.

use diaphane_formats::mesh::Mesh;
use diaphane_formats::visibility::Accel;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// A lattice.
pub(super) struct Lattice {
    /// Nodes along x, y, z, at least 2 each.
    pub size: [u32; 3],
    /// The first node.
    pub low: Vec3,
    /// Distance of neighbours along each axis.
    pub step: Vec3,
    /// Corners of the cells that the object touches, by number in the order [z][y][x], rising.
    pub listed: Vec<u32>,
}

impl Lattice {
    /// `side` nodes (at least 2) along the longest edge of the box around `mesh`.
    pub fn new(mesh: &Mesh, accel: &Accel, side: u32) -> Self {
        let (low, high) = mesh.bounds();
        let extent = (high - low).max(DVec3::splat(1e-6 * mesh.diagonal()));
        let step = extent.max_element() / f64::from(side.max(2) - 1);
        let size = (extent / step).round().to_array().map(|n| (n as u32 + 1).max(2));
        let step = extent / DVec3::from(size.map(|n| f64::from(n - 1)));
        let mut lattice = Self { size, low: low.as_vec3(), step: step.as_vec3(), listed: Vec::new() };
        let [nx, ny, nz] = size.map(|n| n as usize);
        let inside: Vec<bool> = (0..ny * nz)
            .into_par_iter()
            .flat_map_iter(|row| {
                let start = low + step * DVec3::new(-1.0, (row % ny) as f64, (row / ny) as f64);
                let mut crossings = Vec::new();
                accel.crossings(start, DVec3::X, f64::NEG_INFINITY, f64::INFINITY, &mut crossings);
                (1..=nx).map(move |i| {
                    let t = i as f64 * step.x;
                    crossings.iter().filter(|c| c.t > t).map(|c| c.sign).sum::<i32>() > 0
                })
            })
            .collect();
        // A cell matters if a corner is inside or the surface passes through it.
        let corners = |cell: [usize; 3]| {
            (0..8).map(move |k: usize| {
                let at = [0, 1, 2].map(|axis| cell[axis] + (k >> axis & 1));
                (at[2] * ny + at[1]) * nx + at[0]
            })
        };
        let cells = (nx - 1) * (ny - 1) * (nz - 1);
        let matter: Vec<bool> = (0..cells)
            .into_par_iter()
            .map(|i| {
                let cell = [i % (nx - 1), i / (nx - 1) % (ny - 1), i / ((nx - 1) * (ny - 1))];
                if corners(cell).any(|c| inside[c]) {
                    return true;
                }
                let a = low + step * DVec3::from(cell.map(|c| c as f64));
                let mut touched = false;
                accel.for_each_in_box(a, a + step, |t| {
                    // The box meets the triangle's plane too.
                    let normal = accel.normal(t as u32);
                    let off = normal.dot(a + 0.5 * step - mesh.corners(t)[0]);
                    touched |= off.abs() <= 0.5 * normal.abs().dot(step) * (1.0 + 1e-6);
                    !touched
                });
                touched
            })
            .collect();
        let mut needed = vec![false; nx * ny * nz];
        for i in (0..cells).filter(|i| matter[*i]) {
            let cell = [i % (nx - 1), i / (nx - 1) % (ny - 1), i / ((nx - 1) * (ny - 1))];
            corners(cell).for_each(|c| needed[c] = true);
        }
        lattice.listed = (0u32..).zip(&needed).filter(|(_, n)| **n).map(|(i, _)| i).collect();
        lattice
    }

    /// Nodes in all, listed or not.
    pub fn nodes(&self) -> u64 {
        self.size.iter().map(|n| u64::from(*n)).product()
    }
}
