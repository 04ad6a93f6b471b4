//! The window's surface and what is drawn on it: the picture on the left, the panel over it.

use super::health::{Acquired, Health, Next, has_pixels};
use anyhow::{Context, Result, anyhow};
use diaphane_formats::asset::{Asset, Info};
use diaphane_runtime::Error;
use diaphane_runtime::gpu::{GpuDevice, PictureRenderer, Request, guarded, instance, read_texture, wait};
use egui::{ClippedPrimitive, TexturesDelta};
use egui_wgpu::{RendererOptions, ScreenDescriptor};
use std::sync::Arc;
use std::time::{Duration, Instant};
use wgpu::{
    Color, CommandEncoder, CurrentSurfaceTexture, Extent3d, Instance, LoadOp, Operations, PresentMode,
    RenderPassColorAttachment, RenderPassDescriptor, StoreOp, Surface, SurfaceConfiguration, Texture,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
};
use winit::window::Window;

/// Formats of one byte a channel; those without sRGB's curve first, because egui mixes encoded colours.
const FORMATS: [TextureFormat; 4] = [
    TextureFormat::Bgra8Unorm,
    TextureFormat::Rgba8Unorm,
    TextureFormat::Bgra8UnormSrgb,
    TextureFormat::Rgba8UnormSrgb,
];

/// Device, surface and both renderers.
pub struct Screen {
    pub window: Arc<Window>,
    pub gpu: GpuDevice,
    pub renderer: PictureRenderer,
    /// Which level of detail that is, and the renderers of others that were shown.
    level: usize,
    parked: Vec<(usize, PictureRenderer)>,
    instance: Instance,
    surface: Surface<'static>,
    health: Health,
    /// Whether the window has pixels.
    visible: bool,
    config: SurfaceConfiguration,
    panel: egui_wgpu::Renderer,
}

/// What one frame shows.
pub struct Painting<'a> {
    /// Rays to draw first; `None` shows the picture that is there.
    pub request: Option<Request<'a>>,
    /// Factor on its radiance.
    pub exposure: f32,
    /// Left, top, width and height of the picture in the window, pixels.
    pub place: [f32; 4],
    /// The panel.
    pub textures: TexturesDelta,
    pub jobs: Vec<ClippedPrimitive>,
    pub pixels_per_point: f32,
    /// Whether to read back what the window shows.
    pub capture: bool,
}

/// What became of a frame.
pub struct Painted {
    /// What was to be captured.
    pub capture: Option<Capture>,
    /// After how long to try again where the window took no picture.
    pub again: Option<Duration>,
    /// How long the window had no picture to draw on.
    pub waited: Duration,
}

/// What the window showed: columns, rows, RGB bytes.
pub type Capture = (usize, usize, Vec<u8>);

/// What a window is drawn on through.
fn surface(instance: &Instance, window: &Arc<Window>) -> Result<Surface<'static>, Error> {
    instance
        .create_surface(Arc::clone(window))
        .map_err(|_| Error::NoAdapter("no driver can draw on this window".to_owned()))
}

impl Screen {
    /// Opens the best adapter that can show pictures in this window.
    ///
    /// # Errors
    /// No such adapter; an asset that does not fit it.
    pub fn new(window: Arc<Window>, asset: &Asset) -> Result<Self> {
        let instance = instance();
        let surface = surface(&instance, &window)?;
        let gpu = GpuDevice::open(&instance, Some(&surface))?;
        let formats = surface.get_capabilities(&gpu.adapter).formats;
        let format = FORMATS
            .into_iter()
            .find(|f| formats.contains(f))
            .context("the window offers no format of one byte a channel")?;
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&gpu.adapter, size.width.max(1), size.height.max(1))
            .context("the adapter cannot show pictures in this window")?;
        config.format = format;
        config.present_mode = PresentMode::AutoVsync;
        let visible = has_pixels(size.width, size.height);
        if visible {
            surface.configure(&gpu.device, &config);
        }
        let renderer = PictureRenderer::new(&gpu.device, &gpu.queue, asset, format)?;
        let panel = egui_wgpu::Renderer::new(&gpu.device, format, RendererOptions::default());
        gpu.check()?;
        let health = Health::default();
        let (level, parked) = (0, Vec::new());
        Ok(Self { window, gpu, renderer, level, parked, instance, surface, health, visible, config, panel })
    }

    /// Shows another asset; the old one stays where that fails.
    ///
    /// # Errors
    /// An asset that does not fit the adapter.
    pub fn set_asset(&mut self, asset: &Asset) -> Result<()> {
        let next = PictureRenderer::new(&self.gpu.device, &self.gpu.queue, asset, self.config.format)?;
        self.gpu.check()?;
        self.renderer = next;
        self.level = 0;
        self.parked.clear();
        Ok(())
    }

    /// Shows another level of detail of the asset, with its baked material.
    ///
    /// # Errors
    /// A level that there is not, or that does not fit the adapter beside the others.
    pub fn set_level(&mut self, asset: &Asset, level: usize) -> Result<()> {
        let next = match self.parked.iter().position(|(parked, _)| *parked == level) {
            Some(at) => self.parked.swap_remove(at).1,
            None => {
                let alone = asset.level(level)?;
                PictureRenderer::new(&self.gpu.device, &self.gpu.queue, &alone, self.config.format)?
            }
        };
        self.gpu.check()?;
        let mut last = std::mem::replace(&mut self.renderer, next);
        // Others need the memory of its pixels.
        last.rest();
        self.parked.push((std::mem::replace(&mut self.level, level), last));
        Ok(())
    }

    /// The level of detail that is shown.
    pub fn level(&self) -> usize {
        self.level
    }

    /// Whether there is anything to draw on.
    pub fn is_visible(&self) -> bool {
        self.visible
    }

    /// Follows the window's size. One without pixels, as of a minimised window, is drawn on again when it has some.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.visible = has_pixels(width, height);
        if !self.visible {
            return;
        }
        let side = self.gpu.device.limits().max_texture_dimension_2d;
        (self.config.width, self.config.height) = (width.clamp(1, side), height.clamp(1, side));
        self.surface.configure(&self.gpu.device, &self.config);
    }

    /// Columns and rows of the surface.
    pub fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Takes extinction and albedo from an edited asset's parameters, for the next picture.
    pub fn set_material(&mut self, info: &Info) {
        self.renderer.set_material(&self.gpu.device, &self.gpu.queue, info);
    }

    /// Draws rays of a picture without showing it, and waits for them.
    ///
    /// # Errors
    /// The GPU failed.
    pub fn draw(&mut self, request: &Request) -> Result<()> {
        let drawn = self.draw_rays(request);
        self.first_cause(drawn)
    }

    /// What the device says comes before what follows from it.
    fn first_cause<T>(&self, done: Result<T>) -> Result<T> {
        if done.is_err() {
            wait(&self.gpu.device)?;
            self.gpu.check()?;
        }
        done
    }

    fn draw_rays(&mut self, request: &Request) -> Result<()> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let mut encoder = device.create_command_encoder(&Default::default());
        self.renderer.prepare(device, queue, &mut encoder, request)?;
        queue.submit([encoder.finish()]);
        wait(device)?;
        Ok(self.gpu.check()?)
    }

    /// Draws a frame and waits for it.
    ///
    /// # Errors
    /// The GPU failed; the surface did so again and again.
    pub fn paint(&mut self, painting: Painting) -> Result<Painted> {
        let painted = self.paint_frame(painting);
        self.first_cause(painted)
    }

    fn paint_frame(&mut self, painting: Painting) -> Result<Painted> {
        // The panel's renderer has no patience with a device that is gone already.
        self.gpu.check()?;
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let mut encoder = device.create_command_encoder(&Default::default());
        match &painting.request {
            Some(request) => self.renderer.prepare(device, queue, &mut encoder, request)?,
            None => self.renderer.expose(queue, painting.exposure),
        }
        let descriptor = ScreenDescriptor {
            size_in_pixels: [self.config.width, self.config.height],
            pixels_per_point: painting.pixels_per_point,
        };
        let jobs = &painting.jobs;
        guarded(|| {
            for (id, deltas) in &painting.textures.set {
                for delta in deltas {
                    self.panel.update_texture(device, queue, *id, delta);
                }
            }
            // Command buffers come back only from paint callbacks, which the panel does not use.
            let _ = self.panel.update_buffers(device, queue, &mut encoder, jobs, &descriptor);
        })?;
        let asked = Instant::now();
        let texture = self.surface.get_current_texture();
        let waited = asked.elapsed();
        let next = self.health.next(Acquired::from(&texture));
        let shown = match texture {
            CurrentSurfaceTexture::Success(t) | CurrentSurfaceTexture::Suboptimal(t) => Some(t),
            _ => None,
        };
        if let Some(frame) = &shown {
            let view = frame.texture.create_view(&Default::default());
            self.compose(&mut encoder, &view, painting.place, jobs, &descriptor);
        }
        let copy = painting.capture.then(|| self.offscreen());
        if let Some(copy) = &copy {
            let view = copy.create_view(&Default::default());
            self.compose(&mut encoder, &view, painting.place, jobs, &descriptor);
        }
        self.gpu.queue.submit([encoder.finish()]);
        for id in &painting.textures.free {
            self.panel.free_texture(id);
        }
        if let Some(frame) = shown {
            self.window.pre_present_notify();
            self.gpu.queue.present(frame);
        }
        self.renderer.statistics();
        // Waiting keeps slow adapters from falling ever further behind the pointer.
        wait(&self.gpu.device)?;
        let complaint = self.gpu.check();
        if !matches!(complaint, Err(Error::Gpu(_))) || matches!(next, Next::Show | Next::ShowAndConfigure) {
            complaint?;
        }
        let capture = copy.map(|copy| self.read(&copy)).transpose()?;
        Ok(Painted { capture, again: self.mend(next)?, waited })
    }

    /// Does to the surface what is due. Returns after how long to try again where the window took no picture.
    fn mend(&mut self, next: Next) -> Result<Option<Duration>> {
        match next {
            Next::Show => return Ok(None),
            Next::Later(delay) => return Ok(Some(delay)),
            Next::GiveUp => {
                return Err(anyhow!(
                    "the window's surface fails again and again; draw a picture with --output instead"
                ));
            }
            Next::Recreate(_) => self.surface = surface(&self.instance, &self.window)?,
            Next::ShowAndConfigure | Next::Configure(_) => {}
        }
        self.surface.configure(&self.gpu.device, &self.config);
        Ok(match next {
            Next::Configure(delay) | Next::Recreate(delay) => Some(delay),
            _ => None,
        })
    }

    fn compose(
        &self,
        encoder: &mut CommandEncoder,
        view: &TextureView,
        [left, top, width, height]: [f32; 4],
        jobs: &[ClippedPrimitive],
        descriptor: &ScreenDescriptor,
    ) {
        let mut pass = encoder
            .begin_render_pass(&RenderPassDescriptor {
                label: Some("window"),
                color_attachments: &[Some(RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: Operations { load: LoadOp::Clear(Color::BLACK), store: StoreOp::Store },
                })],
                depth_stencil_attachment: None,
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            })
            .forget_lifetime();
        if width >= 1.0 && height >= 1.0 {
            pass.set_viewport(left, top, width, height, 0.0, 1.0);
            self.renderer.render(&mut pass);
        }
        let [columns, rows] = self.size();
        pass.set_viewport(0.0, 0.0, columns as f32, rows as f32, 0.0, 1.0);
        self.panel.render(&mut pass, jobs, descriptor);
    }

    fn offscreen(&self) -> Texture {
        self.gpu.device.create_texture(&TextureDescriptor {
            label: Some("capture"),
            size: Extent3d { width: self.config.width, height: self.config.height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: self.config.format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }

    fn read(&self, texture: &Texture) -> Result<Capture> {
        let bytes = read_texture(&self.gpu.device, &self.gpu.queue, texture)?;
        let swapped = matches!(self.config.format, TextureFormat::Bgra8Unorm | TextureFormat::Bgra8UnormSrgb);
        let rgb = bytes
            .as_chunks::<4>()
            .0
            .iter()
            .flat_map(|&[a, b, c, _]| if swapped { [c, b, a] } else { [a, b, c] });
        Ok((texture.width() as usize, texture.height() as usize, rgb.collect()))
    }
}
