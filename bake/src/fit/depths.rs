//! Optical depth of every sample in every direction, by projecting the mesh along each.

use super::cells;
use crate::field::Shape;
use crate::params::{DARK, Params};
use crate::progress::Stage;
use crate::samples::{Candidate, Placed};
use crate::{Error, Prepared, Result};
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::visibility::{DepthRows, project_with};
use glam::DVec3;
use rayon::prelude::*;

/// Samples that receive light, with their transmittance.
pub(crate) struct Lit {
    pub samples: Vec<Candidate>,
    /// Where the values below hold: the mean of the points that each sample stands for.
    pub centroids: Vec<DVec3>,
    pub probes: Vec<Candidate>,
    pub directions: Vec<DVec3>,
    /// ψ at the reference extinction, mean over each sample's points, row-major [sample][direction].
    pub transmittance: Vec<f32>,
    /// Fresnel transmittance products in the same order, weighted by ψ; empty when index matched.
    pub boundary: Vec<f32>,
    /// Samples dropped because they turned out dark or outside.
    pub discarded: usize,
    pub snapped: usize,
    pub dark_candidates: usize,
    pub rays: u64,
}

impl Lit {
    /// ψβ of sample `i` in direction `k` at `ratio` times the reference extinction, as far as the mean tells.
    pub fn arriving(&self, i: usize, k: usize, ratio: f32) -> f32 {
        let at = i * self.directions.len() + k;
        self.transmittance[at].powf(ratio) * self.boundary.get(at).copied().unwrap_or(1.0)
    }
}

/// Directions projected before their rows are turned into columns: bounds the memory of the rows.
const GROUP: usize = 16;

pub(crate) fn depths(
    shape: &Shape<'_>,
    medium: &Prepared<'_>,
    placed: Placed,
    params: &Params,
    stage: Stage<'_>,
) -> Result<Lit> {
    let directions = even_directions(params.directions, hash(params.seed, 31));
    let per_sample = params.points_per_sample;
    let points = cells::points(shape, &placed.samples, per_sample, hash(params.seed, 37))?;
    let (n, d) = (placed.samples.len(), directions.len());
    stage.announce(d.div_ceil(2));
    let matched = medium.medium.ior() == 1.0;
    let kappa = medium.medium.reference_extinction() as f32;
    let mut transmittance = vec![0.0f32; n * d];
    let mut boundary = vec![1.0f32; if matched { 0 } else { n * d }];
    let mut outside_votes = vec![0u32; n];
    for (g, group) in directions.chunks(GROUP).enumerate() {
        let rows: Vec<DepthRows> = group
            .par_chunks(2)
            .map(|pair| {
                let rows = project_with(shape.mesh, medium.medium, medium.for_rays(), &points, pair[0]);
                stage.step(1)?;
                Ok(rows)
            })
            .collect::<Result<_>>()?;
        let column = |k: usize| (&rows[k / 2], k % 2);
        transmittance.par_chunks_mut(d).zip(&mut outside_votes).enumerate().for_each(|(i, (out, votes))| {
            let own = i * per_sample..(i + 1) * per_sample;
            for k in 0..group.len() {
                let (row, side) = column(k);
                let lengths = if side == 0 { &row.forward } else { &row.backward };
                let sum: f32 = lengths[own.clone()].iter().map(|m| (-kappa * m).exp()).sum();
                out[g * GROUP + k] = sum / per_sample as f32;
                *votes += row.winding[side][own.clone()].iter().filter(|w| **w <= 0).count() as u32;
            }
        });
        if !matched {
            boundary.par_chunks_mut(d).enumerate().for_each(|(i, out)| {
                let own = i * per_sample..(i + 1) * per_sample;
                for k in 0..group.len() {
                    let (row, side) = column(k);
                    let lengths = if side == 0 { &row.forward } else { &row.backward };
                    let (mut through, mut all) = (0.0f32, 0.0f32);
                    for q in own.clone() {
                        // A little more than ψ, so that darkness divides no zero by zero.
                        let psi = (-kappa * lengths[q]).exp() + 1e-6;
                        through += psi * row.boundary[side][q];
                        all += psi;
                    }
                    out[g * GROUP + k] = through / all;
                }
            });
        }
    }
    let keep: Vec<bool> = (0..n)
        .into_par_iter()
        .map(|i| {
            let psi = &transmittance[i * d..(i + 1) * d];
            let through = |k: usize| boundary.get(i * d + k).copied().unwrap_or(1.0);
            let light: f32 = psi.iter().enumerate().map(|(k, psi)| psi * through(k)).sum();
            // The layers decided before; the mean over the points of a sample on the boundary of a dense medium may lie
            // far below, yet it is all the light there is: only what is dark beyond doubt goes now.
            let outside = 2 * outside_votes[i] as usize > d * per_sample;
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
    }
    let mean = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
    let kept_only = |i: &usize| keep[*i];
    Ok(Lit {
        samples: (0..n).filter(kept_only).map(|i| placed.samples[i]).collect(),
        centroids: (0..n)
            .filter(kept_only)
            .map(|i| mean(&points[i * per_sample..(i + 1) * per_sample]))
            .collect(),
        probes: placed.probes,
        directions,
        transmittance,
        boundary,
        discarded: n - kept,
        snapped: placed.snapped,
        dark_candidates: placed.dark,
        rays: (n * per_sample * d) as u64,
    })
}

fn compact(values: &mut Vec<f32>, keep: &[bool], width: usize) {
    let mut to = 0;
    for (from, _) in keep.iter().enumerate().filter(|(_, k)| **k) {
        values.copy_within(from * width..(from + 1) * width, to * width);
        to += 1;
    }
    values.truncate(to * width);
}
