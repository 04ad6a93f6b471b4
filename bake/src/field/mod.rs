//! The signed distance field of the mesh on a regular grid, and exact queries behind it.
//!
//! Depth is positive inside. Inside is decided by [`inside`]; the distance by closest-point queries on the box hierarchy. Outside nodes further than two cells from the surface are
//! not needed by anyone and are skipped.

mod inside;
mod overlap;

pub(crate) use inside::Inside;
pub(crate) use overlap::suited;

use crate::params::{Params, Visibility};
use crate::progress::Stage;
use crate::{Error, Result};
use diaphane_formats::mesh::{Mesh, MeshReport};
use diaphane_formats::visibility::Accel;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The mesh with what finds its surface.
pub(crate) struct Shape<'a> {
    pub mesh: &'a Mesh,
    pub accel: Accel,
    pub inside: Inside<'a>,
    pub diagonal: f64,
    /// Mean distance between samples if they filled the volume evenly.
    pub spacing: f64,
    /// How optical depths are found.
    pub visibility: Visibility,
}

/// Depth at the nodes of a regular grid.
#[derive(Serialize, Deserialize)]
pub(crate) struct DistanceGrid {
    pub size: [usize; 3],
    pub origin: DVec3,
    pub cell: f64,
    pub depth: Vec<f32>,
    /// Nodes that needed no distance query.
    pub skipped: usize,
}

impl DistanceGrid {
    pub fn index(&self, i: usize, j: usize, k: usize) -> usize {
        (k * self.size[1] + j) * self.size[0] + i
    }

    /// Depth at the node nearest to `p`, if it is inside.
    pub fn depth_near(&self, p: DVec3) -> Option<f64> {
        let s = ((p - self.origin) / self.cell).round();
        let inside = (0..3).all(|k| s[k] >= 0.0 && s[k] < self.size[k] as f64);
        let depth =
            inside.then(|| f64::from(self.depth[self.index(s.x as usize, s.y as usize, s.z as usize)]))?;
        (depth > 0.0).then_some(depth)
    }

    /// Whether `p` lies in the ball around the node nearest to it that no surface enters.
    pub fn certainly_inside(&self, p: DVec3) -> bool {
        // From the middle of a cell to its corner it is 0.87 cells; depths are rounded.
        self.depth_near(p).is_some_and(|depth| depth > 0.9 * self.cell)
    }

    pub fn node(&self, index: usize) -> DVec3 {
        let (i, rest) = (index % self.size[0], index / self.size[0]);
        let (j, k) = (rest % self.size[1], rest / self.size[1]);
        self.origin + DVec3::new(i as f64, j as f64, k as f64) * self.cell
    }
}

impl<'a> Shape<'a> {
    pub fn new(mesh: &'a Mesh, report: &MeshReport, params: &Params) -> Self {
        let spacing = (mesh.volume() / params.samples as f64).cbrt();
        let (accel, visibility) = (Accel::new(mesh), params.visibility);
        let inside = Inside::new(mesh, report);
        Self { mesh, accel, inside, diagonal: mesh.diagonal(), spacing, visibility }
    }
}

/// Cells of the grid along the longest edge of the box: fine enough for the samples, never so fine that the grid dominates
/// the bake.
pub(crate) fn grid_cells(mesh: &Mesh, samples: usize) -> f64 {
    let (low, high) = mesh.bounds();
    let spacing = (mesh.volume() / samples as f64).cbrt();
    ((high - low).max_element() / (0.6 * spacing)).clamp(24.0, MOST_CELLS)
}

/// Cells along the longest side at the most.
const MOST_CELLS: f64 = 80.0;

impl DistanceGrid {
    /// Whether one read from a cache can be one: its numbers fit together.
    pub fn fits(&self) -> bool {
        let sizes = self.size.iter().all(|n| (2..MOST_CELLS as usize + 8).contains(n));
        sizes
            && self.size.iter().product::<usize>() == self.depth.len()
            && self.origin.is_finite()
            && self.cell > 0.0
            && self.cell.is_finite()
            && self.depth.iter().all(|d| d.is_finite())
    }

    pub fn new(shape: &Shape<'_>, cells: f64, stage: Stage<'_>) -> Result<Self> {
        let Shape { mesh, accel, .. } = shape;
        let (low, high) = mesh.bounds();
        let extent = high - low;
        let cell = extent.max_element() / cells;
        let origin = low - 1.5 * cell;
        let size = [extent.x, extent.y, extent.z].map(|e| (e / cell).ceil() as usize + 4);
        let mut grid = Self { size, origin, cell, depth: Vec::new(), skipped: 0 };
        let count = size.iter().product::<usize>();
        stage.announce(count);
        let nodes: Vec<DVec3> = (0..count).map(|i| grid.node(i)).collect();
        let inside = shape.inside.test(&nodes)?;
        let skipped = std::sync::atomic::AtomicUsize::new(0);
        let band = 2.0 * cell;
        let chunk = 4096;
        let depth: Vec<Vec<f32>> = nodes
            .par_chunks(chunk)
            .zip(inside.par_chunks(chunk))
            .map(|(nodes, inside)| {
                // Depth changes by no more than the distance between nodes: the node before bounds the search.
                let mut before: Option<(DVec3, f64)> = None;
                let mut values = Vec::with_capacity(nodes.len());
                for (p, &inside) in nodes.iter().zip(inside) {
                    let reach = before.map_or(f64::INFINITY, |(q, d)| 1.000_001 * (d + p.distance(q)));
                    let found = accel.nearest(*p, if inside { reach } else { reach.min(band) });
                    before = found.map(|n| (*p, n.distance));
                    values.push(match found {
                        Some(n) if inside => n.distance as f32,
                        Some(n) => -n.distance as f32,
                        None => {
                            skipped.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                            -band as f32
                        }
                    });
                }
                stage.step(nodes.len())?;
                Ok(values)
            })
            .collect::<Result<_>>()?;
        grid.depth = depth.concat();
        if !grid.depth.iter().any(|d| *d > 0.0) && mesh.volume() <= 0.0 {
            return Err(Error::NoRoom("it has no inside".to_owned()));
        }
        grid.skipped = skipped.into_inner();
        Ok(grid)
    }
}
