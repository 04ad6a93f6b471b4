//! The rays of the measurement: small pictures of the object from directions all around.

use crate::Result;
use crate::field::Shape;
use crate::progress::Stage;
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::visibility::{InsidePiece, inside_pieces};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Parallel rays from one direction.
pub(crate) struct View {
    /// The way the rays go, unit length.
    pub direction: DVec3,
    /// Those that meet the object: evenly over its silhouette.
    pub rays: Vec<Ray>,
}

/// A ray that meets the object.
pub(crate) struct Ray {
    /// In front of the object, world coordinates.
    pub origin: DVec3,
    /// Its inside pieces, in order.
    pub pieces: Vec<InsidePiece>,
}

/// Cells along each side of the first grid of rays over a view.
const SIDE: usize = 12;
/// Cells along each side of the finest grid, for objects that fill little of their box.
const MOST_SIDE: usize = 96;
/// Rays that a view should have.
const WANTED: usize = 64;
/// Pixels across the view. Metrics of pictures count pixels that the object covers fully.
const PIXELS: f64 = 200.0;

/// `count` views (even) of the object, seeded; those that miss it have no rays.
pub(crate) fn views(
    shape: &Shape<'_>,
    ior: f64,
    count: usize,
    seed: u64,
    stage: Stage<'_>,
) -> Result<Vec<View>> {
    let view = |(k, direction): (usize, DVec3)| {
        stage.step(1)?;
        Ok(View { direction, rays: rays(shape, ior, direction, hash(seed, k as u64)) })
    };
    even_directions(count, seed).into_par_iter().enumerate().map(view).collect()
}

/// One ray at a random place in each cell of a grid over the object's projection; finer where too few meet it.
fn rays(shape: &Shape<'_>, ior: f64, direction: DVec3, seed: u64) -> Vec<Ray> {
    let (u, v) = direction.any_orthonormal_pair();
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    for p in &shape.mesh.positions {
        let q = DVec3::new(p.dot(u), p.dot(v), p.dot(direction));
        low = low.min(q);
        high = high.max(q);
    }
    let front = low.z - 0.1 * shape.diagonal;
    let extent = high - low;
    let half_pixel = 0.5 * extent.x.max(extent.y) / PIXELS;
    let (mut crossings, mut pieces) = (Vec::new(), Vec::new());
    let mut trace = |x: f64, y: f64| {
        let origin = u * x + v * y + direction * front;
        inside_pieces(&shape.accel, ior, origin, direction, &mut crossings, &mut pieces);
        Ray { origin, pieces: pieces.clone() }
    };
    let mut side = SIDE;
    loop {
        let mut rng = Pcg64Mcg::seed_from_u64(hash(seed, side as u64));
        let mut found = Vec::new();
        for cell in 0..side * side {
            let x = low.x + extent.x * ((cell % side) as f64 + rng.random::<f64>()) / side as f64;
            let y = low.y + extent.y * ((cell / side) as f64 + rng.random::<f64>()) / side as f64;
            let ray = trace(x, y);
            let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
            let mut covered = |(i, j)| !trace(x + i * half_pixel, y + j * half_pixel).pieces.is_empty();
            if !ray.pieces.is_empty() && corners.into_iter().all(&mut covered) {
                found.push(ray);
            }
        }
        if found.len() >= WANTED || side >= MOST_SIDE {
            return found;
        }
        side *= 2;
    }
}
