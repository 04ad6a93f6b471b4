//! What a run found: a line a cell, counters, and a table for people.

use super::check::{CHECKS, Findings};
use super::plan::Cell;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// One cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Name of the body.
    pub body: String,
    /// Name of the cell within it.
    pub cell: String,
    /// What it showed.
    #[serde(flatten)]
    pub findings: Findings,
}

impl Line {
    /// Of a body's cell.
    pub fn new(body: &str, cell: &Cell, findings: Findings) -> Self {
        Self { body: body.to_owned(), cell: cell.name(), findings }
    }
}

/// A whole run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Cells in the order of the plan.
    pub lines: Vec<Line>,
    /// Bodies that were baked.
    pub bakes: usize,
    /// Cells that a check was left out for, by check and reason.
    pub skipped: BTreeMap<String, usize>,
    /// Cells that broke each check.
    pub failures: BTreeMap<&'static str, usize>,
    /// Seconds that the run took.
    pub seconds: f64,
}

/// Failures that the table spells out; the JSON file has all.
const SPELT: usize = 20;

impl Report {
    /// Adds a cell.
    pub fn add(&mut self, line: Line) {
        for (check, reason) in &line.findings.skipped {
            self.skip(check, reason, 1);
        }
        for failure in &line.findings.failures {
            *self.failures.entry(failure.check).or_default() += 1;
        }
        self.lines.push(line);
    }

    /// Notes that a check was left out for some cells.
    pub fn skip(&mut self, check: &str, reason: &str, cells: usize) {
        *self.skipped.entry(format!("{check}: {reason}")).or_default() += cells;
    }

    /// Cells that broke a bound.
    pub fn failed(&self) -> usize {
        self.lines.iter().filter(|l| !l.findings.failures.is_empty()).count()
    }

    /// A row for every body, the counters, and the first failures.
    pub fn text(&self) -> String {
        let mut bodies: Vec<(&str, Vec<&Line>)> = Vec::new();
        for line in &self.lines {
            match bodies.iter_mut().find(|(name, _)| *name == line.body) {
                Some((_, lines)) => lines.push(line),
                None => bodies.push((&line.body, vec![line])),
            }
        }
        let width = bodies.iter().map(|(name, _)| name.len()).max().unwrap_or(0).max(4);
        let mut out = format!(
            "{:<width$} {:>5} {:>6} {:>8} {:>7} {:>8} {:>9} {:>8} {:>8}",
            "body", "cells", "failed", "twin", "vague", "of bound", "energy", "gpu", "rays hit"
        );
        for (name, lines) in &bodies {
            let most =
                |of: &dyn Fn(&Findings) -> f64| lines.iter().map(|l| of(&l.findings)).fold(0.0, f64::max);
            let sum = |of: &dyn Fn(&Findings) -> usize| lines.iter().map(|l| of(&l.findings)).sum::<usize>();
            let vague = 100.0 * sum(&|f| f.vague) as f64 / sum(&|f| f.compared).max(1) as f64;
            // Writing to a String cannot fail.
            let _ = write!(
                out,
                "\n{name:<width$} {:>5} {:>6} {:>8.1e} {vague:>5.1} % {:>8.3} {:>9.5} {:>8.1e} {:>8}",
                lines.len(),
                lines.iter().filter(|l| !l.findings.failures.is_empty()).count(),
                most(&|f| f.twin_error),
                most(&|f| f.twin_share),
                most(&|f| f.energy_share),
                most(&|f| f.gpu_error),
                sum(&|f| f.hit),
            );
        }
        out.push_str(&self.summary());
        out
    }

    fn summary(&self) -> String {
        let sum = |of: &dyn Fn(&Findings) -> usize| self.lines.iter().map(|l| of(&l.findings)).sum::<usize>();
        let mut out = format!(
            "\n\n{} cells, {} bakes, {:.0} s: {} rays, {} through an object, {} against double precision, {} against \
             the GPU",
            self.lines.len(),
            self.bakes,
            self.seconds,
            sum(&|f| f.rays),
            sum(&|f| f.hit),
            sum(&|f| f.compared),
            sum(&|f| f.gpu_rays),
        );
        for (what, cells) in &self.skipped {
            let _ = write!(out, "\nleft out in {cells} cells: {what}");
        }
        let counts: Vec<String> =
            CHECKS.iter().map(|c| format!("{c} {}", self.failures.get(c).unwrap_or(&0))).collect();
        let _ = write!(out, "\n{} cells failed: {}", self.failed(), counts.join(", "));
        let all = self.lines.iter().flat_map(|l| l.findings.failures.iter().map(move |f| (l, f)));
        for (line, failure) in all.take(SPELT) {
            let _ = write!(out, "\n  {}: {}: {}: {}", line.body, line.cell, failure.check, failure.what);
        }
        out
    }
}
