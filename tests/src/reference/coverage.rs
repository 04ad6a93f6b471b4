//! Which pixels the mesh covers, and by how much: a coarse grid of rays in every pixel, a fine one along edges.

use super::integrator::{Integrator, Worker};
use rayon::prelude::*;

/// Rays along each side of a pixel, first and near edges.
const COARSE: usize = 4;
const FINE: usize = 16;

/// Fraction of each pixel's rays that pass through the object, and the number of rays traced.
pub fn coverage(
    integrator: &Integrator,
    width: usize,
    height: usize,
    done: &(dyn Fn(usize) + Sync),
) -> (Vec<f32>, u64) {
    let pass = |pixels: &[usize], side: usize| -> Vec<f32> {
        let at = |k: usize| (k as f64 + 0.5) / side as f64;
        pixels
            .par_chunks(width)
            .flat_map_iter(|chunk| {
                let mut worker = Worker::default();
                let values: Vec<f32> = chunk
                    .iter()
                    .map(|&i| {
                        let (x, y) = ((i % width) as f64, (i / width) as f64);
                        let hit = |k: usize| integrator.hits(x + at(k % side), y + at(k / side), &mut worker);
                        (0..side * side).map(hit).filter(|h| *h).count() as f32 / (side * side) as f32
                    })
                    .collect();
                done(chunk.len());
                values
            })
            .collect()
    };
    let all: Vec<usize> = (0..width * height).collect();
    let mut cover = pass(&all, COARSE);
    let edge: Vec<usize> = all.into_iter().filter(|&i| !is_flat(&cover, width, height, i)).collect();
    let fine = pass(&edge, FINE);
    let rays = width * height * COARSE * COARSE + edge.len() * FINE * FINE;
    for (&i, value) in edge.iter().zip(fine) {
        cover[i] = value;
    }
    (cover, rays as u64)
}

/// Whether the pixel and its neighbours are all empty or all full.
pub fn is_flat(cover: &[f32], width: usize, height: usize, i: usize) -> bool {
    neighbours(width, height, i).all(|k| cover[k] == cover[i]) && (cover[i] == 0.0 || cover[i] == 1.0)
}

/// The pixel and those around it within the picture.
pub fn neighbours(width: usize, height: usize, i: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
    rows.flat_map(move |r| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |c| r * width + c))
}
