//! The methods that are compared, each a way from a frame to a picture and its time.

use super::cells::{Cell, scene};
use super::median;
use anyhow::Result;
use diaphane_formats::asset::Asset;
use diaphane_formats::picture::Picture;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::rivals::{Drawn, Rivals, Settings};
use diaphane_runtime::player::{LightMode, Player};
use serde::Serialize;
use std::sync::Arc;

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The player.
    Splats,
    /// Shadow rays from steps along the camera's rays.
    March,
    /// Shadow rays from the nodes of a grid.
    Grid,
}

impl Method {
    pub const ALL: [Self; 3] = [Self::Splats, Self::March, Self::Grid];

    pub fn name(self) -> &'static str {
        match self {
            Self::Splats => "splats",
            Self::March => "ray marcher",
            Self::Grid => "3D grid",
        }
    }
}

/// How finely a rival works.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Effort {
    /// Steps of a camera ray.
    pub steps: u32,
    /// Voxels between two lookups of the density; 1 where it is uniform.
    pub stride: f32,
    /// Nodes of the grid along the longest edge; 0 without.
    pub side: u32,
    /// Of these, those that are lit in every frame.
    pub lit: usize,
}

impl Effort {
    fn settings(self) -> Settings {
        Settings { steps: self.steps, stride: self.stride }
    }

    /// Shadow rays of a frame with so many pixels and lights, each as long as `stride` makes it.
    pub fn work(self, pixels: f64, lights: usize) -> f64 {
        let places = if self.side > 0 { self.lit as f64 } else { pixels * f64::from(self.steps) };
        places * lights as f64 / f64::from(self.stride)
    }
}

/// Everything that draws.
pub struct Contest<'a> {
    asset: &'a Asset,
    player: &'a mut Player,
    pub rivals: Rivals,
    /// Whether times are the adapter's, not the wall clock's.
    pub by_adapter: bool,
    side: u32,
    /// Milliseconds of a shadow ray, by the last march.
    ray_ms: f64,
}

impl<'a> Contest<'a> {
    pub fn new(asset: &'a Asset, player: &'a mut Player) -> Result<Self> {
        let rivals = Rivals::new(asset)?;
        let mut contest = Self { asset, player, by_adapter: false, rivals, side: 0, ray_ms: 0.0 };
        // Clocks of software adapters miss parts of a pass. The march tells what a ray costs, too.
        let first = &contest.frames(1, [128; 2], 1)?[0];
        let drawn = contest.rivals.march(first, Settings { steps: 1, stride: 1.0 })?;
        contest.by_adapter = drawn.clock_ms.is_some() && !contest.rivals.is_software();
        contest.march(first, Effort { steps: 2, stride: 1.0, side: 0, lit: 0 })?;
        Ok(contest)
    }

    /// So many views along the orbit, and one before them; no surface reflection.
    pub fn frames(&self, lights: usize, size: [u32; 2], views: u32) -> Result<Vec<Frame>> {
        let at = |k: u32| {
            let turn = f64::from(k) / f64::from(views + 1);
            let mut scene = scene(self.asset, Cell::of(lights, size), turn);
            scene.surface.reflection = false;
            Ok(Frame::new(&scene, &self.asset.info)?)
        };
        (0..=views).map(at).collect()
    }

    /// A picture and its milliseconds.
    pub fn draw(&mut self, method: Method, frame: &Frame, effort: Effort) -> Result<(Picture, f64)> {
        match method {
            Method::Splats => self.splats(frame),
            Method::March => self.march(frame, effort),
            Method::Grid => {
                if self.side != effort.side {
                    self.lay(effort.side)?;
                }
                let drawn = self.rivals.grid(frame, effort.settings())?;
                Ok(self.timed(drawn))
            }
        }
    }

    /// Lays a grid and returns the number of nodes that are lit.
    pub fn lay(&mut self, side: u32) -> Result<usize> {
        self.side = side;
        Ok(self.rivals.set_grid(side)?)
    }

    /// The median time over all frames but the first.
    pub fn median_ms(&mut self, method: Method, frames: &[Frame], effort: Effort) -> Result<f64> {
        let times: Vec<f64> =
            frames.iter().map(|f| Ok(self.draw(method, f, effort)?.1)).collect::<Result<_>>()?;
        Ok(median(times[1..].to_vec()))
    }

    /// Seconds that a rival's shadow rays will take, by the last march.
    pub fn predicted(&self, effort: Effort, frames: &[Frame]) -> f64 {
        let work = |f: &Frame| effort.work(f64::from(f.width) * f64::from(f.height), f.lights.len());
        1e-3 * self.ray_ms * frames.iter().map(work).sum::<f64>()
    }

    fn splats(&mut self, frame: &Frame) -> Result<(Picture, f64)> {
        let started = std::time::Instant::now();
        let rendered = self.player.render(frame, LightMode::Baked)?;
        let wall = started.elapsed().as_secs_f64() * 1e3;
        let clock = rendered.passes.iter().map(|(_, ms)| ms).sum();
        Ok((Arc::unwrap_or_clone(rendered.picture), if self.by_adapter { clock } else { wall }))
    }

    fn march(&mut self, frame: &Frame, effort: Effort) -> Result<(Picture, f64)> {
        let drawn = self.rivals.march(frame, effort.settings())?;
        let (picture, ms) = self.timed(drawn);
        let pixels = f64::from(frame.width) * f64::from(frame.height);
        self.ray_ms = ms / effort.work(pixels, frame.lights.len()).max(1.0);
        Ok((picture, ms))
    }

    fn timed(&self, drawn: Drawn) -> (Picture, f64) {
        let clock = drawn.clock_ms.filter(|_| self.by_adapter);
        (drawn.picture, clock.unwrap_or(drawn.frame_ms))
    }
}
