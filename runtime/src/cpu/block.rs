//! The ray passes over one block of pixels: segments, splats and surface of all its sub-pixel rays, tile by tile.

use super::segments::{self, Scratch, Segments};
use super::shown::Cells;
use super::splat::{self, RayMedium};
use super::tiles::{self, Candidates, Kernel, Rect, TILE};
use super::{CpuRenderer, surface};
use crate::frame::Frame;
use crate::rendered::{Counters, RayResult};
use diaphane_formats::hits::Hits;
use diaphane_formats::slopes::Source;
use glam::Vec3;
use std::time::Instant;

/// What all blocks of a frame share.
pub struct Shared<'a> {
    /// The asset.
    pub renderer: &'a CpuRenderer,
    /// The frame.
    pub frame: &'a Frame,
    /// Source of every sample.
    pub sources: &'a [Source],
    /// Kernels relative to the camera.
    pub kernels: &'a [Kernel],
    /// Places of the rays inside a pixel, 0..1.
    pub offsets: &'a [[f32; 2]],
}

/// One drawn block.
pub struct Block {
    /// Which pixels.
    pub rect: Rect,
    /// Radiance and coverage of its pixels, row by row.
    pub pixels: Vec<(Vec3, f32)>,
    /// What was counted.
    pub counters: Counters,
    /// Where the rays of each offset are inside; empty where nobody counts.
    pub cells: Vec<Cells>,
    /// Seconds in segments, splat, surface.
    pub seconds: [f64; 3],
}

/// A ray of a tile and where it belongs.
struct TileRay {
    /// Pixel inside the block, row by row.
    pixel: usize,
    direction: Vec3,
    segments: Segments,
}

/// Working memory of a block.
#[derive(Default)]
struct Work {
    scratch: Scratch,
    block: Vec<Kernel>,
    tile: Vec<Kernel>,
    candidates: Candidates,
    hits: Hits,
    rays: Vec<TileRay>,
}

impl Shared<'_> {
    /// Draws the pixels of `rect`.
    pub fn draw(&self, rect: Rect) -> Block {
        let pixels = rect.width() * (rect.high[1] - rect.low[1]) as usize;
        let counted = if self.renderer.counting { self.offsets.len() } else { 0 };
        let mut block = Block {
            rect,
            pixels: vec![(Vec3::ZERO, 0.0); pixels],
            counters: Counters { rays: (pixels * self.offsets.len()) as u64, ..Counters::default() },
            cells: (0..counted).map(|_| Cells::of(rect)).collect(),
            seconds: [0.0; 3],
        };
        let per_pixel = 1.0 / self.offsets.len() as f32;
        let renderer = self.renderer;
        let reflects = surface::is_drawn(self.frame, renderer.ior);
        let mut work = self.open(rect);
        for tile in rect.split(TILE) {
            let started = Instant::now();
            self.trace(rect, tile, &mut work, &mut block.cells);
            block.seconds[0] += started.elapsed().as_secs_f64();
            let started = Instant::now();
            self.splat(tile, &mut work, |ray, radiance, splats| {
                block.pixels[ray.pixel].0 += radiance * per_pixel;
                block.pixels[ray.pixel].1 += per_pixel;
                block.counters.rays_hit += 1;
                block.counters.splats += u64::from(splats);
                block.counters.uncovered += u64::from(splats == 0);
                block.counters.pieces_dropped += u64::from(ray.segments.dropped);
            });
            block.seconds[1] += started.elapsed().as_secs_f64();
            let started = Instant::now();
            for ray in work.rays.iter().filter(|_| reflects) {
                if let Some(triangle) = ray.segments.entry {
                    let entry =
                        renderer.entry(self.frame, triangle, ray.direction, ray.segments.pieces[0].start);
                    let highlight = surface::highlight(self.frame, renderer.ior, &entry, ray.direction);
                    block.pixels[ray.pixel].0 += highlight * per_pixel;
                }
            }
            block.seconds[2] += started.elapsed().as_secs_f64();
        }
        // Sums of reciprocals may miss 1 by rounding.
        block.pixels.iter_mut().for_each(|(_, c)| *c = if *c > 1.0 - 1e-4 { 1.0 } else { *c });
        block
    }

    /// What the rays of `rect` see, pixel by pixel, for a single offset.
    pub fn rays(&self, rect: Rect) -> Vec<RayResult> {
        let mut work = self.open(rect);
        let mut results = vec![RayResult::default(); rect.width() * (rect.high[1] - rect.low[1]) as usize];
        for tile in rect.split(TILE) {
            self.trace(rect, tile, &mut work, &mut []);
            self.splat(tile, &mut work, |ray, radiance, _| {
                results[ray.pixel] = RayResult {
                    pieces: ray.segments.pieces.map(|p| (p.start, p.end)),
                    boundary: ray.segments.pieces.map(|p| p.boundary),
                    count: ray.segments.count as u32,
                    radiance: radiance.to_array(),
                };
            });
        }
        results
    }

    fn open(&self, rect: Rect) -> Work {
        let mut work = Work::default();
        tiles::select(self.kernels, self.frame, rect, [0.0, f32::INFINITY], &mut work.block);
        work
    }

    /// How far away, at the least and at the most, rays see into the object.
    fn range(&self, rays: &[TileRay]) -> [f32; 2] {
        let pieces = || rays.iter().flat_map(|r| r.segments.pieces());
        let near = pieces().map(|p| p.start).fold(f32::INFINITY, f32::min);
        // Every piece is looked into.
        let far = pieces().map(|p| p.end.min(p.start + self.renderer.sight)).fold(0.0, f32::max);
        [near, far]
    }

    /// Fills `work.rays` with the rays of a tile that hit the mesh.
    fn trace(&self, block: Rect, tile: Rect, work: &mut Work, cells: &mut [Cells]) {
        let (frame, renderer) = (self.frame, self.renderer);
        work.rays.clear();
        for y in tile.low[1]..tile.high[1] {
            for x in tile.low[0]..tile.high[0] {
                let pixel = (y - block.low[1]) as usize * block.width() + (x - block.low[0]) as usize;
                for (k, [dx, dy]) in self.offsets.iter().enumerate() {
                    let direction =
                        frame.view.direction(x as f32 + dx, y as f32 + dy, frame.width, frame.height);
                    let origin = frame.view.origin;
                    let segments =
                        segments::trace(&renderer.accel, renderer.ior, origin, direction, &mut work.scratch);
                    if segments.count > 0 {
                        if let Some(cells) = cells.get_mut(k) {
                            cells.add([x - block.low[0], y - block.low[1]], segments.pieces());
                        }
                        work.rays.push(TileRay { pixel, direction, segments });
                    }
                }
            }
        }
    }

    /// Sums the samples along the rays of a tile.
    fn splat(&self, tile: Rect, work: &mut Work, mut visit: impl FnMut(&TileRay, Vec3, u32)) {
        if work.rays.is_empty() {
            return;
        }
        let renderer = self.renderer;
        let range = self.range(&work.rays);
        tiles::select(&work.block, self.frame, tile, range, &mut work.tile);
        work.candidates.fill(&work.tile, &renderer.cloud);
        let medium = RayMedium { extinction: renderer.extinction, density: renderer.density.as_ref() };
        for ray in &work.rays {
            work.candidates.along(ray.direction, self.sources, &mut work.hits);
            let origin = self.frame.view.origin;
            let (radiance, splats) = splat::ray(&work.hits, medium, origin, ray.direction, &ray.segments);
            visit(ray, radiance, splats);
        }
    }
}
