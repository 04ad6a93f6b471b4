//! The renderer for programs that own device and window: it records into their command buffer and draws into their
//! render pass.

use super::census;
use super::faults::allocate;
use super::passes::Recorder;
use super::passes::display::Display;
use super::passes::publish::Publish;
use super::pipeline::Pipeline;
use super::readback;
use super::splatting::SplatPath;
use super::targets::{CENSUS, SUM_FORMAT};
use super::timers::{PASSES, Pass, Reading, Timers};
use crate::exact::ExactDepths;
use crate::frame::Frame;
use crate::rendered::Counters;
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info};
use diaphane_formats::directions::subpixel_offsets;
use diaphane_formats::picture::Picture;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use wgpu::{
    BindGroup, Buffer, CommandEncoder, Device, Extent3d, MapMode, Queue, RenderPass, Texture,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
};

/// What a picture is made of and how it is shown.
pub struct Request<'a> {
    /// Camera, lights, size.
    pub frame: &'a Frame,
    /// Exact depths for some of the lights.
    pub exact: Option<&'a ExactDepths>,
    /// Which of the frame's rays to draw now: a range from 0 begins a new picture, the next ones refine it. A picture
    /// of several tiles is begun anew every time.
    pub rays: Range<u32>,
    /// Factor on the radiance for display.
    pub exposure: f32,
}

/// Times of passes (milliseconds, one ray) and counts of a picture drawn a while ago.
#[derive(Clone, Debug, Default)]
pub struct Statistics {
    /// As in [`crate::rendered::Rendered`]; empty where the adapter has no clock.
    pub passes: Vec<(&'static str, f64)>,
    /// Sums over the rays so far.
    pub counters: Counters,
}

/// Draws one asset with a device that somebody else owns.
pub struct PictureRenderer {
    passes: Pipeline,
    publish: Publish,
    display: Display,
    picture: Option<Shown>,
    timers: Timers,
    pending: Option<Pending>,
    statistics: Statistics,
    /// The latest time of each pass.
    milliseconds: [f64; PASSES],
    tiles: usize,
}

/// The picture that is shown.
struct Shown {
    texture: Texture,
    view: TextureView,
    group: BindGroup,
}

/// Numbers on their way back.
struct Pending {
    counters: Buffer,
    census: Buffer,
    timers: Option<(Buffer, Reading)>,
    /// Copies that arrived; `FAILED` when one did not.
    arrived: Option<Arc<AtomicU32>>,
    rays: u64,
    /// Columns and rows.
    size: [u32; 2],
}

const FAILED: u32 = 1 << 16;

impl PictureRenderer {
    /// Compiles the passes for targets of a format, and uploads an asset.
    ///
    /// # Errors
    /// An asset that makes no sense or is too large for the device.
    pub fn new(device: &Device, queue: &Queue, asset: &Asset, target: TextureFormat) -> Result<Self> {
        let passes = Pipeline::new(device, asset, SplatPath::best(device))?;
        Ok(Self {
            publish: Publish::new(device, passes.common_layout()),
            display: Display::new(device, target),
            picture: None,
            timers: Timers::new(device, queue, 1),
            pending: None,
            statistics: Statistics::default(),
            milliseconds: [0.0; PASSES],
            tiles: 0,
            passes,
        })
    }

    /// Takes extinction and albedo from an edited asset's parameters (see [`crate::edit`]); the rest of them must be
    /// the asset's own. The next picture must begin with its first ray.
    pub fn set_material(&mut self, device: &Device, queue: &Queue, info: &Info) {
        self.passes.set_material(device, queue, info);
    }

    /// Records rays of a picture. [`Self::render`] then shows the mean of all rays so far.
    ///
    /// # Errors
    /// The picture or its lights are too large for the device or its memory. The encoder is then of no use any more.
    pub fn prepare(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        request: &Request,
    ) -> Result<()> {
        let [w, h] = [request.frame.width, request.frame.height];
        let what = || format!("a picture of {w} x {h} pixels");
        let done = allocate(device, what, || self.record(device, queue, encoder, request));
        if done.is_err() {
            self.picture = None;
            self.passes.forget_targets();
        }
        done
    }

    fn record(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        request: &Request,
    ) -> Result<()> {
        let frame = request.frame;
        let side = device.limits().max_texture_dimension_2d;
        if frame.width.max(frame.height) > side {
            return Err(Error::Gpu(format!("the picture is larger than the adapter's {side} pixels")));
        }
        let area = [[0; 2], [frame.width, frame.height]];
        let tiles = self.passes.begin(device, queue, frame, request.exact, area, 1)?;
        self.tiles = tiles.len();
        let first = if tiles.len() > 1 { 0 } else { request.rays.start };
        let offsets = scattered_offsets(frame.samples_per_pixel);
        let offsets =
            &offsets[first as usize..(request.rays.end as usize).clamp(first as usize, offsets.len())];
        self.passes.write_views(device, queue, frame, &tiles, offsets, first);
        self.timers.restart();
        self.display.write(queue, request.exposure);
        self.fit_picture(device, frame.width, frame.height);
        let Some(shown) = &self.picture else { return Ok(()) };
        let timers = &mut self.timers;
        if first == 0 {
            self.passes.record_lighting(encoder, timers);
        }
        for (t, &tile) in tiles.iter().enumerate() {
            if first == 0 {
                self.passes.record_start(encoder, tile);
            }
            let views = t * offsets.len()..(t + 1) * offsets.len();
            for view in views.clone() {
                self.passes.record_ray(encoder, timers, view, tile, None);
            }
            // The last view knows how many rays the picture has now.
            if let (Some(view), Some(targets)) = (views.last(), self.passes.targets()) {
                let group = self.publish.bind(device, targets);
                let mut recorder: Recorder = self.passes.recorder(encoder, timers, view, tile);
                self.publish.record(&mut recorder, &group, tile, &shown.view);
            }
        }
        timers.close(encoder);
        if self.pending.is_none() && tiles.len() == 1 {
            let rays = u64::from(first) + offsets.len() as u64;
            self.ask(device, encoder, rays * u64::from(frame.width) * u64::from(frame.height));
        }
        Ok(())
    }

    /// Forgets the picture and what it took to draw it, until the next one.
    pub fn rest(&mut self) {
        self.picture = None;
        self.passes.forget_targets();
    }

    /// Changes the exposure of the picture that is there.
    pub fn expose(&self, queue: &Queue, exposure: f32) {
        self.display.write(queue, exposure);
    }

    /// Fills the pass's viewport with the picture.
    pub fn render(&self, pass: &mut RenderPass<'_>) {
        if let Some(shown) = &self.picture {
            self.display.draw(pass, &shown.group);
        }
    }

    /// Tiles of the last picture; a picture of several cannot be refined ray by ray.
    pub fn tiles(&self) -> usize {
        self.tiles
    }

    /// Reads the picture back: radiance, and coverage. Waits for the device.
    ///
    /// # Errors
    /// The device failed, or nothing was drawn yet.
    pub fn read_picture(&self, device: &Device, queue: &Queue) -> Result<Picture> {
        let shown = self.picture.as_ref().ok_or_else(|| Error::Gpu("nothing was drawn yet".to_owned()))?;
        let bytes = readback::texture(device, queue, &shown.texture)?;
        let texels: Vec<[f32; 4]> = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
        let mut picture = Picture::new(shown.texture.width() as usize, shown.texture.height() as usize);
        for (pixel, [r, g, b, _]) in picture.pixels.iter_mut().zip(&texels) {
            *pixel = [*r, *g, *b];
        }
        picture.coverage = Some(texels.iter().map(|t| t[3]).collect());
        Ok(picture)
    }

    /// The latest numbers that came back. Call it after submitting, once a frame: it never waits.
    pub fn statistics(&mut self) -> &Statistics {
        let Some(pending) = &mut self.pending else {
            return &self.statistics;
        };
        let copies = || {
            [&pending.counters, &pending.census].into_iter().chain(pending.timers.as_ref().map(|(b, _)| b))
        };
        match &pending.arrived {
            None => {
                let arrived = Arc::new(AtomicU32::new(0));
                for copy in copies() {
                    let arrived = Arc::clone(&arrived);
                    copy.map_async(MapMode::Read, .., move |result| {
                        arrived.fetch_add(if result.is_ok() { 1 } else { FAILED }, Ordering::AcqRel);
                    });
                }
                pending.arrived = Some(arrived);
            }
            Some(arrived) => {
                let count = arrived.load(Ordering::Acquire);
                if count >= FAILED {
                    self.pending = None;
                } else if count as usize == copies().count() {
                    self.take_numbers();
                }
            }
        }
        &self.statistics
    }

    fn take_numbers(&mut self) {
        let Some(pending) = self.pending.take() else {
            return;
        };
        let samples_drawn = self.passes.asset.samples_drawn;
        let mut counters = Counters { rays: pending.rays, samples_drawn, ..Counters::default() };
        if let Ok(view) = pending.counters.get_mapped_range(..) {
            for [hit, dropped, splats, uncovered] in
                view.chunks_exact(16).map(bytemuck::pod_read_unaligned::<[u32; 4]>)
            {
                counters.rays_hit += u64::from(hit);
                counters.pieces_dropped += u64::from(dropped);
                counters.splats += u64::from(splats);
                counters.uncovered += u64::from(uncovered);
            }
            if let Ok(view) = pending.census.get_mapped_range(..) {
                let words: Vec<u32> = view.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
                let views = pending.rays / pending.size.map(u64::from).iter().product::<u64>().max(1);
                census::add(&mut counters.census, &words, views, pending.size);
            }
            self.statistics.counters = counters;
        }
        if let Some((buffer, reading)) = &pending.timers
            && let Ok(view) = buffer.get_mapped_range(..)
        {
            let mut milliseconds = [0.0; PASSES];
            reading.sum(&view, &mut milliseconds);
            // Passes that run once a picture keep their time while others are drawn again.
            for (latest, now) in self.milliseconds.iter_mut().zip(milliseconds) {
                *latest = if now > 0.0 { now } else { *latest };
            }
            self.statistics.passes = Pass::named(&self.milliseconds);
        }
    }

    /// Records copies of counters and times.
    fn ask(&mut self, device: &Device, encoder: &mut CommandEncoder, rays: u64) {
        let Some(targets) = self.passes.targets() else {
            return;
        };
        let size = 16 * targets.lot.pixels;
        let times = self.timers.buffer();
        let times = times.map(|(buffer, size)| readback::copy(device, encoder, buffer, size));
        self.pending = Some(Pending {
            counters: readback::copy(device, encoder, &targets.counters, size),
            census: readback::copy(device, encoder, &targets.census, CENSUS),
            size: targets.lot.size,
            timers: times.zip(self.timers.reading()),
            arrived: None,
            rays,
        });
    }

    fn fit_picture(&mut self, device: &Device, width: u32, height: u32) {
        if self.picture.as_ref().is_some_and(|s| s.texture.width() == width && s.texture.height() == height) {
            return;
        }
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("picture"),
            size: Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: SUM_FORMAT,
            usage: TextureUsages::RENDER_ATTACHMENT
                | TextureUsages::TEXTURE_BINDING
                | TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        let group = self.display.bind(device, &view);
        self.picture = Some(Shown { texture, view, group });
    }
}

/// The positions of [`subpixel_offsets`] in an order whose first few are spread over the pixel already.
fn scattered_offsets(count: u32) -> Vec<[f32; 2]> {
    let offsets = subpixel_offsets(count as usize);
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    // Steps of about the golden section, without a common divisor, meet every position once.
    let n = offsets.len();
    let step = (n * 382 / 1000..=n).find(|&s| s > 0 && gcd(s, n) == 1).unwrap_or(1);
    (0..n).map(|i| offsets[(i + 1) * step % n]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_position_once() {
        for count in 1..70 {
            let mut scattered = scattered_offsets(count);
            let mut plain = subpixel_offsets(count as usize);
            scattered.sort_by(|a, b| a.partial_cmp(b).unwrap());
            plain.sort_by(|a, b| a.partial_cmp(b).unwrap());
            assert_eq!(scattered, plain, "{count}");
        }
    }
}
