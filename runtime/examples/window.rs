//! The least that shows an asset in a window: `cargo run --release -p diaphane-runtime --example window -- ASSET.dph`.

use anyhow::{Context, Result, anyhow};
use diaphane_formats::asset::{self, Asset};
use diaphane_formats::scene::{Light, Surface};
use diaphane_runtime::gpu::{HostFrame, Options, Renderer};
use diaphane_runtime::placement::{HostCamera, Placement};
use diaphane_runtime::wgpu;
use glam::{DVec3, camera, dcamera};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

fn main() -> Result<()> {
    let path = std::env::args().nth(1).ok_or_else(|| anyhow!("usage: window ASSET.dph"))?;
    let mut app =
        App { asset: asset::read(Path::new(&path))?, shown: None, started: Instant::now(), failure: None };
    EventLoop::new()?.run_app(&mut app)?;
    app.failure.map_or(Ok(()), Err)
}

struct App {
    asset: Asset,
    shown: Option<Shown>,
    started: Instant,
    failure: Option<anyhow::Error>,
}

/// The host's own: window, surface, device; and the renderer.
struct Shown {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
}

impl Shown {
    fn new(event_loop: &ActiveEventLoop, asset: &Asset) -> Result<Self> {
        let window = Arc::new(event_loop.create_window(Window::default_attributes().with_title("diaphane"))?);
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let surface = instance.create_surface(window.clone())?;
        let options =
            wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
        let adapter = pollster::block_on(instance.request_adapter(&options))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
        let size = window.inner_size();
        let config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .context("the adapter cannot show pictures in this window")?;
        surface.configure(&device, &config);
        let mut renderer = Renderer::new(&device, Options::new(config.format))?;
        let id = renderer.add_asset(&device, asset)?;
        renderer.add_instance(id, Placement::IDENTITY)?;
        Ok(Self { window, surface, config, device, queue, renderer })
    }

    fn draw(&mut self, asset: &Asset, seconds: f64) -> Result<()> {
        let texture = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(t) | wgpu::CurrentSurfaceTexture::Suboptimal(t) => t,
            _ => {
                self.surface.configure(&self.device, &self.config);
                return Ok(());
            }
        };
        let size = [self.config.width, self.config.height];
        let (centre, diagonal) = (DVec3::from(asset.info.centre), f64::from(asset.info.diagonal()));
        let eye = centre + 1.6 * diagonal * DVec3::new(0.0, 0.3, 1.0);
        let aspect = size[0] as f32 / size[1] as f32;
        let near = 0.01 * diagonal as f32;
        let projection = camera::rh::proj::directx::perspective_infinite_reverse(0.7, aspect, near);
        let around = diagonal * DVec3::new(seconds.sin(), 0.5, seconds.cos());
        let light =
            Light::Point { position: centre + around, intensity: DVec3::splat(9.0 * diagonal * diagonal) };
        let frame = HostFrame {
            size,
            camera: HostCamera::new(dcamera::rh::view::look_at_mat4(eye, centre, DVec3::Y), projection)?,
            lights: &[light],
            exact: &[],
            environment: &[],
            surface: Surface::DEFAULT,
            depth: None,
            exposure: 1.0,
        };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.renderer.prepare(&self.device, &self.queue, &mut encoder, &frame)?;
        self.renderer.render_to_texture(
            &mut encoder,
            &texture.texture.create_view(&Default::default()),
            true,
        );
        self.queue.submit([encoder.finish()]);
        self.queue.present(texture);
        Ok(())
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        match Shown::new(event_loop, &self.asset) {
            Ok(shown) => self.shown = Some(shown),
            Err(e) => self.fail(event_loop, e),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) if size.width > 0 && size.height > 0 => {
                (shown.config.width, shown.config.height) = (size.width, size.height);
                shown.surface.configure(&shown.device, &shown.config);
            }
            WindowEvent::RedrawRequested => {
                let drawn = shown.draw(&self.asset, self.started.elapsed().as_secs_f64());
                shown.window.request_redraw();
                if let Err(e) = drawn {
                    self.fail(event_loop, e);
                }
            }
            _ => {}
        }
    }
}

impl App {
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: anyhow::Error) {
        self.failure = Some(error);
        event_loop.exit();
    }
}
