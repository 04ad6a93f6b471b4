//! The CPU twin of every pass: fallback where there is no GPU, and oracle where there is one.

mod block;
pub mod lighting;
pub mod segments;
pub mod shown;
pub mod splat;
pub mod surface;
pub mod tiles;

use crate::Result;
use crate::canvas::{Canvas, NOWHERE};
use crate::exact::{ExactDepths, ExactReport};
use crate::fold::{LightCounts, LightingKey, Plan};
use crate::frame::Frame;
use crate::placement::covered_squares;
use crate::rendered::{Counters, RayResult, Rendered};
use crate::usable::{MOST_EXTINCTION, largest_extinction, usable_samples};
use block::{Block, Shared};
use diaphane_formats::asset::{Asset, DensityGrid, Info, Samples};
use diaphane_formats::directions::subpixel_offsets;
use diaphane_formats::reconstruct::Cloud;
use diaphane_formats::slopes::{Source, Stencil, means_share};
use diaphane_formats::visibility::Accel;
use glam::{DVec3, Vec3};
use lighting::Lighting;
use rayon::prelude::*;
use shown::Cells;
use std::time::Instant;
use tiles::{BLOCK, Rect};

/// Draws frames of one asset on the CPU.
pub struct CpuRenderer {
    samples: Samples,
    lighting: Lighting,
    cloud: Cloud,
    stencil: Stencil,
    accel: Accel,
    density: Option<DensityGrid>,
    extinction: Vec3,
    /// s of [`diaphane_formats::slopes`] for baked light.
    means: Vec3,
    ior: f64,
    corners: Vec<[Vec3; 3]>,
    normals: Vec<[Vec3; 3]>,
    samples_drawn: u64,
    info: Info,
    reuse: bool,
    counting: bool,
    /// How far one sees into the medium.
    sight: f32,
    canvas: Canvas,
    /// Sources of the last frame, and what they depend on.
    lit: Option<(LightingKey, Lit)>,
}

/// Sources of all samples.
struct Lit {
    sources: Vec<Source>,
    lights: LightCounts,
}

impl CpuRenderer {
    /// Prepares an asset: hierarchies over mesh and kernels, normals.
    ///
    /// # Errors
    /// An asset whose parts make no sense.
    pub fn new(asset: &Asset) -> Result<Self> {
        asset.validate()?;
        let mesh = asset.mesh()?;
        asset.medium()?;
        let samples = usable_samples(asset);
        Ok(Self {
            lighting: Lighting::new(&asset.info, &asset.samples),
            cloud: Cloud::new(&samples, asset.info.width_factor),
            stencil: Stencil::new(&samples, largest_extinction(&asset.info, asset.density.as_ref())),
            accel: Accel::new(&mesh),
            density: asset.density.clone(),
            extinction: extinction_along(&asset.info, asset.density.is_some()),
            means: means_share(asset.info.ratio()),
            ior: asset.info.ior,
            corners: (0..mesh.triangles.len()).map(|i| mesh.corners(i).map(|p| p.as_vec3())).collect(),
            normals: surface::corner_normals(&mesh),
            samples_drawn: samples.weight.iter().filter(|w| **w > 0.0).count() as u64,
            samples,
            info: asset.info.clone(),
            reuse: false,
            counting: false,
            sight: sight(&asset.info, asset.density.as_ref()),
            canvas: Canvas::default(),
            lit: None,
        })
    }

    /// Whether later frames may keep the sources of an earlier one where lights and material are the same.
    pub fn set_reuse(&mut self, reuse: bool) {
        self.reuse = reuse;
    }

    /// Whether [`crate::rendered::Census`] is wanted.
    pub fn set_counting(&mut self, counting: bool) {
        self.counting = counting;
    }

    /// Takes extinction and albedo from an edited asset's parameters; the rest of them must be the asset's own.
    pub fn set_material(&mut self, info: &Info) {
        self.lighting.set_material(info);
        self.stencil.set_extinction(&self.samples, largest_extinction(info, self.density.as_ref()));
        self.extinction = extinction_along(info, self.density.is_some());
        self.means = means_share(info.ratio());
        self.sight = sight(info, self.density.as_ref());
        self.info = info.clone();
        self.lit = None;
    }

    /// The source of every sample under the frame's lights, see [`lighting`].
    pub fn sources(&self, frame: &Frame, exact: Option<&ExactDepths>) -> Vec<Source> {
        self.light(frame, exact).sources
    }

    fn light(&self, frame: &Frame, exact: Option<&ExactDepths>) -> Lit {
        let plan = Plan::new(frame, &self.info, exact);
        let (values, skipped) = self.lighting.values(&self.samples, frame, exact, &plan);
        let sources = self.stencil.sources(&values, self.means * frame.share_of_means(exact));
        Lit { sources, lights: self.lighting.counts(&plan, skipped) }
    }

    /// Draws a frame.
    pub fn render(&mut self, frame: &Frame, exact: Option<&ExactDepths>) -> Rendered {
        let started = Instant::now();
        let key = LightingKey::new(frame, &self.info, exact);
        let known = self.lit.take().filter(|(known, _)| self.reuse && *known == key);
        let lit_anew = known.is_none();
        let (key, lit) = known.unwrap_or_else(|| (key, self.light(frame, exact)));
        let lighting_ms = milliseconds(started);
        let started = Instant::now();
        let offsets = subpixel_offsets(frame.samples_per_pixel as usize);
        let kernels = tiles::kernels(&self.cloud, frame.view.origin);
        let shared =
            Shared { renderer: self, frame, sources: &lit.sources, kernels: &kernels, offsets: &offsets };
        let seen = covered_squares(frame, &self.info);
        let rects = seen.map_or(Vec::new(), |[low, high]| Rect { low, high }.split(BLOCK));
        let blocks: Vec<Block> =
            rects.into_par_iter().with_max_len(1).map(|rect| shared.draw(rect)).collect();
        let wall = milliseconds(started);
        let area = seen.unwrap_or(NOWHERE);
        let mut picture = self.canvas.take(frame.width, frame.height, area);
        let mut counters = Counters { samples_drawn: self.samples_drawn, ..Counters::default() };
        let mut seconds = [0.0; 3];
        let counted = if self.counting { offsets.len() } else { 0 };
        let mut cells: Vec<Cells> = (0..counted).map(|_| Cells::new(frame)).collect();
        for block in blocks {
            scatter(block.rect, picture.width, &block.pixels, |to, (radiance, _)| {
                picture.pixels[to] = radiance.to_array();
            });
            if let Some(coverage) = &mut picture.coverage {
                scatter(block.rect, picture.width, &block.pixels, |to, (_, covered)| coverage[to] = covered);
            }
            counters = counters.merge(block.counters);
            cells.iter_mut().zip(&block.cells).for_each(|(all, part)| all.put(block.rect, part));
            (0..3).for_each(|k| seconds[k] += block.seconds[k]);
        }
        for (cells, offset) in cells.iter().zip(&offsets) {
            let samples = shown::count(&self.cloud, frame, *offset, cells, self.sight);
            let (tiles, pieces) = cells.tiles();
            // Out of sight the GPU looks at one pixel.
            let size = seen.map_or([1; 2], |[low, high]| [0, 1].map(|c| high[c] - low[c]));
            counters.census.add(1, size, samples, tiles, pieces);
        }
        let rays = (picture.pixels.len() * offsets.len()) as u64;
        counters = Counters { rays, rays_skipped: rays - counters.rays, ..counters };
        // The ray passes run interleaved on all threads: each gets its share of the time that passed on the clock.
        let all = seconds.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let share = |k: usize| wall * seconds[k] / all;
        let mut passes = vec![("segments", share(0)), ("splat", share(1)), ("surface", share(2))];
        if lit_anew {
            passes.insert(0, ("lighting", lighting_ms));
        }
        let lights = lit.lights;
        let picture = self.canvas.share(picture, area);
        self.lit = Some((key, lit));
        Rendered { picture, counters, lights, exact: ExactReport::default(), passes }
    }

    /// What one ray of every pixel sees, at `offset` inside the pixel (0..1): rows one after the other.
    pub fn trace_rays(&self, frame: &Frame, sources: &[Source], offset: [f32; 2]) -> Vec<RayResult> {
        let kernels = tiles::kernels(&self.cloud, frame.view.origin);
        let shared = Shared { renderer: self, frame, sources, kernels: &kernels, offsets: &[offset] };
        let rects = Rect::all(frame).split(BLOCK);
        let blocks: Vec<(Rect, Vec<RayResult>)> =
            rects.into_par_iter().with_max_len(1).map(|rect| (rect, shared.rays(rect))).collect();
        let width = frame.width as usize;
        let mut results = vec![RayResult::default(); width * frame.height as usize];
        for (rect, rays) in blocks {
            scatter(rect, width, &rays, |to, ray| results[to] = ray);
        }
        results
    }

    /// The surface where a ray enters `triangle` at distance `t`.
    fn entry(&self, frame: &Frame, triangle: u32, direction: Vec3, t: f32) -> surface::Entry {
        let triangle = triangle as usize;
        surface::Entry::new(frame.view.origin + direction * t, self.corners[triangle], self.normals[triangle])
    }
}

/// How far one sees into a medium at the most, wherever one enters.
fn sight(info: &Info, grid: Option<&DensityGrid>) -> f32 {
    let least = |g: &DensityGrid| g.values.iter().map(|v| v[0].to_f32()).fold(f32::INFINITY, f32::min);
    shown::sight(extinction_along(info, grid.is_some()).min_element() * grid.map_or(1.0, least))
}

/// κ along camera rays, per channel: at density 1 where there is a grid.
fn extinction_along(info: &Info, grid: bool) -> Vec3 {
    let density = if grid { 1.0 } else { info.uniform_density };
    (DVec3::from(info.extinction) * density).min(DVec3::splat(MOST_EXTINCTION)).as_vec3()
}

/// Calls `put` with the index in a picture of `width` columns and the value of every pixel of a block.
fn scatter<T: Copy>(rect: Rect, width: usize, values: &[T], mut put: impl FnMut(usize, T)) {
    for (row, line) in (rect.low[1] as usize..).zip(values.chunks(rect.width())) {
        for (column, value) in (rect.low[0] as usize..).zip(line) {
            put(row * width + column, *value);
        }
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
