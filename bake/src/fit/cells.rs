//! The region that a sample stands for: a few points spread through the inside part of the ball around it.
//!
//! Light at a grazing angle fades within a fraction of the samples' spacing, so its value at a point says little about
//! the neighbourhood that the kernel stands for. Every sample therefore carries the mean of ψ over these points, valid
//! at their centroid up to the correction of [`diaphane_formats::slopes`].

use crate::Result;
use crate::field::{Shape, inside_nodes};
use crate::samples::Candidate;
use diaphane_formats::directions::hash;
use diaphane_formats::slopes::CELL_RADIUS;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Tries for each point that is wanted; samples on the boundary lose about half.
const TRIES: usize = 3;

/// `count` points for each sample, row-major [sample][point].
pub(super) fn points(
    shape: &Shape<'_>,
    samples: &[Candidate],
    count: usize,
    seed: u64,
) -> Result<Vec<DVec3>> {
    if count <= 1 {
        return Ok(samples.iter().map(|s| s.position).collect());
    }
    let tries: Vec<DVec3> = samples
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, s)| {
            let mut rng = Pcg64Mcg::seed_from_u64(hash(seed, i as u64));
            (0..TRIES * count)
                .map(move |_| s.position + in_ball(&mut rng) * (f64::from(CELL_RADIUS) * s.radius))
        })
        .collect();
    let inside = inside_nodes(shape.mesh, &tries)?;
    let width = TRIES * count;
    Ok(samples
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, s)| {
            let own = i * width..(i + 1) * width;
            let mut kept: Vec<DVec3> = own.filter(|k| inside[*k]).map(|k| tries[k]).take(count).collect();
            if kept.is_empty() {
                kept.push(s.position);
            }
            // Too few found: those count more than once.
            let found = kept.len();
            (0..count).map(move |k| kept[k % found])
        })
        .collect())
}

fn in_ball(rng: &mut Pcg64Mcg) -> DVec3 {
    loop {
        let p = DVec3::new(rng.random(), rng.random(), rng.random()) * 2.0 - 1.0;
        if p.length_squared() < 1.0 {
            return p;
        }
    }
}
