//! Optical depth of every sample in every direction, by projecting the mesh along each.

use crate::field::Shape;
use crate::params::{DARK, Params};
use crate::progress::Stage;
use crate::samples::{Candidate, Placed};
use crate::{Error, Prepared, Result};
use diaphane_formats::directions::{even_directions, hash};
use diaphane_formats::visibility::project_with;
use glam::DVec3;
use rayon::prelude::*;

/// Samples that receive light, with their depths.
pub(crate) struct Lit {
    pub samples: Vec<Candidate>,
    pub probes: Vec<Candidate>,
    pub directions: Vec<DVec3>,
    /// m in row-major [sample][direction] order.
    pub density_length: Vec<f32>,
    /// Fresnel transmittance products in the same order; empty when index matched.
    pub boundary: Vec<f32>,
    /// Samples dropped because they turned out dark or outside.
    pub discarded: usize,
    pub snapped: usize,
    pub dark_candidates: usize,
    pub rays: u64,
}

/// Directions projected before their rows are turned into columns: bounds the memory of the rows.
const GROUP: usize = 32;

pub(crate) fn depths(
    shape: &Shape<'_>,
    medium: &Prepared<'_>,
    placed: Placed,
    params: &Params,
    stage: Stage<'_>,
) -> Result<Lit> {
    let directions = even_directions(params.directions, hash(params.seed, 31));
    let points: Vec<DVec3> = placed.samples.iter().map(|s| s.position).collect();
    let (n, d) = (points.len(), directions.len());
    stage.expect(d.div_ceil(2));
    let matched = medium.medium.ior() == 1.0;
    let mut density_length = vec![0.0f32; n * d];
    let mut boundary = vec![1.0f32; if matched { 0 } else { n * d }];
    let mut outside_votes = vec![0u32; n];
    for (g, group) in directions.chunks(GROUP).enumerate() {
        let rows: Vec<_> = group
            .par_chunks(2)
            .map(|pair| {
                let rows = project_with(shape.mesh, medium.medium, medium.for_rays(), &points, pair[0]);
                stage.step(1)?;
                Ok(rows)
            })
            .collect::<Result<_>>()?;
        let column = |k: usize| (k / 2, k % 2);
        density_length.par_chunks_mut(d).enumerate().for_each(|(i, out)| {
            for k in 0..group.len() {
                let (row, side) = column(k);
                let row = &rows[row];
                out[g * GROUP + k] = if side == 0 { row.forward[i] } else { row.backward[i] };
            }
        });
        if !matched {
            boundary.par_chunks_mut(d).enumerate().for_each(|(i, out)| {
                for k in 0..group.len() {
                    let (row, side) = column(k);
                    out[g * GROUP + k] = rows[row].boundary[side][i];
                }
            });
        }
        outside_votes.par_iter_mut().enumerate().for_each(|(i, votes)| {
            for k in 0..group.len() {
                let (row, side) = column(k);
                *votes += u32::from(rows[row].winding[side][i] <= 0);
            }
        });
    }
    let kappa = medium.medium.reference_extinction() as f32;
    let keep: Vec<bool> = (0..n)
        .into_par_iter()
        .map(|i| {
            let depth = &density_length[i * d..(i + 1) * d];
            let through = |k: usize| boundary.get(i * d + k).copied().unwrap_or(1.0);
            let light: f32 = depth.iter().enumerate().map(|(k, m)| (-kappa * m).exp() * through(k)).sum();
            // The layers' estimate decided before; only what is clearly darker goes now.
            f64::from(light) / d as f64 >= 0.2 * DARK && 2 * outside_votes[i] as usize <= d
        })
        .collect();
    let kept = keep.iter().filter(|k| **k).count();
    if kept == 0 {
        return Err(Error::NoRoom("no light reaches its inside".to_owned()));
    }
    if kept < n {
        compact(&mut density_length, &keep, d);
        if !matched {
            compact(&mut boundary, &keep, d);
        }
    }
    let mut keep_samples = keep.iter();
    let mut samples = placed.samples;
    samples.retain(|_| keep_samples.next().copied().unwrap_or(false));
    Ok(Lit {
        samples,
        probes: placed.probes,
        directions,
        density_length,
        boundary,
        discarded: n - kept,
        snapped: placed.snapped,
        dark_candidates: placed.dark,
        rays: (n * d) as u64,
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
