//! The window's frames: panel, picture, screenshots.

use super::app::{App, Shown};
use super::levels::Chosen;
use super::panel::{self, Action, Contents, Numbers};
use super::save::save;
use super::screen::{Painting, Screen};
use super::session::RAYS;
use anyhow::Result;
use diaphane_formats::picture::{Display, Picture, write_png_bytes};
use diaphane_runtime::exact::ExactDepths;
use diaphane_runtime::frame::{Frame, View};
use diaphane_runtime::gpu::Request;
use diaphane_runtime::player::LightMode;
use glam::DVec3;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;

/// Milliseconds that a saved picture may take.
const SAVING: f64 = 5_000.0;
/// How long after the last change a picture counts as moving.
const SETTLING: Duration = Duration::from_millis(250);

impl App {
    /// One frame: the panel, rays of the picture, and the screenshot when it is due.
    pub(super) fn redraw(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let started = Instant::now();
        let (output, action) = self.run_panel();
        let Some(view) = &mut self.view else { return Ok(()) };
        let context = view.input.egui_ctx().clone();
        view.input.handle_platform_output(&view.screen.window, output.platform_output);
        let whole = self.session.frame(view.place, 1)?;
        let (mode, edit) = (self.session.mode, self.session.edit);
        // A finer or coarser picture of the same is no change; rounding its size moves the right edge a little.
        let stays = view.shown.as_ref().is_some_and(|s| {
            let (width, height) = (s.frame.width, s.frame.height);
            let seen = View { right: s.frame.view.right, ..whole.view };
            s.mode == mode
                && s.edit == edit
                && Frame { width, height, view: seen, ..whole.clone() } == s.frame
        });
        if !stays {
            view.changed = Instant::now();
        }
        let moving = self.errand.is_none() && view.changed.elapsed() < SETTLING;
        // Lights inside have no use of coarser levels, which play baked depths.
        let whole_only =
            mode != LightMode::Baked && !whole.lights_inside(&self.session.asset.info).is_empty();
        let chosen = view.levels.choose(moving, whole_only, &whole, &self.session.asset.info);
        let Chosen { level, divisor } = chosen;
        let frame = if divisor == 1 { whole } else { self.session.frame(view.place, divisor)? };
        let same = view
            .shown
            .as_ref()
            .is_some_and(|s| s.frame == frame && s.mode == mode && s.edit == edit && s.level == level);
        let switched = view.screen.level() != level;
        if !same {
            if switched {
                view.screen.set_level(&self.session.asset, level)?;
            }
            if switched || view.shown.as_ref().is_none_or(|s| s.edit != edit) {
                view.screen.set_material(&view.levels.info(level, self.session.set_material()?));
            }
        }
        let exact = self.session.advance(&frame, view.frame_ms);
        // Light that goes from baked to exact depths is drawn anew, but nothing moves.
        if !same || (level == 0 && view.shown.as_ref().is_some_and(|s| s.exact != exact)) {
            view.shown = Some(Shown { frame, mode, edit, exact, level, rays: 0 });
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
        let request = Request { frame: &shown.frame, exact: shown.exact(), rays: rays.clone(), exposure };
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
        let painted = view.screen.paint(painting)?;
        shown.rays = rays.end;
        view.statistics = view.screen.renderer.statistics().clone();
        view.frames += 1;
        view.frame_ms = started.elapsed().as_secs_f64() * 1e3;
        // The first frame also compiles what the driver left for later, as does the first one of a level.
        if !rays.is_empty() && view.frames > 1 && !switched {
            view.levels.learn(chosen, moving, view.frame_ms - painted.waited.as_secs_f64() * 1e3);
        }
        if let Some((width, height, rgb)) = painted.capture
            && let Some(errand) = self.errand.take()
        {
            write_png_bytes(&errand.file, width, height, &rgb)?;
            event_loop.exit();
            return Ok(());
        }
        if let Some(action) = action {
            self.act(action)?;
        }
        let panel_delay = output.viewport_output.values().map(|v| v.repaint_delay).min();
        self.plan(painted.again, panel_delay, moving);
        Ok(())
    }

    /// When the next frame is due: at once while there is something to refine, else when the panel or the picture's
    /// settling asks for it. Where the window took no picture, after `again`. What was drawn as `moving` is drawn once more as soon as it
    /// has settled.
    fn plan(&mut self, again: Option<Duration>, panel_delay: Option<Duration>, moving: bool) {
        let Some(view) = &self.view else { return };
        let wanted = if view.screen.renderer.tiles() > 1 { 1 } else { RAYS };
        let settled = view.changed.elapsed() >= SETTLING;
        let unfinished = view.shown.as_ref().is_none_or(|s| s.rays < wanted);
        let delay = panel_delay.unwrap_or(Duration::MAX);
        self.due = None;
        if let Some(again) = again.filter(|again| !again.is_zero()) {
            self.due = Some(Instant::now() + again);
        } else if self.errand.is_some()
            || again.is_some()
            || unfinished
            || (moving && settled)
            || delay.is_zero()
            || self.session.is_busy()
        {
            view.screen.window.request_redraw();
        } else {
            let settle =
                if settled { Duration::MAX } else { SETTLING.saturating_sub(view.changed.elapsed()) };
            self.due = Instant::now().checked_add(delay.min(settle));
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
        let exact = self.session.exact_report().clone();
        let output = context.run_ui(input, |ui| {
            egui::Panel::right("panel").exact_size(panel::WIDTH).resizable(false).show(ui, |ui| {
                let mut contents = Contents {
                    scene: &mut self.session.scene,
                    fov_degrees: &mut self.session.orbit.fov_degrees,
                    exposure: &mut exposure,
                    mode: &mut self.session.mode,
                    edit: &mut self.session.edit,
                    baked_albedo: DVec3::from(self.session.asset.info.albedo),
                    refracts: self.session.asset.info.ior != 1.0,
                    centre: DVec3::from(self.session.asset.info.centre),
                    diagonal: f64::from(self.session.asset.info.diagonal()),
                    numbers: Numbers {
                        adapter: &view.adapter,
                        frame_ms: view.frame_ms,
                        size: shown.map_or([0; 2], |s| [s.frame.width, s.frame.height]),
                        rays: shown.map_or(0, |s| s.rays),
                        rays_wanted: RAYS,
                        samples: self.session.asset.info.samples,
                        level: view.levels.are_governed().then_some(view.screen.level()),
                        statistics: &view.statistics,
                        exact: &exact,
                    },
                    message: &self.message,
                };
                action = panel::show(ui, &mut contents).or(action);
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
            Action::ResetCamera => self.session.orbit = self.session.first_orbit,
            Action::MeasureExposure => self.exposure = None,
            Action::SavePng | Action::SaveExr => {
                let rays = view.levels.expected().map_or(f64::from(RAYS), |ms| SAVING / ms.max(1e-3));
                let mut frame = self.session.frame(view.place, 1)?;
                frame.samples_per_pixel = (rays as u32).clamp(1, RAYS);
                let exact = view.shown.take().and_then(|s| s.exact);
                if view.screen.level() > 0 {
                    view.screen.set_level(&self.session.asset, 0)?;
                    view.screen.set_material(&self.session.set_material()?);
                }
                let picture = draw_fine(&mut view.screen, &frame, exact.as_ref())?;
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
}

/// The exposure that suits a picture, from a small version of it.
fn measure_exposure(screen: &mut Screen, shown: &Shown) -> Result<f32> {
    let mut small = shown.frame.clone();
    small.width = (small.width / 4).clamp(1, 128);
    small.height = (small.height / 4).clamp(1, 128);
    let request = Request { frame: &small, exact: shown.exact(), rays: 0..1, exposure: 1.0 };
    screen.draw(&request)?;
    Ok(Display::automatic(&screen.renderer.read_picture(&screen.gpu.device, &screen.gpu.queue)?).exposure)
}

/// All rays of a frame, whatever it takes.
fn draw_fine(screen: &mut Screen, frame: &Frame, exact: Option<&ExactDepths>) -> Result<Picture> {
    let all = frame.samples_per_pixel;
    let request = |rays| Request { frame, exact, rays, exposure: 1.0 };
    screen.draw(&request(0..1))?;
    if screen.renderer.tiles() > 1 {
        screen.draw(&request(0..all))?;
    } else {
        (1..all).try_for_each(|k| screen.draw(&request(k..k + 1)))?;
    }
    Ok(screen.renderer.read_picture(&screen.gpu.device, &screen.gpu.queue)?)
}
