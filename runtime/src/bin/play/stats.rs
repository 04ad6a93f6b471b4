//! Counts and timings as JSON.

use crate::levels::{Kept, Levels};
use anyhow::Result;
use diaphane_formats::files;
use diaphane_runtime::exact::ExactReport;
use diaphane_runtime::fold::LightCounts;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::gpu::SplatPath;
use diaphane_runtime::player::Player;
use diaphane_runtime::rendered::{Counters, Rendered};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// What `--stats` writes.
#[derive(Serialize)]
pub struct Stats {
    backend: &'static str,
    adapter: String,
    /// How a GPU summed the kernels.
    splat: Option<&'static str>,
    /// Why in this way.
    splat_why: Option<&'static str>,
    /// Whether a GPU's `pass_ms` are by its own clock; else they are one entry, measured outside.
    clock: Option<bool>,
    /// Why another backend draws than would have been preferred, and what else was said on the way.
    notes: Vec<String>,
    /// Parts that the samples were cut into, where a GPU's bindings are too small for all of them.
    shards: Option<usize>,
    width: u32,
    height: u32,
    samples_per_pixel: u32,
    /// Of the level of detail that was drawn last.
    samples: u64,
    samples_drawn: u64,
    /// As played, at density 1, 1 / mesh unit.
    extinction: [f64; 3],
    /// As played.
    albedo: [f64; 3],
    /// Lights drawn, those that stand for the environment included.
    lights: usize,
    /// What became of them in the last frame.
    light_counts: LightCounts,
    /// Exact depths in the last frame: lights, cost, and the error that the baked ones have.
    exact: ExactReport,
    /// Lights of the scene's list.
    scene_lights: usize,
    frames: u32,
    /// Which levels of detail kept the frames in a budget of time, where one was given.
    budget: Option<Kept>,
    /// Mean number of kernels over the rays that hit the object.
    splats_per_pixel: f64,
    frame_ms: Spread,
    /// Over the frames in which a pass ran.
    pass_ms: BTreeMap<&'static str, Spread>,
    /// Of the last frame.
    counters: Counters,
    #[serde(skip)]
    frame_times: Vec<f64>,
    #[serde(skip)]
    pass_times: BTreeMap<&'static str, Vec<f64>>,
}

/// Smallest, middle and largest of some times, milliseconds.
#[derive(Clone, Copy, Default, Serialize)]
struct Spread {
    min: f64,
    median: f64,
    max: f64,
}

impl Spread {
    fn of(times: &[f64]) -> Self {
        let mut sorted = times.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |i: usize| sorted.get(i).copied().unwrap_or_default();
        let (low, high) = (at(sorted.len().saturating_sub(1) / 2), at(sorted.len() / 2));
        Self { min: at(0), median: 0.5 * (low + high), max: at(sorted.len().saturating_sub(1)) }
    }
}

impl Stats {
    /// Before the first frame.
    pub fn new(player: &Player, frame: &Frame, frames: u32) -> Self {
        let (backend, adapter) = player.describe();
        Self {
            backend,
            adapter,
            splat: player.path().map(SplatPath::name),
            splat_why: player.why_path(),
            clock: player.has_clock(),
            notes: Vec::new(),
            shards: player.shards(),
            width: frame.width,
            height: frame.height,
            samples_per_pixel: frame.samples_per_pixel,
            samples: player.info().samples,
            samples_drawn: 0,
            extinction: player.info().extinction,
            albedo: player.info().albedo,
            lights: frame.lights.len(),
            light_counts: LightCounts::default(),
            exact: ExactReport::default(),
            scene_lights: frame.scene_lights,
            frames,
            budget: None,
            splats_per_pixel: 0.0,
            frame_ms: Spread::default(),
            pass_ms: BTreeMap::new(),
            counters: Counters::default(),
            frame_times: Vec::new(),
            pass_times: BTreeMap::new(),
        }
    }

    /// Adds a frame that took `milliseconds`.
    pub fn add(&mut self, milliseconds: f64, rendered: &Rendered) {
        self.frame_times.push(milliseconds);
        for (name, time) in &rendered.passes {
            self.pass_times.entry(name).or_default().push(*time);
        }
        self.counters = rendered.counters;
        self.light_counts = rendered.lights;
        self.exact = rendered.exact.clone();
        self.samples_drawn = rendered.counters.samples_drawn;
        self.splats_per_pixel = rendered.counters.splats_per_ray();
    }

    /// Writes everything to `path`. The backend is the one that drew the last frame of `levels`.
    pub fn write(mut self, levels: &Levels, budget: Option<Kept>, path: &Path) -> Result<()> {
        self.notes = levels.notes().to_vec();
        if let Some(player) = levels.last() {
            (self.backend, self.adapter) = player.describe();
            self.splat = player.path().map(SplatPath::name);
            (self.splat_why, self.clock) = (player.why_path(), player.has_clock());
            self.shards = player.shards();
            self.samples = player.info().samples;
        }
        self.budget = budget;
        self.frame_ms = Spread::of(&self.frame_times);
        self.pass_ms = self.pass_times.iter().map(|(name, times)| (*name, Spread::of(times))).collect();
        let mut json = serde_json::to_string_pretty(&self)?;
        json.push('\n');
        Ok(files::write_atomically(path, json.as_bytes())?)
    }
}
