//! Optical depth of every sample in every direction, all samples along one direction at a time.
//!
//! ψ of a sample is a mean over its cell. One direction sees a few of the cell's points, the next one others: the fit
//! over all directions is smooth, so that few rays each average the cell as well as many would (measured on the layered
//! cube at 20,000 samples and equal rays: error 0.063 with 512 directions that all see the same 6 points, 0.055 with 1,024
//! that see 3 of 12).

use super::cells::{Cells, buried, nearest};
use crate::field::Shape;
use crate::params::{DARK, Params, Visibility};
use crate::progress::Stage;
use crate::samples::{Candidate, Placed};
use crate::{Error, Prepared, Result, visibility};
use diaphane_formats::approx::exp;
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::slopes::CELL_RADIUS;
use diaphane_formats::visibility::{DepthRows, Nearest};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Samples that receive light, with their transmittance.
pub(crate) struct Lit {
    pub samples: Vec<Candidate>,
    /// What each sample stands for.
    pub cells: Cells,
    /// Unit vector towards the nearest surface, 0 for samples further from it than [`NEAR`] radii.
    pub surface: Vec<Vec3>,
    pub probes: Vec<Candidate>,
    /// Unit vectors: the first half, then their opposites in the same order.
    pub directions: Vec<DVec3>,
    /// ψ at the reference extinction, mean over some of each sample's points, row-major [sample][direction].
    pub transmittance: Vec<f32>,
    /// Fresnel transmittance products in the same order, weighted by ψ; empty when index matched.
    pub boundary: Vec<f32>,
    /// Samples dropped because they turned out dark or outside.
    pub discarded: usize,
    pub snapped: usize,
    pub dark_candidates: usize,
    /// Samples so deep inside that none of their points was tested.
    pub buried: usize,
    pub rays: u64,
    /// How depths were found.
    pub visibility: &'static str,
}

/// Points of a cell, of which every direction sees its share.
const POOL: usize = 16;

/// Samples closer to the surface than this many disk radii may be lit by a face alone.
const NEAR: f64 = 2.0;

/// Pairs of opposite directions projected before their rows are turned into columns: bounds the memory of the rows.
const GROUP: usize = 8;

pub(crate) fn depths(
    shape: &Shape<'_>,
    medium: &Prepared<'_>,
    placed: Placed,
    params: &Params,
    stage: Stage<'_>,
) -> Result<Lit> {
    let pairs = even_directions(params.directions.next_multiple_of(2), hash(params.seed, 31));
    let forward: Vec<DVec3> = pairs.iter().step_by(2).copied().collect();
    let half = forward.len();
    let directions: Vec<DVec3> = forward.iter().copied().chain(forward.iter().map(|d| -*d)).collect();
    let count = params.points_per_sample;
    let size = if count == 1 { 1 } else { POOL.next_multiple_of(count) };
    let nearest = nearest(shape, &placed.samples, NEAR.max(f64::from(CELL_RADIUS)));
    let buried = buried(&placed.samples, &nearest);
    let mut cells = Cells::new(shape, medium.medium, &placed.samples, &buried, size, hash(params.seed, 37))?;
    let (n, d) = (placed.samples.len(), directions.len());
    stage.announce(half);
    let matched = medium.medium.ior() == 1.0;
    let kappa = medium.medium.reference_extinction() as f32;
    let mut transmittance = vec![0.0f32; n * d];
    let mut boundary = vec![1.0f32; if matched { 0 } else { n * d }];
    let mut outside_votes = vec![0u32; n];
    for (g, group) in forward.chunks(GROUP).enumerate() {
        let rows: Vec<Row> = group
            .par_iter()
            .enumerate()
            .map(|(k, axis)| {
                let points = cells.turn(g * GROUP + k, count);
                let rows = visibility::depths(shape, medium, params.visibility, &points, *axis);
                stage.step(1)?;
                Ok(Row::new(&rows, kappa, count))
            })
            .collect::<Result<_>>()?;
        let columns = |out: &mut [f32], value: &dyn Fn(&Row, usize) -> f32| {
            for (k, row) in rows.iter().enumerate() {
                (0..2).for_each(|side| out[side * half + g * GROUP + k] = value(row, side));
            }
        };
        transmittance.par_chunks_mut(d).zip(&mut outside_votes).enumerate().for_each(|(i, (out, votes))| {
            columns(out, &|row, side| row.psi[side][i]);
            *votes += rows.iter().map(|row| u32::from(row.outside[i])).sum::<u32>();
        });
        boundary
            .par_chunks_mut(d)
            .enumerate()
            .for_each(|(i, out)| columns(out, &|row, side| row.through[side][i]));
    }
    let keep: Vec<bool> = (0..n)
        .into_par_iter()
        .map(|i| {
            let psi = &transmittance[i * d..(i + 1) * d];
            let through = |k: usize| boundary.get(i * d + k).copied().unwrap_or(1.0);
            let light: f32 = psi.iter().enumerate().map(|(k, psi)| psi * through(k)).sum();
            // The layers decided before; the mean over the points of a sample on the boundary of a dense medium may lie
            // far below, yet it is all the light there is: only what is dark beyond doubt goes now.
            let outside = 2 * outside_votes[i] as usize > d * count;
            f64::from(light) / d as f64 >= 1e-3 * DARK && !outside
        })
        .collect();
    let kept = keep.iter().filter(|k| **k).count();
    if kept == 0 {
        return Err(Error::NoRoom("no light reaches its inside".to_owned()));
    }
    if kept < n {
        compact(&mut transmittance, &keep, d);
        if !matched {
            compact(&mut boundary, &keep, d);
        }
        cells.retain(&keep);
    }
    let samples: Vec<Candidate> = (0..n).filter(|i| keep[*i]).map(|i| placed.samples[i]).collect();
    Ok(Lit {
        surface: (0..n)
            .filter(|i| keep[*i])
            .map(|i| towards_surface(shape, &placed.samples[i], nearest[i]))
            .collect(),
        buried: buried.iter().filter(|b| **b).count(),
        samples,
        cells,
        probes: placed.probes,
        directions,
        transmittance,
        boundary,
        discarded: n - kept,
        snapped: placed.snapped,
        dark_candidates: placed.dark,
        rays: (n * count * d) as u64,
        visibility: match visibility::chosen(params.visibility, n * count, shape.mesh.triangles.len()) {
            Visibility::Trace => "trace",
            _ => "project",
        },
    })
}

/// What samples see along one direction and its opposite.
struct Row {
    /// Mean ψ over the points.
    psi: [Vec<f32>; 2],
    /// Mean Fresnel transmittance weighted by ψ; empty when index matched.
    through: [Vec<f32>; 2],
    /// How often one of the points seems to lie outside.
    outside: Vec<u16>,
}

impl Row {
    /// From the depths of `count` points for each sample, at extinction `kappa`.
    fn new(rows: &DepthRows, kappa: f32, count: usize) -> Self {
        let psi = [0, 1].map(|side| rows.lengths(side).iter().map(|m| exp(-kappa * m)).collect::<Vec<f32>>());
        let through = [0, 1].map(|side| {
            let points = psi[side].chunks_exact(count).zip(rows.boundary[side].chunks_exact(count));
            let mean = |(psi, boundary): (&[f32], &[f32])| {
                // A little more than ψ, so that darkness divides no zero by zero.
                let (mut through, mut all) = (0.0f32, 0.0f32);
                for (psi, boundary) in psi.iter().zip(boundary) {
                    through += (psi + 1e-6) * boundary;
                    all += psi + 1e-6;
                }
                through / all
            };
            points.map(mean).collect()
        });
        let sides = rows.winding[0].chunks_exact(count).zip(rows.winding[1].chunks_exact(count));
        let not_inside = |windings: &[i8]| windings.iter().filter(|w| **w <= 0).count() as u16;
        Self {
            psi: psi
                .map(|psi| psi.chunks_exact(count).map(|p| p.iter().sum::<f32>() / count as f32).collect()),
            through,
            outside: sides.map(|(a, b)| not_inside(a) + not_inside(b)).collect(),
        }
    }
}

/// Towards the nearest point of the mesh, or out of the triangle that the sample lies on.
fn towards_surface(shape: &Shape<'_>, sample: &Candidate, nearest: Option<Nearest>) -> Vec3 {
    let near = nearest.filter(|n| n.distance <= NEAR * sample.radius);
    let Some(nearest) = near else { return Vec3::ZERO };
    let there = nearest.point - sample.position;
    // Samples on the boundary are as close to it as their stored position's rounding.
    let on_it = there.length() < 1e-2 * sample.radius;
    let direction = if on_it { shape.accel.normal(nearest.triangle) } else { there.normalize_or_zero() };
    direction.as_vec3()
}

fn compact(values: &mut Vec<f32>, keep: &[bool], width: usize) {
    let mut to = 0;
    for (from, _) in keep.iter().enumerate().filter(|(_, k)| **k) {
        values.copy_within(from * width..(from + 1) * width, to * width);
        to += 1;
    }
    values.truncate(to * width);
}
