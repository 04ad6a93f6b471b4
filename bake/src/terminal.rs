//! Progress on a terminal: one bar for each stage; plain lines elsewhere.

use diaphane_bake::progress::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Bars, or lines, or nothing.
pub struct Bars {
    quiet: bool,
    terminal: bool,
    stop: Arc<AtomicBool>,
    current: Mutex<Current>,
}

struct Current {
    name: &'static str,
    bar: ProgressBar,
}

impl Bars {
    /// Shows nothing when `quiet`.
    pub fn new(quiet: bool) -> Self {
        Self {
            quiet,
            terminal: std::io::stderr().is_terminal(),
            stop: Arc::new(AtomicBool::new(false)),
            current: Mutex::new(Current { name: "", bar: ProgressBar::hidden() }),
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

    /// Ends the last bar.
    pub fn finish(&self) {
        let mut current = self.lock();
        current.bar.finish();
        // The next bake has stages of the same names.
        current.name = "";
    }

    fn lock(&self) -> MutexGuard<'_, Current> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for Bars {
    fn stage(&self, name: &'static str, total: u64) {
        if self.quiet {
            return;
        }
        let mut current = self.lock();
        if current.name == name {
            // A stage may announce its work in parts: what is done stays done.
            current.bar.set_length(current.bar.position() + total);
            return;
        }
        current.bar.finish();
        current.name = name;
        if !self.terminal {
            eprintln!("{name} ...");
            return;
        }
        let style = ProgressStyle::with_template("{msg:16} {bar:32} {percent:>3} %  {per_sec}, {eta} left");
        current.bar = ProgressBar::with_draw_target(Some(total.max(1)), ProgressDrawTarget::stderr());
        if let Ok(style) = style {
            current.bar.set_style(style);
        }
        current.bar.set_message(name);
    }

    fn advance(&self, units: u64) {
        if self.terminal && !self.quiet {
            self.lock().bar.inc(units);
        }
    }

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
