//! Progress and cancellation: one message type for terminals, windows and tests.

use crate::{Error, Result};
use std::cell::RefCell;
use std::time::Instant;

/// Receives progress. Called from many threads.
pub trait Progress: Sync {
    /// A stage begins or goes on; `total` units more will follow (0 when unknown or told before). Stages may take turns.
    fn stage(&self, name: &'static str, total: u64);
    /// `units` more are done.
    fn advance(&self, units: u64);
    /// Whether the work should stop.
    fn cancelled(&self) -> bool;
}

/// Nobody watches.
pub struct Silent;

impl Progress for Silent {
    fn stage(&self, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        false
    }
}

/// Progress of the current stage.
#[derive(Clone, Copy)]
pub(crate) struct Stage<'a> {
    progress: &'a dyn Progress,
    name: &'static str,
}

impl Stage<'_> {
    /// Announces how many units follow; again where a stage learns of its work in parts.
    pub fn announce(&self, total: usize) {
        self.progress.stage(self.name, total as u64);
    }

    /// Reports finished units and fails when the user asked to stop.
    pub fn step(&self, units: usize) -> Result<()> {
        self.progress.advance(units as u64);
        if self.progress.cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Runs stages and keeps their times.
pub(crate) struct Timed<'a> {
    progress: &'a dyn Progress,
    pub seconds: RefCell<Vec<(&'static str, f64)>>,
}

impl<'a> Timed<'a> {
    pub fn new(progress: &'a dyn Progress) -> Self {
        Self { progress, seconds: RefCell::default() }
    }

    /// Says how many units of a stage follow, before any of them.
    pub fn announce(&self, name: &'static str, total: usize) {
        self.progress.stage(name, total as u64);
    }

    pub fn stage<T>(&self, name: &'static str, work: impl FnOnce(Stage<'a>) -> Result<T>) -> Result<T> {
        self.progress.stage(name, 0);
        if self.progress.cancelled() {
            return Err(Error::Cancelled);
        }
        let start = Instant::now();
        let result = work(Stage { progress: self.progress, name })?;
        self.seconds.borrow_mut().push((name, start.elapsed().as_secs_f64()));
        Ok(result)
    }
}
