//! Nodes of a regular lattice over an object's bounding box, and which of them are inside.

use super::object::Object;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::VecDeque;

/// Distance of the outermost nodes from the box, in diagonals.
const INSET: f64 = 1e-3;

/// Nodes of a lattice and which of them are inside.
pub struct Lattice {
    /// Nodes along x, y, z.
    pub size: [usize; 3],
    /// First node, world space.
    pub low: DVec3,
    /// Distance of neighbours along each axis.
    pub step: DVec3,
    /// In the order of [z][y][x].
    inside: Vec<bool>,
}

impl Lattice {
    /// About `side` nodes along the longest edge.
    fn new(object: &Object<'_>, side: f64) -> Self {
        let (low, high) = object.mesh.bounds();
        let inset = INSET * object.mesh.diagonal();
        let (low, extent) = (low + inset, (high - low - 2.0 * inset).max(DVec3::splat(inset)));
        let step = extent.max_element() / (side - 1.0).max(1.0);
        let size = (extent / step).round().to_array().map(|n| n as usize + 1);
        let step = extent / DVec3::from(size.map(|n| (n.max(2) - 1) as f64));
        let mut lattice = Self { size, low, step, inside: Vec::new() };
        lattice.inside = (0..size[1] * size[2])
            .into_par_iter()
            .flat_map_iter(|row| lattice.row(object, row % size[1], row / size[1]))
            .collect();
        lattice
    }

    /// The finest lattice with at most `nodes` nodes inside; the coarsest with any where there is none.
    pub fn finest(object: &Object<'_>, nodes: usize) -> Option<Self> {
        let mut best: Option<Self> = None;
        // The number grows with the side's cube, though not evenly: bisection, then what was found to fit.
        let (mut low, mut high) = (2.0f64, 4.0 * (nodes as f64).cbrt() + 8.0);
        for _ in 0..18 {
            let side = 0.5 * (low + high);
            let lattice = Self::new(object, side);
            let count = lattice.count();
            if count <= nodes {
                low = side;
            } else {
                high = side;
            }
            let better = match best.as_ref().map(Self::count) {
                None | Some(0) => true,
                Some(known) if known > nodes => count > 0 && count < known,
                Some(known) => count <= nodes && count > known,
            };
            if better {
                best = Some(lattice);
            }
        }
        best.filter(|l| l.count() > 0)
    }

    /// The nodes inside, world space, in their order.
    pub fn places(&self) -> Vec<DVec3> {
        let [nx, ny, _] = self.size;
        let inside = (0..self.inside.len()).filter(|&i| self.inside[i]);
        inside.map(|i| self.place([i % nx, i / nx % ny, i / (nx * ny)])).collect()
    }

    fn place(&self, [i, j, k]: [usize; 3]) -> DVec3 {
        self.low + self.step * DVec3::new(i as f64, j as f64, k as f64)
    }

    /// Whether the nodes of one row along x are inside, by the crossings of a single ray.
    fn row(&self, object: &Object<'_>, j: usize, k: usize) -> Vec<bool> {
        let mut crossings = Vec::new();
        let start = self.place([0, j, k]) - object.centre - DVec3::X * self.step.x;
        object.accel.crossings(start, DVec3::X, f64::NEG_INFINITY, f64::INFINITY, &mut crossings);
        let winding = |t: f64| crossings.iter().filter(|c| c.t > t).map(|c| c.sign).sum::<i32>();
        (0..self.size[0]).map(|i| winding((i + 1) as f64 * self.step.x) > 0).collect()
    }

    fn count(&self) -> usize {
        self.inside.iter().filter(|i| **i).count()
    }

    /// For every node the number (among the nodes inside) of the nearest one inside, breadth first.
    pub fn serves(&self) -> Vec<u32> {
        let [nx, ny, nz] = self.size;
        let mut serves = vec![u32::MAX; self.inside.len()];
        let mut queue: VecDeque<usize> = (0..serves.len()).filter(|&i| self.inside[i]).collect();
        for (number, &i) in queue.iter().enumerate() {
            serves[i] = number as u32;
        }
        while let Some(i) = queue.pop_front() {
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)];
            let steps = [
                (x > 0, i.wrapping_sub(1)),
                (x + 1 < nx, i + 1),
                (y > 0, i.wrapping_sub(nx)),
                (y + 1 < ny, i + nx),
                (z > 0, i.wrapping_sub(nx * ny)),
                (z + 1 < nz, i + nx * ny),
            ];
            for (_, next) in steps.into_iter().filter(|(exists, _)| *exists) {
                if serves[next] == u32::MAX {
                    serves[next] = serves[i];
                    queue.push_back(next);
                }
            }
        }
        serves
    }
}
