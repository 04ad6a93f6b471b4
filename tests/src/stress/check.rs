//! What is checked in a cell.

use super::axes::Scattering;
use super::body::Baked;
use super::energy::most_radiance;
use super::plan::Cell;
use super::stage::Stage;
use super::twin::{Bounded, Piece, Seen, Twin};
use diaphane_formats::asset::Asset;
use diaphane_runtime::cpu::CpuRenderer;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::GpuRenderer;
use diaphane_runtime::rendered::RayResult;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeSet;

/// Names of the checks, in the table's order.
pub const CHECKS: [&str; 6] = ["panic", "bake", "finite", "energy", "twin", "gpu"];

/// A broken bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// One of [`CHECKS`].
    pub check: &'static str,
    /// What was found and what was allowed.
    pub what: String,
}

/// What a cell showed.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Findings {
    /// Rays that were drawn.
    pub rays: usize,
    /// Those that pass through the object.
    pub hit: usize,
    /// Rays compared with the twin.
    pub compared: usize,
    /// Those of them whose weights are too small to bound their mean by more than the largest source.
    pub vague: usize,
    /// Largest difference from the twin, over the picture's peak, of rays that are not vague.
    pub twin_error: f64,
    /// Largest difference from the twin over the running bound.
    pub twin_share: f64,
    /// Largest value over what the lights put in.
    pub energy_share: f64,
    /// Rays compared with the GPU.
    pub gpu_rays: usize,
    /// Largest difference of the GPU from the CPU over the picture's peak.
    pub gpu_error: f64,
    /// Checks that do not apply, with the reason.
    pub skipped: Vec<(&'static str, &'static str)>,
    /// What was broken.
    pub failures: Vec<Failure>,
}

/// Largest number of rays of a cell that the twin evaluates, spread over the picture.
const TWIN_RAYS: usize = 100;

/// Samples times rays of a cell that the twin takes on, but for a single ray.
const TWIN_WORK: usize = 8_000_000;

/// Share of the peak that GPU and CPU may differ.
const GPU_BOUND: f64 = 1e-4;

/// A body under one scattering, ready to be drawn.
pub struct Subject<'a> {
    stage: Stage,
    asset: &'a Asset,
    cpu: CpuRenderer,
    twin: Twin<'a>,
    gpu: Option<GpuRenderer>,
}

/// The asset with another albedo and phase function, which a bake does not depend on.
pub fn dyed(asset: &Asset, scattering: Scattering) -> Asset {
    let mut asset = asset.clone();
    asset.info.albedo = [scattering.albedo; 3];
    asset.info.phase = scattering.phase();
    asset
}

impl<'a> Subject<'a> {
    /// Prepares `asset`, which is `baked` or a [`dyed`] copy.
    ///
    /// # Errors
    /// An asset that a player refuses.
    pub fn new(baked: &Baked, asset: &'a Asset, gpu: Option<GpuRenderer>) -> diaphane_runtime::Result<Self> {
        Ok(Self {
            stage: Stage::new(&baked.mesh, asset),
            cpu: CpuRenderer::new(asset)?,
            twin: Twin::new(asset),
            gpu,
            asset,
        })
    }

    /// Draws and checks a cell.
    ///
    /// # Errors
    /// A camera that makes no rays, a GPU that fails.
    pub fn check(&mut self, cell: &Cell) -> diaphane_runtime::Result<Findings> {
        let scene = self.stage.scene(cell.lights, cell.view);
        let frame = Frame::new(&scene, &self.asset.info)?;
        let mut findings = Findings::default();
        let picture = self.cpu.render(&frame, None).picture;
        findings.rays = picture.pixels.len();
        let values = || picture.pixels.iter().flatten();
        let bad = values().filter(|v| !(v.is_finite() && **v >= 0.0)).count();
        if bad > 0 {
            findings.fail("finite", format!("{bad} values of the picture are negative or no number"));
        }
        let bound = most_radiance(&scene, &self.asset.info);
        self.energy(&picture.pixels, bound, &mut findings);
        let sources = self.cpu.sources(&frame, None);
        let rays = self.cpu.trace_rays(&frame, &sources, [0.5; 2]);
        findings.hit = rays.iter().filter(|r| r.count > 0).count();
        let peak = values().fold(0.0f32, |p, v| p.max(*v));
        let seen = self.against_twin(&frame, &rays, f64::from(peak), &mut findings);
        self.against_gpu(&frame, &rays, &seen, f64::from(peak), &mut findings)?;
        Ok(findings)
    }

    fn energy(&self, pixels: &[[f32; 3]], bound: DVec3, findings: &mut Findings) {
        for c in 0..3 {
            let most = pixels.iter().map(|p| f64::from(p[c])).fold(0.0, f64::max);
            if most > bound[c] {
                let what = format!("radiance {most:.6e} is more than the lights put in, {:.6e}", bound[c]);
                findings.fail("energy", what);
                return;
            }
            if bound[c] > 0.0 {
                findings.energy_share = findings.energy_share.max(most / bound[c]);
            }
        }
    }

    /// The twin's rays, by their index.
    fn against_twin(
        &self,
        frame: &Frame,
        rays: &[RayResult],
        peak: f64,
        findings: &mut Findings,
    ) -> Vec<(usize, Seen)> {
        let work = (TWIN_WORK / self.asset.samples.len().max(1)).max(1);
        let hit: Vec<usize> = (0..rays.len()).filter(|i| rays[*i].count > 0).collect();
        let step = hit.len().div_ceil(TWIN_RAYS.min(work)).max(1);
        let origin = frame.view.origin.as_dvec3();
        let lines: Vec<(usize, DVec3, Vec<usize>)> = hit
            .par_iter()
            .step_by(step)
            .map(|&i| {
                let (x, y) = ((i as u32 % frame.width) as f32 + 0.5, (i as u32 / frame.width) as f32 + 0.5);
                let direction = frame.view.direction(x, y, frame.width, frame.height).as_dvec3();
                (i, direction, self.twin.met(origin, direction))
            })
            .collect();
        let wanted: BTreeSet<usize> = lines.iter().flat_map(|(.., met)| met).copied().collect();
        let lit = self.twin.lit(frame, &wanted.into_iter().collect::<Vec<_>>());
        let mut out = Vec::new();
        for (i, direction, met) in lines {
            let seen = self.twin.ray(&lit, origin, direction, &pieces_of(&rays[i]), &met);
            findings.compared += 1;
            findings.vague += usize::from(seen.vague);
            for c in 0..3 {
                let Bounded { value, error } = seen.radiance[c];
                let difference = (f64::from(rays[i].radiance[c]) - value).abs();
                if !(difference <= error) {
                    let got = rays[i].radiance[c];
                    let what = format!(
                        "ray {i} channel {c}: {got:.8e} in single precision, {value:.8e} in double, off by {:.2e} \
                         of the peak where {:.2e} is the bound",
                        difference / peak,
                        error / peak
                    );
                    findings.fail("twin", what);
                }
                if difference > 0.0 && peak > 0.0 {
                    findings.twin_share = findings.twin_share.max(difference / error);
                    if !seen.vague {
                        findings.twin_error = findings.twin_error.max(difference / peak);
                    }
                }
            }
            out.push((i, seen));
        }
        out
    }

    fn against_gpu(
        &mut self,
        frame: &Frame,
        rays: &[RayResult],
        seen: &[(usize, Seen)],
        peak: f64,
        findings: &mut Findings,
    ) -> diaphane_runtime::Result<()> {
        let Some(gpu) = &mut self.gpu else {
            return Ok(());
        };
        if seen.is_empty() {
            findings.skipped.push(("gpu", "no ray has a bound from the twin"));
            return Ok(());
        }
        let got = gpu.trace_rays(frame, None, [0.5; 2])?;
        if got.iter().flat_map(|r| r.radiance).any(|v| !(v.is_finite() && v >= 0.0)) {
            findings.fail("gpu", "values of the picture are negative or no number".to_owned());
        }
        let diagonal = self.asset.info.diagonal();
        for (i, seen) in seen {
            let (a, b) = (&got[*i], &rays[*i]);
            if !same_pieces(a, b, diagonal) {
                continue;
            }
            findings.gpu_rays += 1;
            for c in 0..3 {
                let difference = f64::from((a.radiance[c] - b.radiance[c]).abs());
                // Both may be off by as much as their precision allows.
                let bound = (GPU_BOUND * peak).max(2.0 * seen.radiance[c].error);
                if !(difference <= bound) {
                    let what = format!("ray {i}: off by {:.2e} of the peak", difference / peak);
                    findings.fail("gpu", what);
                }
                if difference > 0.0 && peak > 0.0 {
                    findings.gpu_error = findings.gpu_error.max(difference / peak);
                }
            }
        }
        Ok(())
    }
}

/// The inside pieces of a ray, for the twin.
fn pieces_of(ray: &RayResult) -> Vec<Piece> {
    let piece = |k: usize| Piece {
        start: f64::from(ray.pieces[k].0),
        end: f64::from(ray.pieces[k].1),
        boundary: f64::from(ray.boundary[k]),
    };
    (0..ray.count as usize).map(piece).collect()
}

/// Whether two backends found the same inside pieces: ends within 1e-5 diagonals.
fn same_pieces(a: &RayResult, b: &RayResult, diagonal: f32) -> bool {
    let near = |x: f32, y: f32| (x - y).abs() <= 1e-5 * diagonal;
    let same = |k: usize| {
        let (p, q) = (a.pieces[k], b.pieces[k]);
        near(p.0, q.0) && near(p.1, q.1) && (a.boundary[k] - b.boundary[k]).abs() <= 1e-5
    };
    a.count == b.count && (0..a.count as usize).all(same)
}

impl Findings {
    /// Notes a broken bound, once a check.
    pub fn fail(&mut self, check: &'static str, what: String) {
        if self.failures.iter().all(|f| f.check != check) {
            self.failures.push(Failure { check, what });
        }
    }
}
