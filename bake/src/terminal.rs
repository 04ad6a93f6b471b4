//! Progress on a terminal: one bar for each stage; plain lines elsewhere. A reader that goes away (`| head`) is no reason to
//! fail.

use diaphane_bake::progress::Progress;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A line on standard output.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// A line on standard error.
pub fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Bars, or lines, or nothing.
pub struct Bars {
    quiet: bool,
    terminal: bool,
    stop: Arc<AtomicBool>,
    stages: Mutex<Stages>,
}

/// The stages so far, which may take turns, each with its bar.
#[derive(Default)]
struct Stages {
    bars: Vec<(&'static str, ProgressBar)>,
    all: MultiProgress,
    /// Index of the one at work.
    current: usize,
}

impl Bars {
    /// Shows nothing when `quiet`.
    pub fn new(quiet: bool) -> Self {
        Self {
            quiet,
            terminal: std::io::stderr().is_terminal(),
            stop: Arc::new(AtomicBool::new(false)),
            stages: Mutex::default(),
        }
    }

    /// Ctrl-C asks the bake to stop; a second one ends the program at once.
    pub fn cancel_on_interrupt(&self) -> Result<(), ctrlc::Error> {
        let stop = Arc::clone(&self.stop);
        ctrlc::set_handler(move || {
            if stop.swap(true, Ordering::Relaxed) {
                std::process::exit(2);
            }
        })
    }

    /// Ends all bars: the next bake has stages of the same names.
    pub fn finish(&self) {
        let mut stages = self.lock();
        stages.bars.drain(..).for_each(|(_, bar)| bar.finish());
    }

    fn lock(&self) -> MutexGuard<'_, Stages> {
        self.stages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for Bars {
    fn stage(&self, name: &'static str, total: u64) {
        if self.quiet {
            return;
        }
        let mut stages = self.lock();
        if let Some(known) = stages.bars.iter().position(|(known, _)| *known == name) {
            stages.current = known;
            stages.bars[known].1.inc_length(total);
            return;
        }
        let bar = if self.terminal {
            let style =
                ProgressStyle::with_template("{msg:16} {bar:32} {percent:>3} %  {per_sec}, {eta} left");
            let bar = stages.all.add(ProgressBar::new(total));
            if let Ok(style) = style {
                bar.set_style(style);
            }
            bar.set_message(name);
            bar
        } else {
            tell(&format!("{name} ..."));
            ProgressBar::hidden()
        };
        stages.current = stages.bars.len();
        stages.bars.push((name, bar));
    }

    fn advance(&self, units: u64) {
        if self.terminal && !self.quiet {
            let stages = self.lock();
            if let Some((_, bar)) = stages.bars.get(stages.current) {
                bar.inc(units);
            }
        }
    }

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
