//! Players of an asset's levels of detail: one level for all frames, or each frame's by a budget of time.

use crate::args::{Args, LevelArg};
use anyhow::{Context, Result};
use diaphane_formats::asset::Asset;
use diaphane_runtime::detail::{Fineness, Governor, details, pixels_at_nearest};
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::{LightMode, Player};
use diaphane_runtime::rendered::Rendered;
use serde::Serialize;
use std::time::Instant;

/// Draws a frame again and again.
pub struct Levels<'a> {
    args: &'a Args,
    asset: Asset,
    /// By level, each made when it is first needed, with the level's asset; without a budget only the first one, of the whole asset.
    players: Vec<Option<(Option<Asset>, Player)>>,
    level: usize,
    budget: Option<Budget>,
    /// What was said of the backend, each once.
    notes: Vec<String>,
}

/// How a budget is kept.
struct Budget {
    governor: Governor,
    /// What a fineness comes to in this picture.
    choose: Box<dyn Fn(Fineness) -> usize>,
    kept: Kept,
}

/// What `--stats` tells of a budget.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Kept {
    /// Milliseconds that a frame was to take.
    milliseconds: f64,
    /// Of the last frame.
    level: usize,
    /// Frames drawn with each level.
    frames: Vec<u32>,
}

impl<'a> Levels<'a> {
    /// The levels that `args` ask for; says which one is chosen for all frames.
    pub fn new(args: &'a Args, asset: Asset, frame: &Frame) -> Result<Self> {
        let mut levels = Self { args, asset, players: vec![None], level: 0, budget: None, notes: Vec::new() };
        match (args.level, args.budget) {
            (Some(LevelArg::Auto), Some(milliseconds)) => levels.keep_to(milliseconds, frame),
            (Some(LevelArg::Auto), None) => levels.take_fine_enough(frame)?,
            _ => {}
        }
        Ok(levels)
    }

    /// The coarsest level that is fine enough.
    fn take_fine_enough(&mut self, frame: &Frame) -> Result<()> {
        let choose = chooser(&self.asset, frame);
        let level = choose(Fineness::DEFAULT);
        self.asset = self.asset.level(level)?;
        crate::tell(&format!("note: level of detail {level}: {} samples", self.asset.samples.len()));
        Ok(())
    }

    fn keep_to(&mut self, milliseconds: f64, frame: &Frame) {
        let count = self.asset.levels.len() + 1;
        self.players.resize_with(count, || None);
        let mut governor = Governor::new(Fineness::DEFAULT, milliseconds);
        let pixels = pixels_at_nearest(frame, &self.asset.info);
        let varies = self.asset.density.is_some();
        governor.set_coarsest(Fineness::DEFAULT.coarsest(&details(&self.asset), pixels, varies));
        let choose = Box::new(chooser(&self.asset, frame));
        let kept = Kept { milliseconds, level: 0, frames: vec![0; count] };
        self.budget = Some(Budget { governor, choose, kept });
    }

    /// The player of the next frame.
    pub fn player(&mut self) -> Result<&mut Player> {
        Ok(self.open()?.1)
    }

    /// The same, and what it plays.
    fn open(&mut self) -> Result<(&Asset, &mut Player)> {
        if let Some(budget) = &self.budget {
            self.level = (budget.choose)(budget.governor.fineness());
        }
        let place = &mut self.players[self.level];
        if place.is_none() {
            let own = self.budget.is_some().then(|| self.asset.level(self.level)).transpose()?;
            let player = open(self.args, own.as_ref().unwrap_or(&self.asset), &mut self.notes)?;
            *place = Some((own, player));
        }
        let (own, player) = place.as_mut().context("there is no such level of detail")?;
        Ok((own.as_ref().unwrap_or(&self.asset), player))
    }

    /// Draws a frame; its milliseconds come with it.
    pub fn draw(&mut self, frame: &Frame, mode: LightMode) -> Result<(Rendered, f64)> {
        let (asset, player) = self.open()?;
        let started = Instant::now();
        let rendered = player.render_anyway(asset, frame, mode)?;
        let milliseconds = started.elapsed().as_secs_f64() * 1e3;
        let note = player.take_note();
        tell(note, &mut self.notes);
        if let Some(Budget { governor, kept, .. }) = &mut self.budget {
            governor.learn(milliseconds, rendered.counters.samples_drawn);
            kept.level = self.level;
            kept.frames[self.level] += 1;
        }
        Ok((rendered, milliseconds))
    }

    /// The player of the last frame.
    pub fn last(&self) -> Option<&Player> {
        self.players[self.level].as_ref().map(|(_, player)| player)
    }

    /// What was said of the backend.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Says which levels a budget came to. Returns it.
    pub fn tell_budget(&self) -> Option<Kept> {
        let kept = self.budget.as_ref()?.kept.clone();
        let used = kept.frames.iter().enumerate().filter(|(_, frames)| **frames > 0);
        let used: Vec<String> = used.map(|(level, frames)| format!("{level} in {frames} frames")).collect();
        let last = self.last().map_or(0, |player| player.info().samples);
        crate::tell(&format!(
            "note: levels of detail for {} ms a frame: {}; the last one {} with {last} samples",
            kept.milliseconds,
            used.join(", "),
            kept.level
        ));
        Some(kept)
    }
}

/// Which level a fineness comes to.
fn chooser(asset: &Asset, frame: &Frame) -> impl Fn(Fineness) -> usize + 'static {
    let (details, varies) = (details(asset), asset.density.is_some());
    let pixels = pixels_at_nearest(frame, &asset.info);
    move |fineness| fineness.choose(&details, pixels, varies).level
}

fn open(args: &Args, asset: &Asset, notes: &mut Vec<String>) -> Result<Player> {
    let mut player = Player::with_path(asset, args.backend.into(), args.splat.into())?;
    // The same for every level.
    tell(player.take_note().filter(|note| !notes.contains(note)), notes);
    player.edit(&args.edit())?;
    player.set_reuse(args.reuse);
    player.set_counting(args.stats.is_some());
    Ok(player)
}

/// Says why something else draws than one might expect.
fn tell(note: Option<String>, notes: &mut Vec<String>) {
    let Some(note) = note else { return };
    crate::tell(&format!("note: {note}"));
    if !notes.contains(&note) {
        notes.push(note);
    }
}
