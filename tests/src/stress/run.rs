//! Runs the matrix: bodies one after the other, the scatterings of a body side by side.

use super::axes::Scattering;
use super::body::{Baked, bake_body};
use super::check::{Findings, Subject, dyed};
use super::gpu::Gpu;
use super::plan::{Body, Cell, PLAIN, Plan};
use super::table::{Line, Report};
use diaphane_bake::progress::Progress;
use rayon::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// What to check beside the CPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Whether the GPU draws every cell as well, where there is an adapter.
    pub gpu: bool,
}

/// Runs a plan; `done` is called with the name of every body once its cells are checked, and how many these are.
pub fn run(plan: &Plan, settings: Settings, progress: &dyn Progress, done: &dyn Fn(&str, usize)) -> Report {
    let begun = Instant::now();
    let gpu = Gpu::new(settings.gpu);
    let mut report = Report::default();
    if !settings.gpu {
        report.skip("gpu", "not asked for", plan.cells());
    }
    for (b, (body, cells)) in plan.bodies.iter().enumerate() {
        let name = body.name();
        gpu.next_body(b);
        match caught(|| baked_or_edited(body, progress)) {
            Ok(Ok((baked, refused))) => {
                report.bakes += 1;
                if refused {
                    report.skip("bake", REFUSED, cells.len());
                }
                let lines = check_cells(&name, &baked, cells, &gpu);
                lines.into_iter().for_each(|line| report.add(line));
            }
            Ok(Err(e)) => {
                for cell in cells {
                    report.add(broken(&name, cell, "bake", e.to_string()));
                }
            }
            Err(panic) => {
                for cell in cells {
                    report.add(broken(&name, cell, "panic", format!("in the bake: {panic}")));
                }
            }
        }
        done(&name, cells.len());
    }
    if settings.gpu {
        let left =
            |l: &&Line| l.findings.gpu_rays == 0 && l.findings.skipped.iter().all(|(c, _)| *c != "gpu");
        match report.lines.iter().filter(left).count() {
            0 => (),
            cells => report.skip("gpu", &gpu.why_not(), cells),
        }
    }
    report.seconds = begun.elapsed().as_secs_f64();
    report
}

/// What is said of bodies that are too dense for a bake.
const REFUSED: &str = "light reaches no sample of so dense a body, which the bake says in one line; \
                       played from a bake of the plain extinction, edited";

/// A baked body. Where its medium is so dense that the bake finds no light at any sample, one line must say so; then the
/// plain extinction is baked and raised when played, as a player's user may. Tells whether that was so.
fn baked_or_edited(body: &Body, progress: &dyn Progress) -> diaphane_bake::Result<(Baked, bool)> {
    match bake_body(body, progress) {
        Err(diaphane_bake::Error::NoRoom(why)) if body.extinction > OPAQUE && why.lines().count() == 1 => {
            let mut baked = bake_body(&Body { extinction: PLAIN.extinction, ..*body }, progress)?;
            let factor = body.extinction / PLAIN.extinction;
            baked.asset.info.extinction.iter_mut().for_each(|e| *e *= factor);
            Ok((baked, true))
        }
        other => Ok((other?, false)),
    }
}

/// Extinction times diagonal from which a bake may find no light inside: a mean free path is below what positions in an
/// asset can tell apart.
const OPAQUE: f64 = 1e5;

/// Scatterings side by side, each with its own renderer.
fn check_cells(name: &str, baked: &Baked, cells: &[Cell], gpu: &Gpu) -> Vec<Line> {
    let mut scatterings: Vec<Scattering> = Vec::new();
    for cell in cells {
        if !scatterings.contains(&cell.scattering) {
            scatterings.push(cell.scattering);
        }
    }
    let lines = scatterings.par_iter().enumerate().with_max_len(1).map(|(s, scattering)| {
        let own: Vec<&Cell> = cells.iter().filter(|c| c.scattering == *scattering).collect();
        let asset = dyed(&baked.asset, *scattering);
        match caught(|| Subject::new(baked, &asset, gpu.renderer(&asset, s)?)) {
            Ok(Ok(mut subject)) => own.iter().map(|cell| check(name, &mut subject, cell)).collect(),
            Ok(Err(e)) => own.iter().map(|cell| broken(name, cell, "bake", e.to_string())).collect(),
            Err(e) => own.iter().map(|cell| broken(name, cell, "panic", e.clone())).collect::<Vec<_>>(),
        }
    });
    lines.flatten().collect()
}

fn check(name: &str, subject: &mut Subject, cell: &Cell) -> Line {
    match caught(|| subject.check(cell)) {
        Ok(Ok(findings)) => Line::new(name, cell, findings),
        Ok(Err(e)) => broken(name, cell, "finite", e.to_string()),
        Err(e) => broken(name, cell, "panic", e),
    }
}

fn broken(name: &str, cell: &Cell, check: &'static str, what: String) -> Line {
    let mut findings = Findings::default();
    findings.fail(check, what);
    Line::new(name, cell, findings)
}

/// What a panic said, on one line.
fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        let text = payload.downcast_ref::<String>().cloned();
        let text = text.or_else(|| payload.downcast_ref::<&str>().map(|s| (*s).to_owned()));
        text.unwrap_or_else(|| "a panic without words".to_owned()).replace('\n', " ")
    })
}
