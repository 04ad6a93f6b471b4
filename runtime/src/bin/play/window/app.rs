//! The window's life: events in, frames out.

use super::Errand;
use super::health::Retries;
use super::levels::Levels;
use super::panel;
use super::reload::PERIOD;
use super::screen::Screen;
use super::session::Session;
use super::sources::Sources;
use anyhow::{Result, anyhow};
use diaphane_formats::asset::Asset;
use diaphane_runtime::Error;
use diaphane_runtime::edit::Edit;
use diaphane_runtime::exact::ExactDepths;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::Statistics;
use diaphane_runtime::player::LightMode;
use std::sync::Arc;
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalPosition};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

/// Everything behind the window.
pub struct App {
    pub(super) session: Session,
    pub(super) title: String,
    pub(super) errand: Option<Errand>,
    pub(super) exposure: Option<f32>,
    /// Milliseconds a frame while something moves, where levels of detail are to keep it.
    budget: Option<f64>,
    pub(super) message: String,
    pub(super) view: Option<View>,
    pub(super) sources: Sources,
    /// When to look at the files again.
    look: Instant,
    /// When the next frame is due, if nothing happens before.
    pub(super) due: Option<Instant>,
    retries: Retries,
    failure: Option<anyhow::Error>,
}

/// What exists while there is a window.
pub(super) struct View {
    pub screen: Screen,
    pub input: egui_winit::State,
    pub levels: Levels,
    pub adapter: String,
    /// Left, top, width, height of the picture in pixels.
    pub place: [f32; 4],
    pub pointer: PhysicalPosition<f64>,
    pub dragging: Option<MouseButton>,
    pub shift: bool,
    pub shown: Option<Shown>,
    pub changed: Instant,
    pub frame_ms: f64,
    pub frames: u32,
    pub statistics: Statistics,
}

/// The picture that is on the screen.
pub(super) struct Shown {
    pub frame: Frame,
    pub mode: LightMode,
    pub edit: Edit,
    pub exact: Option<ExactDepths>,
    /// Of detail.
    pub level: usize,
    pub rays: u32,
}

impl Shown {
    /// Exact depths are those of all samples: coarser levels, which are shown while something moves, are lit by baked ones.
    pub fn exact(&self) -> Option<&ExactDepths> {
        self.exact.as_ref().filter(|_| self.level == 0)
    }
}

impl App {
    /// A window to come: it opens when the system says so.
    pub fn new(
        session: Session,
        sources: Sources,
        title: String,
        errand: Option<Errand>,
        budget: Option<f64>,
    ) -> Self {
        Self {
            session,
            title,
            errand,
            exposure: None,
            budget,
            message: String::new(),
            view: None,
            sources,
            look: Instant::now() + PERIOD,
            due: None,
            retries: Retries::default(),
            failure: None,
        }
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
        let window =
            event_loop.create_window(attributes).map_err(|e| anyhow!("no window can be opened: {e}"))?;
        self.view = Some(View::new(Arc::new(window), &self.session.asset, self.budget)?);
        Ok(())
    }

    /// Opens the GPU again after it failed, for the same window: once, unless it lasts for a while.
    fn reopen(&mut self, failure: anyhow::Error) -> Result<()> {
        let ours = failure.downcast_ref::<Error>();
        if !matches!(ours, Some(Error::Lost(_) | Error::GpuMemory(_) | Error::Gpu(_))) {
            return Err(failure);
        }
        let Some(old) = self.view.take() else { return Err(failure) };
        if !self.retries.allow(Instant::now()) {
            return Err(failure.context("again soon after it was opened anew"));
        }
        let window = Arc::clone(&old.screen.window);
        let (place, pointer, frames) = (old.place, old.pointer, old.frames);
        // What is left of it may be all the memory that there is, and holds the window's surface.
        drop(old);
        let view = View::new(window, &self.session.asset, self.budget)
            .map_err(|e| anyhow!("{failure}; opened again: {e:#}"))?;
        self.message = format!("the GPU was opened again: {failure}");
        crate::tell(&format!("note: {}", self.message));
        view.screen.window.request_redraw();
        self.view = Some(View { place, pointer, frames, ..view });
        Ok(())
    }

    /// Looks at the files, if it is time to.
    fn look(&mut self) {
        let now = Instant::now();
        if now < self.look {
            return;
        }
        if let Some(message) = self.sources.look(&mut self.session, self.view.as_mut(), self.budget) {
            crate::tell(&format!("note: {message}"));
            self.message = message;
            if let Some(view) = &self.view {
                view.screen.window.request_redraw();
            }
        }
        self.look = Instant::now() + PERIOD;
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
            WindowEvent::RedrawRequested if !view.screen.is_visible() => {}
            WindowEvent::RedrawRequested => {
                if let Err(failure) = self.redraw(event_loop) {
                    self.reopen(failure)?;
                }
            }
            WindowEvent::Occluded(false) => view.screen.window.request_redraw(),
            WindowEvent::ModifiersChanged(modifiers) => view.shift = modifiers.state().shift_key(),
            WindowEvent::MouseInput { state: ElementState::Pressed, button, .. } => {
                view.dragging = view.over_picture().then_some(button);
            }
            WindowEvent::MouseInput { state: ElementState::Released, .. } => view.dragging = None,
            WindowEvent::CursorMoved { position, .. } => {
                let height = f64::from(view.place[3].max(1.0));
                let (right, down) =
                    ((position.x - view.pointer.x) / height, (position.y - view.pointer.y) / height);
                view.pointer = position;
                match view.dragging {
                    Some(MouseButton::Left) if !view.shift => self.session.orbit.turn(right, down),
                    Some(_) => self.session.orbit.pan(right, down),
                    None => {}
                }
            }
            WindowEvent::MouseWheel { delta, .. } if view.over_picture() => {
                self.session.orbit.zoom(match delta {
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
    fn new(window: Arc<Window>, asset: &Asset, budget: Option<f64>) -> Result<Self> {
        let screen = Screen::new(window, asset)?;
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
        Ok(Self {
            input,
            levels: Levels::new(asset, budget, screen.gpu.is_software()),
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
        })
    }

    /// Whether the pointer is over the picture and nothing of the panel floats there.
    fn over_picture(&self) -> bool {
        let [left, top, width, height] = self.place.map(f64::from);
        let PhysicalPosition { x, y } = self.pointer;
        let context = self.input.egui_ctx();
        let scale = context.pixels_per_point();
        let at = egui::pos2(x as f32 / scale, y as f32 / scale);
        let floating = context.layer_id_at(at).is_some_and(|l| l.order != egui::Order::Background);
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
        if self.failure.is_some() || event_loop.exiting() {
            return;
        }
        self.look();
        // A wait that has run out asks for the frame it was waiting for.
        if let Some(view) = &self.view
            && self.due.is_some_and(|due| Instant::now() >= due)
        {
            self.due = None;
            view.screen.window.request_redraw();
        }
        let wake = self.due.map_or(self.look, |due| due.min(self.look));
        event_loop.set_control_flow(ControlFlow::WaitUntil(wake));
    }
}
