//! The ray-marched reference: single scattering by brute force, from mesh and medium alone.
//!
//! It shares the parsers, the crossing test of rays with triangles, and the point evaluation of medium and lights
//! with the rest of the project; optical depths, view transmittance and the integral along the camera ray are its
//! own. Nothing baked enters.
//!
//! ```text
//! coverage -> passes { integrator: rays -> along (position) -> density, lights } until the error is small enough
//! ```
//!
//! Every pixel is estimated by [`REPLICATES`] independently randomised point sets ([`sequence`]) of equal size. Their
//! scatter gives the variance of the pixel's mean, and √(Σ variance / Σ mean²) over all pixels and channels the
//! picture's relative error. Each pass doubles the samples of those pixels whose variance still matters. The picture
//! depends on the seed, not on the number of threads.

mod along;
mod coverage;
mod density;
mod environment;
mod integrator;
mod polynomial;
mod rays;
mod sequence;

use coverage::{is_flat, neighbours};
use diaphane_formats::medium::Medium;
use diaphane_formats::mesh::Mesh;
use diaphane_formats::picture::Picture;
use diaphane_formats::scene::Scene;
use diaphane_formats::visibility::Accel;
use diaphane_formats::{Error, Result};
use glam::DVec3;
use integrator::{Integrator, Worker};
use rayon::prelude::*;
use sequence::Sequence;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Raise it when the same input gives another picture: stored references of another version are not used.
pub const VERSION: u32 = 1;

/// Independent estimates of every pixel.
pub const REPLICATES: usize = 8;

/// Samples of each replicate in the first pass.
const FIRST: u32 = 4;

/// How much work to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Relative error (noise) of the picture at which to stop.
    pub tolerance: f64,
    /// Chooses the noise.
    pub seed: u64,
    /// At most this many samples in a pixel, whatever the error.
    pub most_samples: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 0.005, seed: 0, most_samples: 1 << 16 }
    }
}

/// A reference picture and what is known about it.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Radiance and coverage.
    pub picture: Picture,
    /// Estimated relative error: √(Σ variance of the mean / Σ mean²).
    pub error: f64,
    /// Whether `error` met the tolerance.
    pub converged: bool,
    /// Rays traced.
    pub rays: u64,
}

/// How far the work is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// 0 while coverage is found, then the number of the pass.
    pub pass: u32,
    /// Pixels of this pass that are done.
    pub done: usize,
    /// Pixels of this pass.
    pub total: usize,
    /// Relative error before this pass; infinite before the first.
    pub error: f64,
}

/// Sums of one pixel's replicates.
struct Pixel {
    index: usize,
    sums: [DVec3; REPLICATES],
    samples: u32,
}

impl Pixel {
    fn mean(&self) -> DVec3 {
        self.sums.iter().sum::<DVec3>() / (REPLICATES as f64 * f64::from(self.samples))
    }

    /// Variance of the mean, summed over channels.
    fn variance(&self) -> f64 {
        let mean = self.mean();
        let scatter: f64 =
            self.sums.iter().map(|s| (*s / f64::from(self.samples) - mean).length_squared()).sum();
        scatter / (REPLICATES * (REPLICATES - 1)) as f64
    }
}

/// Renders the reference picture of a scene.
///
/// # Errors
/// A camera that makes no rays, a tolerance that is not above 0.
pub fn render(
    mesh: &Mesh,
    medium: &Medium,
    scene: &Scene,
    settings: &Settings,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Reference> {
    if !(settings.tolerance > 0.0 && settings.tolerance.is_finite()) {
        return Err(Error::invalid(format!("the tolerance must be above 0, not {}", settings.tolerance)));
    }
    let accel = Accel::new(mesh);
    let integrator = Integrator::new(mesh, &accel, medium, scene)?;
    let (width, height) = (scene.image.width as usize, scene.image.height as usize);
    let report = |pass: u32, total: usize, error: f64| {
        let done = AtomicUsize::new(0);
        move |count: usize| {
            let done = done.fetch_add(count, Ordering::Relaxed) + count;
            progress(Progress { pass, done: done.min(total), total, error });
        }
    };
    let (cover, mut rays) =
        coverage::coverage(&integrator, width, height, &report(0, width * height, f64::INFINITY));
    let empty = |i: usize| cover[i] == 0.0 && is_flat(&cover, width, height, i);
    let mut pixels: Vec<Pixel> = (0..width * height)
        .filter(|&i| integrator.is_lit() && !empty(i))
        .map(|index| Pixel { index, sums: [DVec3::ZERO; REPLICATES], samples: 0 })
        .collect();
    let mut active = vec![true; pixels.len()];
    let mut error = f64::INFINITY;
    let mut pass = 0;
    let converged = loop {
        pass += 1;
        let count = active.iter().filter(|a| **a).count();
        rays += refine(&integrator, width, settings, &mut pixels, &active, &report(pass, count, error));
        error = relative_error(&pixels);
        if error <= settings.tolerance {
            break true;
        }
        active = choose(&pixels, settings, width, height);
        if !active.contains(&true) {
            break false;
        }
    };
    let mut picture = Picture::new(width, height);
    for p in &pixels {
        picture.pixels[p.index] = p.mean().as_vec3().to_array();
    }
    picture.coverage = Some(cover);
    Ok(Reference { picture, error, converged, rays })
}

/// Doubles the samples of the active pixels (or takes the first ones) and returns the number of rays.
fn refine(
    integrator: &Integrator,
    width: usize,
    settings: &Settings,
    pixels: &mut [Pixel],
    active: &[bool],
    done: &(dyn Fn(usize) + Sync),
) -> u64 {
    let rays = AtomicU64::new(0);
    let work: Vec<&mut Pixel> = pixels.iter_mut().zip(active).filter(|(_, a)| **a).map(|(p, _)| p).collect();
    work.into_par_iter().chunks(64).for_each(|chunk| {
        let mut worker = Worker::default();
        let count = chunk.len();
        for pixel in chunk {
            let (from, to) = (pixel.samples, (2 * pixel.samples).max(FIRST));
            let (column, row) = (pixel.index % width, pixel.index / width);
            for (r, sum) in pixel.sums.iter_mut().enumerate() {
                let sequence = Sequence::new(settings.seed, (pixel.index * REPLICATES + r) as u64);
                for k in from..to {
                    *sum += integrator.sample(column, row, sequence.point(k), &mut worker);
                }
            }
            pixel.samples = to;
        }
        rays.fetch_add(worker.rays, Ordering::Relaxed);
        done(count);
    });
    rays.into_inner()
}

/// √(Σ variance of the mean / Σ mean²); 0 for a black picture.
fn relative_error(pixels: &[Pixel]) -> f64 {
    let (noise, power) =
        pixels.iter().fold((0.0, 0.0), |(v, m), p| (v + p.variance(), m + p.mean().length_squared()));
    if noise == 0.0 { 0.0 } else { (noise / power).sqrt() }
}

/// The pixels whose variance is above their share of what the tolerance allows. Eight replicates tell a variance only
/// roughly, so the neighbours' mean counts as well: a pixel must not stop because it looks calm by chance.
fn choose(pixels: &[Pixel], settings: &Settings, width: usize, height: usize) -> Vec<bool> {
    let mut variance = vec![0.0; width * height];
    let mut power = 0.0;
    for p in pixels {
        variance[p.index] = p.variance();
        power += p.mean().length_squared();
    }
    let share = settings.tolerance.powi(2) * power / pixels.len().max(1) as f64;
    let smooth = |i: usize| {
        let (sum, n) = neighbours(width, height, i).fold((0.0, 0.0), |(s, n), k| (s + variance[k], n + 1.0));
        variance[i].max(sum / n)
    };
    let most = settings.most_samples / REPLICATES as u32;
    pixels.iter().map(|p| 2 * p.samples <= most && smooth(p.index) > 0.25 * share).collect()
}

#[cfg(test)]
mod tests;
