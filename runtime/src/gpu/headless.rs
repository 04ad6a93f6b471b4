//! A renderer that owns its device and reads its pictures back.

use super::arrived;
use super::census;
use super::device::{GpuDevice, instance};
use super::faults::wait;
use super::lot::Lot;
use super::pipeline::Pipeline;
use super::readback::Staging;
use super::splatting::SplatPath;
use super::targets::{CENSUS, Targets};
use super::tiles::Tile;
use super::timers::{PASSES, Pass, Timers};
use crate::canvas::{Area, Canvas};
use crate::exact::{ExactDepths, ExactReport};
use crate::frame::Frame;
use crate::placement::covered_squares;
use crate::rendered::{Counters, MAX_PIECES, RayResult, Rendered};
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info};
use diaphane_formats::directions::subpixel_offsets;
use std::time::Instant;
use wgpu::{Buffer, CommandEncoder, Device, Queue};

/// Draws frames of one asset on the GPU, or on a software adapter where that is all there is.
pub struct GpuRenderer {
    owned: GpuDevice,
    renderer: Pipeline,
    timers: Timers,
    name: String,
    tiles: usize,
    slices: u32,
    rays_at_once: usize,
    staging: Staging,
    canvas: Canvas,
}

impl GpuRenderer {
    /// Finds an adapter and uploads an asset. `path` says how kernels are summed; [`SplatPath::best`] if it does not.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] without a usable adapter; an asset that makes no sense or does not fit.
    pub fn new(asset: &Asset, path: Option<SplatPath>) -> Result<Self> {
        Self::on(GpuDevice::open(&instance(), None)?, asset, path)
    }

    /// The same on a device that is there.
    ///
    /// # Errors
    /// An asset that makes no sense or does not fit.
    pub fn on(owned: GpuDevice, asset: &Asset, path: Option<SplatPath>) -> Result<Self> {
        let path = path.unwrap_or_else(|| SplatPath::best(&owned.device));
        let renderer = Pipeline::new(&owned.device, asset, path)?;
        wait(&owned.device)?;
        owned.check()?;
        let timers = Timers::new(&owned.device, &owned.queue, 1);
        let name = owned.describe();
        let (staging, canvas) = (Staging::default(), Canvas::default());
        Ok(Self { owned, renderer, timers, name, tiles: 0, slices: 1, rays_at_once: 1, staging, canvas })
    }

    /// The adapter's name, backend, and whether it is software.
    pub fn adapter(&self) -> &str {
        &self.name
    }

    /// The device with its queue.
    pub(crate) fn owned(&self) -> &GpuDevice {
        &self.owned
    }

    /// The device that it draws with.
    pub fn device(&self) -> &Device {
        &self.owned.device
    }

    /// Whether later frames may keep the sources of an earlier one where lights and material are the same.
    pub fn set_reuse(&mut self, reuse: bool) {
        self.renderer.reuse = reuse;
    }

    /// How kernels are summed.
    pub fn path(&self) -> SplatPath {
        self.renderer.path()
    }

    /// Has as many rays of a pixel drawn side by side (at most 64, and 131,072 pixels) and then as many workgroups share a square of
    /// 16 × 16 pixels, a slice of the samples each, as it takes to make this many workgroups of all squares. At first as suits the
    /// adapter: 1,024, or 0 (never) on a software adapter; without effect on quads.
    pub fn set_workgroups(&mut self, workgroups: u32) {
        self.renderer.set_workgroups(&self.owned.device, workgroups);
    }

    /// Whether samples are left out that no ray can see for what is in front of them, as they are at first: for measuring what
    /// that saves and what it costs.
    pub fn set_sight(&mut self, limited: bool) {
        self.renderer.asset.set_sight(&self.owned.queue, limited);
    }

    /// Bounds the memory that the state of a picture's pixels takes on the adapter, 512 MiB at first; pictures that
    /// need more are drawn in tiles.
    pub fn limit_memory(&mut self, bytes: u64) {
        self.renderer.most_memory = bytes;
    }

    /// Tiles that the last picture was drawn in; more than one where it was too large for the adapter's buffers.
    pub fn tiles(&self) -> usize {
        self.tiles
    }

    /// Slices that the samples of the last picture were cut into, each summed by workgroups of its own: see
    /// [`Self::set_workgroups`].
    pub fn slices(&self) -> u32 {
        self.slices
    }

    /// Rays of a pixel of the last picture that were drawn side by side: see [`Self::set_workgroups`].
    pub fn rays_at_once(&self) -> usize {
        self.rays_at_once
    }

    /// Parts that the mesh is cut into, where it is too large for the adapter's bindings.
    pub fn mesh_parts(&self) -> usize {
        self.renderer.asset.mesh.len()
    }

    /// Slabs that the density grid is cut into, likewise.
    pub fn grid_slabs(&self) -> usize {
        self.renderer.asset.slabs.count()
    }

    /// Parts that the samples are cut into; more than one where they are too many for the adapter's bindings.
    pub fn shards(&self) -> usize {
        self.renderer.asset.shards.len()
    }

    /// Takes extinction and albedo from an edited asset's parameters; the rest of them must be the asset's own.
    pub fn set_material(&mut self, info: &Info) {
        self.renderer.set_material(&self.owned.device, &self.owned.queue, info);
    }

    /// Draws a frame. Times of passes come from the adapter's clock; one that has none gives the single entry
    /// "frame", measured outside.
    ///
    /// # Errors
    /// [`Error::Lost`] when the device is gone, which only another renderer helps against; [`Error::GpuMemory`] where not even
    /// small tiles fit; the GPU failed, or something is too large for it.
    pub fn render(&mut self, frame: &Frame, exact: Option<&ExactDepths>) -> Result<Rendered> {
        self.in_memory(|renderer| renderer.render_once(frame, exact))
    }

    /// Does something again in smaller tiles for as long as the device has no memory for it.
    fn in_memory<T>(&mut self, mut draw: impl FnMut(&mut Self) -> Result<T>) -> Result<T> {
        loop {
            match draw(self) {
                Err(Error::GpuMemory(what)) if self.renderer.shrink(&what) => {}
                done => return done,
            }
        }
    }

    fn render_once(&mut self, frame: &Frame, exact: Option<&ExactDepths>) -> Result<Rendered> {
        let started = Instant::now();
        let offsets = subpixel_offsets(frame.samples_per_pixel as usize);
        let area = self.area(frame);
        let mut picture = self.canvas.take(frame.width, frame.height, area);
        let mut counters = Counters {
            rays: u64::from(frame.width) * u64::from(frame.height) * offsets.len() as u64,
            samples_drawn: self.renderer.asset.samples_drawn,
            ..Counters::default()
        };
        let mut traced = 0;
        let milliseconds = self.draw(frame, exact, &offsets, Wanted::Picture, |tile, data| {
            traced += tile.pixels() * offsets.len() as u64;
            let [hit, dropped, splats, uncovered] =
                arrived::paint(&mut picture, tile, data.radiance, data.counters, offsets.len());
            counters.rays_hit += hit;
            counters.pieces_dropped += dropped;
            counters.splats += splats;
            counters.uncovered += uncovered;
            census::add(&mut counters.census, data.census, offsets.len() as u64, tile.size);
        })?;
        counters.rays_skipped = counters.rays - traced;
        let picture = self.canvas.share(picture, area);
        let mut passes = Pass::named(&milliseconds);
        if passes.is_empty() {
            passes.push(("frame", started.elapsed().as_secs_f64() * 1e3));
        }
        let lights = self.renderer.light_counts();
        Ok(Rendered { picture, counters, lights, exact: ExactReport::default(), passes })
    }

    /// The pixels that are drawn. Out of sight it is one none the less, so that the sources are there.
    fn area(&self, frame: &Frame) -> Area {
        covered_squares(frame, &self.renderer.asset.info).unwrap_or([[0; 2], [1; 2]])
    }

    /// What one ray of every pixel sees, at `offset` inside the pixel (0..1), without highlights: rows one after the
    /// other. For comparing backends.
    ///
    /// # Errors
    /// As [`Self::render`].
    pub fn trace_rays(
        &mut self,
        frame: &Frame,
        exact: Option<&ExactDepths>,
        offset: [f32; 2],
    ) -> Result<Vec<RayResult>> {
        self.in_memory(|renderer| renderer.trace_once(frame, exact, offset))
    }

    fn trace_once(
        &mut self,
        frame: &Frame,
        exact: Option<&ExactDepths>,
        offset: [f32; 2],
    ) -> Result<Vec<RayResult>> {
        let mut plain = frame.clone();
        plain.surface.reflection = false;
        let mut rays = vec![RayResult::default(); frame.width as usize * frame.height as usize];
        self.draw(&plain, exact, &[offset], Wanted::Rays, |tile, data| {
            for (i, sum) in data.radiance.iter().enumerate() {
                let ray = &mut rays[data.place(tile, i, frame.width)];
                ray.radiance = [sum[0], sum[1], sum[2]];
                let mut passed = 1.0;
                for k in 0..MAX_PIECES {
                    let [start, end, entry, exit] = data.pieces[k * data.stride + i];
                    if end > start {
                        ray.pieces[k] = (start, end);
                        ray.boundary[k] = passed * entry;
                        passed *= entry * exit;
                        ray.count += 1;
                    }
                }
            }
        })?;
        Ok(rays)
    }

    /// Draws all tiles and hands each to `take`. Returns milliseconds by pass.
    fn draw(
        &mut self,
        frame: &Frame,
        exact: Option<&ExactDepths>,
        offsets: &[[f32; 2]],
        wanted: Wanted,
        take: impl FnMut(Tile, TileData),
    ) -> Result<[f64; PASSES]> {
        let drawn = self.draw_tiles(frame, exact, offsets, wanted, take);
        let fine = self.owned.check();
        if fine.is_ok() && drawn.is_ok() {
            return drawn;
        }
        self.renderer.forget_targets();
        self.staging = Staging::default();
        // What is on its way comes in, and what was dropped is freed.
        let waited = wait(&self.owned.device);
        // What the device says comes before what follows from it; its loss comes before everything.
        match (self.owned.check(), fine) {
            (Err(lost @ Error::Lost(_)), _) | (_, Err(lost)) | (Err(lost), Ok(())) => Err(lost),
            (Ok(()), Ok(())) => waited.and(drawn),
        }
    }

    fn draw_tiles(
        &mut self,
        frame: &Frame,
        exact: Option<&ExactDepths>,
        offsets: &[[f32; 2]],
        wanted: Wanted,
        mut take: impl FnMut(Tile, TileData),
    ) -> Result<[f64; PASSES]> {
        let area = self.area(frame);
        let GpuDevice { device, queue, .. } = &self.owned;
        let tiles = self.renderer.begin(device, queue, frame, exact, area, offsets.len())?;
        self.tiles = tiles.len();
        if let Some(&tile) = tiles.first() {
            self.rays_at_once = self.renderer.rays_at_once(device, tile, offsets.len());
            self.slices = self.renderer.side_by_side(tile, self.rays_at_once).slices;
        }
        let submissions = if offsets.len() > 1 { offsets.len() as u64 + 1 } else { 1 };
        if self.timers.capacity() < submissions {
            self.timers = Timers::new(device, queue, submissions);
        }
        let mut milliseconds = [0.0; PASSES];
        for (t, &tile) in tiles.iter().enumerate() {
            self.submit(frame, tile, t == 0, offsets, wanted)?;
            self.read(tile, wanted, &mut milliseconds, &mut take)?;
        }
        Ok(milliseconds)
    }

    /// Records and submits all that there is to do for a tile; what is wanted of it is on its way then.
    fn submit(
        &mut self,
        frame: &Frame,
        tile: Tile,
        first: bool,
        offsets: &[[f32; 2]],
        wanted: Wanted,
    ) -> Result<()> {
        let (device, queue, timers) = (&self.owned.device, &self.owned.queue, &mut self.timers);
        let lots = self.renderer.write_rays(device, queue, frame, tile, offsets);
        let all = lots.first().map_or_else(Lot::default, |(lot, _)| *lot);
        timers.restart();
        let mut encoder = device.create_command_encoder(&Default::default());
        self.renderer.record_start(&mut encoder, all);
        if first {
            self.renderer.record_lighting(&mut encoder, timers);
        }
        for &(lot, view) in &lots {
            // Where there are several a submission for each keeps every one short, whatever the adapter's patience.
            if lots.len() > 1 {
                let done =
                    std::mem::replace(&mut encoder, device.create_command_encoder(&Default::default()));
                close(done, timers, queue);
            }
            self.renderer.record_ray(&mut encoder, timers, view, lot, None);
        }
        timers.close(&mut encoder);
        let targets = self.renderer.targets().ok_or_else(nothing)?;
        let size = 16 * all.pixels;
        let mut sources: Vec<(&Buffer, u64)> =
            vec![(&targets.radiance, size), (&targets.counters, size), (&targets.census, CENSUS)];
        sources.extend((wanted == Wanted::Rays).then(|| (&targets.pieces, targets.pieces.size())));
        sources.extend(timers.buffer());
        self.staging.record(device, &mut encoder, &sources);
        queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Waits for a tile and hands it on.
    fn read(
        &mut self,
        tile: Tile,
        wanted: Wanted,
        milliseconds: &mut [f64; PASSES],
        take: &mut impl FnMut(Tile, TileData),
    ) -> Result<()> {
        let stride = self.renderer.targets().map(Targets::stride).ok_or_else(nothing)?;
        let reading = self.timers.reading();
        let owned = &self.owned;
        self.staging.read(&owned.device, |views| {
            let [radiance, counters, census, more @ ..] = views else { return };
            let (pieces, times) = match (wanted, more) {
                (Wanted::Rays, [pieces, times @ ..]) => (bytemuck::cast_slice(pieces), times),
                _ => (&[][..], more),
            };
            if let (Some(reading), Some(times)) = (reading, times.first()) {
                reading.sum(times, milliseconds);
            }
            let data = TileData {
                radiance: bytemuck::cast_slice(radiance),
                counters: bytemuck::cast_slice(counters),
                census: bytemuck::cast_slice(census),
                pieces,
                stride,
            };
            take(tile, data);
        })
    }
}

/// Ends a submission.
fn close(mut encoder: CommandEncoder, timers: &mut Timers, queue: &Queue) {
    timers.close(&mut encoder);
    queue.submit([encoder.finish()]);
}

fn nothing() -> Error {
    Error::Gpu("nothing was drawn".to_owned())
}

/// What is to come back of a tile beside radiance and counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    Picture,
    /// The pieces of every ray, four times as many bytes as the radiance.
    Rays,
}

/// What was read back of a tile: an entry for each pixel, rows one after the other; once more for each of the rays that were drawn
/// side by side.
struct TileData<'a> {
    /// Sum of radiance over the rays.
    radiance: &'a [[f32; 4]],
    /// Rays that hit, pieces dropped, kernels, rays without a kernel.
    counters: &'a [[u32; 4]],
    /// Of the last ray, where they were wanted: piece k of pixel i at `k * stride + i`: start, end, transmittances.
    pieces: &'a [[f32; 4]],
    /// Of all rays.
    census: &'a [u32],
    stride: usize,
}

impl TileData<'_> {
    /// Place of a tile's pixel in a picture of `width` columns.
    fn place(&self, tile: Tile, pixel: usize, width: u32) -> usize {
        let columns = tile.size[0] as usize;
        let (row, column) = (pixel / columns, pixel % columns);
        (tile.start[1] as usize + row) * width as usize + tile.start[0] as usize + column
    }
}
