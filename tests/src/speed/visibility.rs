//! Depths along lines by both methods: rays per second of one thread, and how far they agree.

use diaphane_formats::directions::even_directions;
use diaphane_formats::medium::Medium;
use diaphane_formats::mesh::Mesh;
use diaphane_formats::morton;
use diaphane_formats::visibility::{Accel, DepthRows, project, trace};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;

/// `count` random points inside the mesh, further than `margin` from its surface; fewer where there is hardly any room.
pub fn points_inside(mesh: &Mesh, accel: &Accel, count: usize, margin: f64, seed: u64) -> Vec<DVec3> {
    let (low, high) = mesh.bounds();
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut crossings = Vec::new();
    let tries = (0..1000 * count).filter_map(|_| {
        let p = low + (high - low) * DVec3::new(rng.random(), rng.random(), rng.random());
        accel.crossings(p, DVec3::new(0.36, 0.48, 0.8), 0.0, f64::INFINITY, &mut crossings);
        let inside = crossings.iter().map(|c| c.sign).sum::<i32>() > 0;
        (inside && (margin == 0.0 || accel.nearest(p, margin).is_none())).then_some(p)
    });
    tries.take(count).collect()
}

/// The points in the order in which a bake has its samples.
pub fn along_the_curve(points: &[DVec3]) -> Vec<DVec3> {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let order = morton::order(points.iter().copied(), low, high);
    order.into_iter().map(|i| points[i as usize]).collect()
}

/// Points that are traced one after the other, as they stand in the list.
const RUN: usize = 100;

/// Rays per second of one thread; a line is two rays.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// By projecting the mesh.
    pub project: f64,
    /// By tracing.
    pub trace: f64,
}

/// Measures both methods along `directions` directions; tracing with at most `traced` of the points, in runs.
/// The first direction, before which nothing is in any cache, does not count.
pub fn rates(
    mesh: &Mesh,
    accel: &Accel,
    medium: &Medium,
    points: &[DVec3],
    directions: usize,
    traced: usize,
) -> Rates {
    let every = points.len().div_ceil(traced).max(1);
    let some: Vec<DVec3> = points.chunks(RUN).step_by(every).flatten().copied().collect();
    let axes = even_directions(2 * (directions + 1), 7);
    let rate = |points: &[DVec3], run: &dyn Fn(&[DVec3], DVec3) -> DepthRows| {
        black_box(run(points, axes[2 * directions]));
        let start = Instant::now();
        for axis in axes[..2 * directions].iter().step_by(2) {
            black_box(run(points, *axis));
        }
        (2 * directions * points.len()) as f64 / start.elapsed().as_secs_f64()
    };
    Rates {
        project: rate(points, &|points, axis| project(mesh, medium, points, axis)),
        trace: rate(&some, &|points, axis| trace(accel, medium, None, points, axis)),
    }
}

/// How far the methods agree.
#[derive(Clone, Copy, Debug, Default)]
pub struct Agreement {
    /// Lines compared, each both ways.
    pub lines: u64,
    /// Rays from inside points whose projected winding number is not 1.
    pub wrong_projected: u64,
    /// As above, traced.
    pub wrong_traced: u64,
    /// Largest difference of a depth, in diagonals of the mesh.
    pub largest: f64,
}

/// Compares the methods along `directions` directions.
pub fn agreement(
    mesh: &Mesh,
    accel: &Accel,
    medium: &Medium,
    points: &[DVec3],
    directions: usize,
) -> Agreement {
    let diagonal = mesh.diagonal();
    let one = |axis: &DVec3| {
        let (a, b) = (project(mesh, medium, points, *axis), trace(accel, medium, None, points, *axis));
        let mut out = Agreement { lines: points.len() as u64, ..Agreement::default() };
        for side in 0..2 {
            let wrong = |rows: &DepthRows| rows.winding[side].iter().filter(|w| **w != 1).count() as u64;
            out.wrong_projected += wrong(&a);
            out.wrong_traced += wrong(&b);
            for (a, b) in a.lengths(side).iter().zip(b.lengths(side)) {
                out.largest = out.largest.max(f64::from((a - b).abs()) / diagonal);
            }
        }
        out
    };
    let add = |a: Agreement, b: Agreement| Agreement {
        lines: a.lines + b.lines,
        wrong_projected: a.wrong_projected + b.wrong_projected,
        wrong_traced: a.wrong_traced + b.wrong_traced,
        largest: a.largest.max(b.largest),
    };
    let axes: Vec<DVec3> = even_directions(2 * directions, 11).into_iter().step_by(2).collect();
    axes.par_iter().map(one).reduce(Agreement::default, add)
}
