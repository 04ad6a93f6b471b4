//! Progress on standard error: a bar on a terminal, plain lines otherwise.

use super::output::tell;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use validation::reference::Progress;

/// Shows how far one piece of work is.
pub struct Display {
    bar: Option<ProgressBar>,
    label: String,
    /// Last pass that was printed as a line.
    printed: std::sync::atomic::AtomicU32,
}

impl Display {
    /// A display that starts at nothing; `label` says what is being made.
    pub fn new(label: &str) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(1);
            let style = ProgressStyle::with_template("{prefix:<28} {bar:30} {percent:>3} %  {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_prefix(label.to_owned());
            bar
        });
        Self { bar, label: label.to_owned(), printed: std::sync::atomic::AtomicU32::new(u32::MAX) }
    }

    /// Progress of the reference.
    pub fn reference(&self, p: Progress) {
        use std::sync::atomic::Ordering;
        let message = match p.pass {
            0 => "coverage".to_owned(),
            1 => "pass 1".to_owned(),
            n => format!("pass {n}, noise {:.2} %", 100.0 * p.error),
        };
        match &self.bar {
            Some(bar) => {
                bar.set_length(p.total as u64);
                bar.set_position(p.done as u64);
                bar.set_message(message);
            }
            None if p.pass > 0 && self.printed.swap(p.pass, Ordering::Relaxed) != p.pass => {
                tell(&format!("{}: {message}, {} pixels", self.label, p.total));
            }
            None => {}
        }
    }

    /// Says once, where there is no bar, that the work begins.
    pub fn announce(&self) {
        if self.bar.is_none() {
            tell(&format!("{} ...", self.label));
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl diaphane_bake::progress::Progress for Display {
    fn stage(&self, name: &'static str, total: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(total.max(1));
            bar.set_position(0);
            bar.set_message(name);
        }
    }

    fn advance(&self, units: u64) {
        if let Some(bar) = &self.bar {
            bar.inc(units);
        }
    }

    fn cancelled(&self) -> bool {
        false
    }
}

/// Shows how far a table of rows is.
pub struct RowDisplay {
    bar: Option<ProgressBar>,
    total: usize,
    /// Name of the row at work, and number of rows done.
    state: std::sync::Mutex<(String, usize)>,
}

impl RowDisplay {
    /// A display of `total` rows, none done.
    pub fn new(total: usize) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(total as u64);
            let style = ProgressStyle::with_template("{pos:>3}/{len} {bar:24} {elapsed:>4}  {prefix}  {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        Self { bar, total, state: std::sync::Mutex::default() }
    }

    fn state(&self) -> std::sync::MutexGuard<'_, (String, usize)> {
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn message(&self, text: String) {
        if let Some(bar) = &self.bar {
            bar.set_message(text);
        }
    }

    /// Work on a row begins.
    pub fn work(&self, name: &str) {
        name.clone_into(&mut self.state().0);
        if let Some(bar) = &self.bar {
            bar.set_prefix(name.to_owned());
        }
    }

    /// The row at work is done.
    pub fn done(&self, result: &str) {
        let mut state = self.state();
        state.1 += 1;
        match &self.bar {
            Some(bar) => bar.set_position(state.1 as u64),
            None => tell(&format!("{}/{} {}: {result}", state.1, self.total, state.0)),
        }
    }

    /// Progress of the row's reference.
    pub fn reference(&self, p: Progress) {
        let noise =
            if p.error.is_finite() { format!(", noise {:.2} %", 100.0 * p.error) } else { String::new() };
        self.message(format!("reference: pass {}{noise}", p.pass));
    }

    /// Prints lines without the bar in between.
    pub fn aside(&self, print: impl FnOnce()) {
        match &self.bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl diaphane_bake::progress::Progress for RowDisplay {
    fn stage(&self, name: &'static str, _: u64) {
        self.message(format!("bake: {name}"));
    }

    fn advance(&self, _: u64) {}

    fn cancelled(&self) -> bool {
        false
    }
}

/// Shows how many of a number of like steps are done, and how long the rest will take.
pub struct Steps {
    bar: Option<ProgressBar>,
    total: usize,
    finished: std::sync::atomic::AtomicUsize,
    begun: std::time::Instant,
}

impl Steps {
    /// A display of `total` steps, none of them done.
    pub fn new(total: usize) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(total as u64);
            let style = ProgressStyle::with_template("{bar:24} {pos}/{len}  {eta_precise} left  {msg}");
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        Self { bar, total, finished: 0.into(), begun: std::time::Instant::now() }
    }

    /// What is being done now, where there is a bar.
    pub fn note(&self, what: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(what.to_owned());
        }
    }

    /// One more is done; where there is no bar its result is a line.
    pub fn done(&self, result: &str) {
        let done = self.finished.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        let left = self.begun.elapsed().as_secs_f64() * self.total.saturating_sub(done) as f64 / done as f64;
        match &self.bar {
            Some(bar) => bar.inc(1),
            None => tell(&format!("[{done}/{}] {result}; about {left:.0} s left", self.total)),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
