//! The CPU twin of every pass: fallback where there is no GPU, and oracle where there is one.

pub mod lighting;
pub mod segments;
pub mod splat;
pub mod surface;

use crate::Result;
use crate::exact::ExactDepths;
use crate::frame::Frame;
use crate::rendered::{Counters, RayResult, Rendered};
use crate::usable::usable_samples;
use diaphane_formats::asset::{Asset, DensityGrid, Samples};
use diaphane_formats::directions::subpixel_offsets;
use diaphane_formats::picture::Picture;
use diaphane_formats::reconstruct::Cloud;
use diaphane_formats::visibility::Accel;
use glam::{DVec3, Vec3};
use lighting::Lighting;
use rayon::prelude::*;
use segments::{Scratch, Segments};
use splat::RayMedium;
use std::time::Instant;

/// Extinction in single precision is clamped here; nothing passes through a medium that dense anyway.
const MOST_EXTINCTION: f64 = 1e30;

/// Draws frames of one asset on the CPU.
pub struct CpuRenderer {
    samples: Samples,
    lighting: Lighting,
    cloud: Cloud,
    accel: Accel,
    density: Option<DensityGrid>,
    extinction: Vec3,
    ior: f64,
    corners: Vec<[Vec3; 3]>,
    normals: Vec<[Vec3; 3]>,
    samples_drawn: u64,
}

/// A row of pixels and what was counted and timed on the way.
struct Row {
    pixels: Vec<[f32; 3]>,
    coverage: Vec<f32>,
    counters: Counters,
    /// Seconds in segments, splat, surface.
    seconds: [f64; 3],
}

impl CpuRenderer {
    /// Prepares an asset: hierarchies over mesh and kernels, normals.
    ///
    /// # Errors
    /// An asset whose parts make no sense.
    pub fn new(asset: &Asset) -> Result<Self> {
        asset.validate()?;
        let mesh = asset.mesh()?;
        let medium = asset.medium()?;
        let samples = usable_samples(asset);
        let extinction = medium.extinction() * medium.uniform_density();
        Ok(Self {
            lighting: Lighting::new(asset),
            cloud: Cloud::new(&samples, asset.info.width_factor),
            accel: Accel::new(&mesh),
            density: asset.density.clone(),
            extinction: extinction.min(DVec3::splat(MOST_EXTINCTION)).as_vec3(),
            ior: medium.ior(),
            corners: (0..mesh.triangles.len()).map(|i| mesh.corners(i).map(|p| p.as_vec3())).collect(),
            normals: surface::corner_normals(&mesh),
            samples_drawn: samples.weight.iter().filter(|w| **w > 0.0).count() as u64,
            samples,
        })
    }

    /// The source of every sample under the frame's lights, see [`lighting`].
    pub fn sources(&self, frame: &Frame, exact: Option<&ExactDepths>) -> Vec<Vec3> {
        self.lighting.sources(&self.samples, frame, exact)
    }

    /// Draws a frame.
    pub fn render(&mut self, frame: &Frame, exact: Option<&ExactDepths>) -> Rendered {
        let started = Instant::now();
        let sources = self.sources(frame, exact);
        let lighting_ms = milliseconds(started);
        let started = Instant::now();
        let offsets = subpixel_offsets(frame.samples_per_pixel as usize);
        let rows: Vec<Row> = (0..frame.height)
            .into_par_iter()
            .map_init(Scratch::default, |scratch, row| self.row(frame, &sources, &offsets, row, scratch))
            .collect();
        let wall = milliseconds(started);
        let mut picture = Picture::new(frame.width as usize, 0);
        picture.height = frame.height as usize;
        let (mut coverage, mut seconds) = (Vec::with_capacity(picture.width * picture.height), [0.0; 3]);
        let mut counters = Counters { samples_drawn: self.samples_drawn, ..Counters::default() };
        for row in rows {
            picture.pixels.extend(row.pixels);
            coverage.extend(row.coverage);
            counters = counters.merge(row.counters);
            (0..3).for_each(|k| seconds[k] += row.seconds[k]);
        }
        picture.coverage = Some(coverage);
        // The ray passes run interleaved on all threads: each gets its share of the time that passed on the clock.
        let all = seconds.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let share = |k: usize| wall * seconds[k] / all;
        let passes =
            vec![("lighting", lighting_ms), ("segments", share(0)), ("splat", share(1)), ("surface", share(2))];
        Rendered { picture, counters, passes }
    }

    /// What one ray of every pixel sees, at `offset` inside the pixel (0..1): rows one after the other.
    pub fn trace_rays(&self, frame: &Frame, sources: &[Vec3], offset: [f32; 2]) -> Vec<RayResult> {
        let trace = |scratch: &mut Scratch, index: u64| {
            let width = u64::from(frame.width);
            let (x, y) = ((index % width) as f32 + offset[0], (index / width) as f32 + offset[1]);
            let direction = frame.view.direction(x, y, frame.width, frame.height);
            let segments = segments::trace(&self.accel, self.ior, frame.view.origin, direction, scratch);
            let (radiance, _) = self.splat(frame, sources, direction, &segments);
            RayResult {
                pieces: segments.pieces.map(|p| (p.start, p.end)),
                boundary: segments.pieces.map(|p| p.boundary),
                count: segments.count as u32,
                radiance: radiance.to_array(),
            }
        };
        let count = u64::from(frame.width) * u64::from(frame.height);
        (0..count).into_par_iter().map_init(Scratch::default, trace).collect()
    }

    fn splat(&self, frame: &Frame, sources: &[Vec3], direction: Vec3, segments: &Segments) -> (Vec3, u32) {
        let medium = RayMedium { extinction: self.extinction, density: self.density.as_ref() };
        splat::ray(&self.cloud, sources, medium, frame.view.origin, direction, segments)
    }

    fn row(
        &self,
        frame: &Frame,
        sources: &[Vec3],
        offsets: &[[f32; 2]],
        row: u32,
        scratch: &mut Scratch,
    ) -> Row {
        let width = frame.width as usize;
        let per_pixel = 1.0 / offsets.len() as f32;
        let mut out = Row {
            pixels: Vec::with_capacity(width),
            coverage: Vec::with_capacity(width),
            counters: Counters { rays: (width * offsets.len()) as u64, ..Counters::default() },
            seconds: [0.0; 3],
        };
        let started = Instant::now();
        let mut rays: Vec<(Vec3, Segments)> = Vec::with_capacity(width * offsets.len());
        for column in 0..frame.width {
            for [dx, dy] in offsets {
                let (x, y) = (column as f32 + dx, row as f32 + dy);
                let direction = frame.view.direction(x, y, frame.width, frame.height);
                let segments = segments::trace(&self.accel, self.ior, frame.view.origin, direction, scratch);
                rays.push((direction, segments));
            }
        }
        out.seconds[0] = started.elapsed().as_secs_f64();
        let started = Instant::now();
        let mut sums = vec![Vec3::ZERO; width];
        for (i, (direction, segments)) in rays.iter().enumerate() {
            if segments.count == 0 {
                continue;
            }
            let (radiance, splats) = self.splat(frame, sources, *direction, segments);
            sums[i / offsets.len()] += radiance;
            out.counters.rays_hit += 1;
            out.counters.splats += u64::from(splats);
            out.counters.uncovered += u64::from(splats == 0);
            out.counters.pieces_dropped += u64::from(segments.dropped);
        }
        out.seconds[1] = started.elapsed().as_secs_f64();
        let started = Instant::now();
        if surface::is_drawn(frame, self.ior) {
            for (i, (direction, segments)) in rays.iter().enumerate() {
                if let Some(triangle) = segments.entry {
                    let triangle = triangle as usize;
                    let point = frame.view.origin + direction * segments.pieces[0].start;
                    let entry = surface::Entry::new(point, self.corners[triangle], self.normals[triangle]);
                    sums[i / offsets.len()] += surface::highlight(frame, self.ior, &entry, *direction);
                }
            }
        }
        for (sum, rays) in sums.iter().zip(rays.chunks(offsets.len())) {
            out.pixels.push((sum * per_pixel).to_array());
            let hits = rays.iter().filter(|(_, s)| s.count > 0).count();
            out.coverage.push(hits as f32 * per_pixel);
        }
        out.seconds[2] = started.elapsed().as_secs_f64();
        out
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
