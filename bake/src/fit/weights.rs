//! Kernel weights that make the sum of all kernels as even as possible.
//!
//! Non-negative least squares Σ_i w_i γ_i(x) = 1 over random inside points, weighted by √Φ, by multiplicative updates
//! w_i ← w_i (AᵀWb)_i / (AᵀWAw)_i (Lee and Seung 2001), which keep every weight positive.

use crate::Result;
use crate::progress::Stage;
use crate::samples::{Candidate, Probe};
use diaphane_formats::kernel;
use diaphane_formats::reconstruct::Cloud;
use glam::{DVec3, Vec3};
use half::f16;
use rayon::prelude::*;

/// Measured on four objects with 50,000 samples: the interpolation error is as after 60 to within 1 %.
const ITERATIONS: usize = 20;

/// Probes of one task.
const PART: usize = 4096;

/// A sparse matrix by rows.
struct Rows {
    start: Vec<usize>,
    entries: Vec<(u32, f32)>,
}

impl Rows {
    /// Values of all kernels at `probes`.
    fn of(cloud: &Cloud, probes: &[Probe]) -> Self {
        let mut rows = Self { start: vec![0], entries: Vec::new() };
        for probe in probes {
            let from = rows.entries.len();
            cloud.for_each_near_point(probe.position, |i| {
                let v =
                    kernel::value(cloud.sharpness[i], (cloud.centre[i] - probe.position).length_squared());
                if v > 0.0 {
                    rows.entries.push((i as u32, v));
                }
            });
            rows.entries[from..].sort_unstable_by_key(|(i, _)| *i);
            rows.start.push(rows.entries.len());
        }
        rows
    }

    /// One below the other; every part is freed as soon as it is copied.
    fn joined(parts: Vec<Self>) -> Self {
        let total = parts.iter().map(|p| p.entries.len()).sum();
        let mut all = Self { start: vec![0], entries: Vec::with_capacity(total) };
        for part in parts {
            let from = all.entries.len();
            all.start.extend(part.start[1..].iter().map(|s| from + s));
            all.entries.extend(part.entries);
        }
        all
    }

    fn row(&self, i: usize) -> &[(u32, f32)] {
        &self.entries[self.start[i]..self.start[i + 1]]
    }

    fn len(&self) -> usize {
        self.start.len() - 1
    }

    fn transposed(&self, columns: usize) -> Self {
        let mut start = vec![0usize; columns + 1];
        for (c, _) in &self.entries {
            start[*c as usize + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let mut entries = vec![(0, 0.0); self.entries.len()];
        for r in 0..self.len() {
            for (c, v) in self.row(r) {
                let slot = &mut next[*c as usize];
                entries[*slot] = (r as u32, *v);
                *slot += 1;
            }
        }
        Self { start, entries }
    }

    fn times(&self, x: &[f32]) -> Vec<f32> {
        (0..self.len())
            .into_par_iter()
            .map(|r| self.row(r).iter().map(|(c, v)| v * x[*c as usize]).sum())
            .collect()
    }
}

/// The weights of `samples`, whose positions count from `middle` where those of `probes` do.
pub(crate) fn weights(
    samples: &[Candidate],
    middle: DVec3,
    probes: &[Probe],
    width_factor: f32,
    stage: Stage<'_>,
) -> Result<Vec<f32>> {
    stage.announce(ITERATIONS);
    let centre: Vec<Vec3> = samples.iter().map(|s| (s.position - middle).as_vec3()).collect();
    let sharpness: Vec<f32> =
        samples.iter().map(|s| kernel::sharpness(s.radius as f32, width_factor)).collect();
    let n = centre.len();
    let cloud = Cloud::from_parts(centre, sharpness, vec![1.0; n]);
    // Each row of the system is a probe, scaled by the fourth root of its fluence (√Φ in the squared error).
    let parts: Vec<Rows> = probes
        .par_chunks(PART)
        .map(|probes| stage.step(0).map(|()| Rows::of(&cloud, probes)))
        .collect::<Result<_>>()?;
    let by_probe = Rows::joined(parts);
    let importance: Vec<f32> = probes.iter().map(|p| p.fluence.max(1e-6).sqrt()).collect();
    let by_sample = by_probe.transposed(n);
    let wanted = by_sample.times(&importance);
    let mut w = vec![1.0f32; n];
    // Start at the right overall level.
    let level = by_probe.times(&w);
    let mean = level.iter().zip(&importance).map(|(l, i)| f64::from(l * i)).sum::<f64>()
        / importance.iter().map(|i| f64::from(*i)).sum::<f64>().max(1e-30);
    w.fill((1.0 / mean.max(1e-6)) as f32);
    for _ in 0..ITERATIONS {
        let sum: Vec<f32> = by_probe.times(&w).iter().zip(&importance).map(|(s, i)| s * i).collect();
        let got = by_sample.times(&sum);
        for ((w, wanted), got) in w.iter_mut().zip(&wanted).zip(&got) {
            if *got > 0.0 {
                *w *= wanted / got;
            }
        }
        stage.step(1)?;
    }
    // As the asset stores them.
    Ok(w.into_iter().map(|w| f16::from_f32(w.min(65504.0)).to_f32()).collect())
}
