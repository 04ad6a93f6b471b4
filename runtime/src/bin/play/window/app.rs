//! The window's life: events in, frames out.

use super::Errand;
use super::orbit::Orbit;
use super::pace::Pace;
use super::panel::{self, Action, Numbers, Session};
use super::save::save;
use super::screen::{Painting, Screen};
use anyhow::{Result, anyhow};
use diaphane_formats::asset::Asset;
use diaphane_formats::picture::{Display, write_png_bytes};
use diaphane_formats::scene::{Camera, Scene};
use diaphane_runtime::exact::{DepthTracer, ExactDepths};
use diaphane_runtime::frame::{Frame, FrameLight};
use diaphane_runtime::gpu::{Renderer, Request, Statistics};
use diaphane_runtime::player::LightMode;
use glam::DVec3;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalPosition};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

/// Rays of each pixel that a picture at rest gets.
const RAYS: u32 = 16;
/// How long after the last change a picture counts as moving.
const SETTLING: Duration = Duration::from_millis(250);

/// Everything behind the window.
pub struct App {
    asset: Asset,
    scene: Scene,
    mode: LightMode,
    title: String,
    errand: Option<Errand>,
    first_camera: Camera,
    orbit: Orbit,
    /// Lights that stand for the environment, projected once.
    environment: Vec<FrameLight>,
    tracer: DepthTracer,
    exposure: Option<f32>,
    message: String,
    view: Option<View>,
    failure: Option<anyhow::Error>,
}

/// What exists while there is a window.
struct View {
    screen: Screen,
    input: egui_winit::State,
    pace: Pace,
    adapter: String,
    /// Left, top, width, height of the picture in pixels.
    place: [f32; 4],
    pointer: PhysicalPosition<f64>,
    dragging: Option<MouseButton>,
    shift: bool,
    shown: Option<Shown>,
    changed: Instant,
    frame_ms: f64,
    frames: u32,
    statistics: Statistics,
}

/// The picture that is on the screen.
struct Shown {
    frame: Frame,
    mode: LightMode,
    exact: Option<ExactDepths>,
    rays: u32,
}

impl App {
    /// Prepares a session; the window opens when the system says so.
    ///
    /// # Errors
    /// A scene or asset that makes no sense.
    pub fn new(
        asset: Asset,
        mut scene: Scene,
        mode: LightMode,
        title: String,
        errand: Option<Errand>,
    ) -> Result<Self> {
        let all = Frame::new(&scene, &asset.info)?;
        let environment = all.lights[all.scene_lights..].to_vec();
        // From here on the projected lights stand for the picture.
        scene.environment = scene.environment.take().map(|mut e| {
            e.scale = 0.0;
            e
        });
        Ok(Self {
            orbit: Orbit::new(&scene.camera, f64::from(asset.info.diagonal())),
            first_camera: scene.camera,
            environment,
            tracer: DepthTracer::new(&asset)?,
            asset,
            scene,
            mode,
            title,
            errand,
            exposure: None,
            message: String::new(),
            view: None,
            failure: None,
        })
    }

    /// How it went.
    ///
    /// # Errors
    /// What made the window close before its time.
    pub fn finish(self) -> Result<()> {
        match (self.failure, self.errand) {
            (Some(failure), _) => Err(failure),
            (None, Some(_)) => Err(anyhow!("the window was closed before its screenshot was taken")),
            (None, None) => Ok(()),
        }
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let size = LogicalSize::new(720.0 + f64::from(panel::WIDTH), 720.0);
        let attributes = Window::default_attributes()
            .with_title(format!("{} - diaphane", self.title))
            .with_inner_size(size);
        let window = event_loop
            .create_window(attributes)
            .map_err(|e| anyhow!("no window can be opened: {e}"))?;
        let screen = Screen::new(Arc::new(window), &self.asset)?;
        let side = screen.gpu.device.limits().max_texture_dimension_2d as usize;
        let window = &screen.window;
        let input = egui_winit::State::new(
            egui::Context::default(),
            egui::ViewportId::ROOT,
            window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(side),
        );
        self.view = Some(View {
            input,
            pace: Pace::new(screen.gpu.is_software()),
            adapter: screen.gpu.describe(),
            place: [0.0; 4],
            pointer: PhysicalPosition::default(),
            dragging: None,
            shift: false,
            shown: None,
            changed: Instant::now(),
            frame_ms: 0.0,
            frames: 0,
            statistics: Statistics::default(),
            screen,
        });
        Ok(())
    }

    /// One frame: the panel, rays of the picture, and the screenshot when it is due.
    fn redraw(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let started = Instant::now();
        let (output, action) = self.run_panel();
        let Some(view) = &mut self.view else { return Ok(()) };
        let context = view.input.egui_ctx().clone();
        view.input
            .handle_platform_output(&view.screen.window, output.platform_output);
        let frame = build_frame(
            &mut self.scene,
            &self.orbit,
            &self.environment,
            view.place,
            1,
            &self.asset,
        )?;
        let moving = self.errand.is_none() && view.changed.elapsed() < SETTLING;
        let pixels = u64::from(frame.width) * u64::from(frame.height);
        let divisor = view.pace.divisor(pixels, moving);
        let frame = build_frame(
            &mut self.scene,
            &self.orbit,
            &self.environment,
            view.place,
            divisor,
            &self.asset,
        )?;
        let same = view
            .shown
            .as_ref()
            .is_some_and(|s| s.frame == frame && s.mode == self.mode);
        if !same {
            let stays = view.shown.as_ref().is_some_and(|s| {
                s.mode == self.mode
                    && Frame {
                        width: s.frame.width,
                        height: s.frame.height,
                        ..frame.clone()
                    } == s.frame
            });
            if !stays {
                view.changed = Instant::now();
            }
            let exact = trace(&mut self.tracer, &frame, self.mode, &self.asset);
            view.shown = Some(Shown {
                frame,
                mode: self.mode,
                exact,
                rays: 0,
            });
        }
        let Some(shown) = &mut view.shown else {
            return Ok(());
        };
        if self.exposure.is_none() {
            self.exposure = Some(measure_exposure(&mut view.screen, shown)?);
            shown.rays = 0;
        }
        let exposure = self.exposure.unwrap_or(1.0);
        let wanted = if view.screen.renderer.tiles() > 1 { 1 } else { RAYS };
        let rays = shown.rays..(shown.rays + 1).min(wanted).max(shown.rays);
        let request = Request {
            frame: &shown.frame,
            exact: shown.exact.as_ref(),
            rays: rays.clone(),
            exposure,
        };
        let capture = self.errand.as_ref().is_some_and(|e| view.frames + 1 >= e.frames);
        let painting = Painting {
            request: (!rays.is_empty()).then_some(request),
            exposure,
            place: view.place,
            textures: output.textures_delta,
            jobs: context.tessellate(output.shapes, output.pixels_per_point),
            pixels_per_point: output.pixels_per_point,
            capture,
        };
        let captured = view.screen.paint(painting)?;
        shown.rays = rays.end;
        view.statistics = view.screen.renderer.statistics().clone();
        view.frames += 1;
        view.frame_ms = started.elapsed().as_secs_f64() * 1e3;
        // The first frame also compiles what the driver left for later.
        if !rays.is_empty() && view.frames > 1 {
            view.pace.learn(
                u64::from(shown.frame.width) * u64::from(shown.frame.height),
                view.frame_ms,
            );
        }
        if let Some((width, height, rgb)) = captured
            && let Some(errand) = self.errand.take()
        {
            write_png_bytes(&errand.file, width, height, &rgb)?;
            event_loop.exit();
            return Ok(());
        }
        if let Some(action) = action {
            self.act(action)?;
        }
        self.plan(
            event_loop,
            output.viewport_output.values().map(|v| v.repaint_delay).min(),
        );
        Ok(())
    }

    /// When the next frame is due: at once while there is something to refine, else when the panel or the picture's
    /// settling asks for it.
    fn plan(&self, event_loop: &ActiveEventLoop, panel_delay: Option<Duration>) {
        let Some(view) = &self.view else { return };
        let wanted = if view.screen.renderer.tiles() > 1 { 1 } else { RAYS };
        let settled = view.changed.elapsed() >= SETTLING;
        let unfinished = view.shown.as_ref().is_none_or(|s| s.rays < wanted);
        let delay = panel_delay.unwrap_or(Duration::MAX);
        if self.errand.is_some() || unfinished || delay.is_zero() {
            view.screen.window.request_redraw();
        } else {
            let settle = if settled {
                Duration::MAX
            } else {
                SETTLING.saturating_sub(view.changed.elapsed())
            };
            let wait = Instant::now().checked_add(delay.min(settle));
            event_loop.set_control_flow(wait.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
        }
    }

    fn run_panel(&mut self) -> (egui::FullOutput, Option<Action>) {
        let Some(view) = &mut self.view else {
            return Default::default();
        };
        let input = view.input.take_egui_input(&view.screen.window);
        let context = view.input.egui_ctx().clone();
        let mut action = None;
        let mut exposure = self.exposure.unwrap_or(1.0);
        let mut free = egui::Rect::ZERO;
        let shown = view.shown.as_ref();
        let output = context.run_ui(input, |ui| {
            egui::Panel::right("panel")
                .exact_size(panel::WIDTH)
                .resizable(false)
                .show(ui, |ui| {
                    let mut session = Session {
                        scene: &mut self.scene,
                        fov_degrees: &mut self.orbit.fov_degrees,
                        exposure: &mut exposure,
                        mode: &mut self.mode,
                        refracts: self.asset.info.ior != 1.0,
                        centre: DVec3::from(self.asset.info.centre),
                        diagonal: f64::from(self.asset.info.diagonal()),
                        numbers: Numbers {
                            adapter: &view.adapter,
                            frame_ms: view.frame_ms,
                            size: shown.map_or([0; 2], |s| [s.frame.width, s.frame.height]),
                            rays: shown.map_or(0, |s| s.rays),
                            rays_wanted: RAYS,
                            samples: self.asset.info.samples,
                            statistics: &view.statistics,
                        },
                        message: &self.message,
                    };
                    action = panel::show(ui, &mut session).or(action);
                });
            free = ui.available_rect_before_wrap();
        });
        if self.exposure.is_some() {
            self.exposure = Some(exposure);
        }
        let scale = output.pixels_per_point;
        let [width, height] = view.screen.size().map(|n| n as f32);
        let right = (free.right() * scale).round().clamp(0.0, width);
        view.place = [0.0, 0.0, right, height];
        (output, action)
    }

    fn act(&mut self, action: Action) -> Result<()> {
        let Some(view) = &mut self.view else { return Ok(()) };
        match action {
            Action::ResetCamera => {
                self.orbit = Orbit::new(&self.first_camera, f64::from(self.asset.info.diagonal()))
            }
            Action::MeasureExposure => self.exposure = None,
            Action::SavePng | Action::SaveExr => {
                let picture = view
                    .screen
                    .renderer
                    .read_picture(&view.screen.gpu.device, &view.screen.gpu.queue)?;
                let exposure = self.exposure.filter(|_| action == Action::SavePng);
                // A full disk is no reason to close the window.
                self.message = match save(&self.title, &picture, exposure) {
                    Ok(path) => format!("saved {}", path.display()),
                    Err(e) => format!("not saved: {e}"),
                };
            }
        }
        view.screen.window.request_redraw();
        Ok(())
    }

    fn event(&mut self, event_loop: &ActiveEventLoop, event: WindowEvent) -> Result<()> {
        let Some(view) = &mut self.view else { return Ok(()) };
        let response = view.input.on_window_event(&view.screen.window, &event);
        if response.repaint && !matches!(event, WindowEvent::RedrawRequested) {
            view.screen.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                view.screen.resize(size.width, size.height);
                view.screen.window.request_redraw();
            }
            WindowEvent::RedrawRequested => self.redraw(event_loop)?,
            WindowEvent::ModifiersChanged(modifiers) => view.shift = modifiers.state().shift_key(),
            WindowEvent::MouseInput {
                state: ElementState::Pressed,
                button,
                ..
            } => {
                view.dragging = view.over_picture().then_some(button);
            }
            WindowEvent::MouseInput {
                state: ElementState::Released,
                ..
            } => view.dragging = None,
            WindowEvent::CursorMoved { position, .. } => {
                let height = f64::from(view.place[3].max(1.0));
                let (right, down) = (
                    (position.x - view.pointer.x) / height,
                    (position.y - view.pointer.y) / height,
                );
                view.pointer = position;
                match view.dragging {
                    Some(MouseButton::Left) if !view.shift => self.orbit.turn(right, down),
                    Some(_) => self.orbit.pan(right, down),
                    None => {}
                }
            }
            WindowEvent::MouseWheel { delta, .. } if view.over_picture() => {
                self.orbit.zoom(match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / 50.0,
                });
                view.screen.window.request_redraw();
            }
            _ => {}
        }
        Ok(())
    }

    fn attempt(&mut self, event_loop: &ActiveEventLoop, result: Result<()>) {
        if let Err(failure) = result {
            self.failure.get_or_insert(failure);
            event_loop.exit();
        }
    }
}

impl View {
    /// Whether the pointer is over the picture and nothing of the panel floats there.
    fn over_picture(&self) -> bool {
        let [left, top, width, height] = self.place.map(f64::from);
        let PhysicalPosition { x, y } = self.pointer;
        let context = self.input.egui_ctx();
        let scale = context.pixels_per_point();
        let at = egui::pos2(x as f32 / scale, y as f32 / scale);
        let floating = context
            .layer_id_at(at)
            .is_some_and(|l| l.order != egui::Order::Background);
        x >= left && y >= top && x < left + width && y < top + height && !floating
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.view.is_none() {
            let opened = self.open(event_loop);
            self.attempt(event_loop, opened);
        }
        if let Some(view) = &self.view {
            view.screen.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if self.failure.is_none() && !event_loop.exiting() {
            let done = self.event(event_loop, event);
            self.attempt(event_loop, done);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        // A wait that has run out asks for the frame it was waiting for.
        if let (ControlFlow::WaitUntil(when), Some(view)) = (event_loop.control_flow(), &self.view)
            && Instant::now() >= when
        {
            event_loop.set_control_flow(ControlFlow::Wait);
            view.screen.window.request_redraw();
        }
    }
}

/// The frame for a picture at `place`, with a pixel for `divisor` × `divisor` of the window's.
fn build_frame(
    scene: &mut Scene,
    orbit: &Orbit,
    environment: &[FrameLight],
    [_, _, width, height]: [f32; 4],
    divisor: u32,
    asset: &Asset,
) -> Result<Frame> {
    scene.camera = orbit.camera();
    scene.image.width = (width as u32).div_ceil(divisor).max(1);
    scene.image.height = (height as u32).div_ceil(divisor).max(1);
    scene.image.samples_per_pixel = RAYS;
    let sky = scene.environment.take();
    let frame = Frame::new(scene, &asset.info);
    scene.environment = sky;
    let mut frame = frame?;
    frame.lights.extend_from_slice(environment);
    Ok(frame)
}

/// Exact depths of the lights that `mode` wants them for.
fn trace(tracer: &mut DepthTracer, frame: &Frame, mode: LightMode, asset: &Asset) -> Option<ExactDepths> {
    let wanted = match mode {
        LightMode::Baked => Vec::new(),
        LightMode::Exact => (0..frame.scene_lights).collect(),
        LightMode::Auto => frame.lights_inside(&asset.info),
    };
    (!wanted.is_empty()).then(|| tracer.trace(frame, &wanted))
}

/// The exposure that suits a picture, from a small version of it.
fn measure_exposure(screen: &mut Screen, shown: &Shown) -> Result<f32> {
    let mut small = shown.frame.clone();
    small.width = (small.width / 4).clamp(1, 128);
    small.height = (small.height / 4).clamp(1, 128);
    let Screen { gpu, renderer, .. } = screen;
    draw_now(
        gpu,
        renderer,
        &Request {
            frame: &small,
            exact: shown.exact.as_ref(),
            rays: 0..1,
            exposure: 1.0,
        },
    )?;
    Ok(Display::automatic(&renderer.read_picture(&gpu.device, &gpu.queue)?).exposure)
}

fn draw_now(
    gpu: &diaphane_runtime::gpu::GpuDevice,
    renderer: &mut Renderer,
    request: &Request,
) -> Result<()> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.prepare(&gpu.device, &gpu.queue, &mut encoder, request)?;
    gpu.queue.submit([encoder.finish()]);
    Ok(())
}
