//! Splats, a ray marcher and a 3D grid at equal error on the same adapter, from one light to thousands.
//!
//! The truth is the marcher with many steps, in small pictures of a few views. A rival then works as little as leaves it no
//! more error than the splats have, and all are timed in larger pictures. Where the truth would take too long the rivals'
//! effort is that of the number of lights before.

use super::BenchArgs;
use super::crossover::Verdict;
use super::error::Pooled;
use super::methods::{Contest, Effort, Method};
use super::search::{extrapolated, fewest};
use anyhow::Result;
use diaphane_formats::asset::Asset;
use diaphane_formats::picture::Picture;
use diaphane_runtime::frame::Frame;
use diaphane_runtime::player::Player;
use serde::Serialize;

const LIGHTS: [usize; 9] = [1, 2, 4, 8, 16, 64, 256, 1024, 4096];
/// Of the pictures that errors are measured in.
const SIZE: [u32; 2] = [128, 128];
/// Steps of the truth; rivals take half of them at the most.
const TRUTH: u32 = 64;
/// Nodes along the longest edge.
const SIDES: [u32; 11] = [6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192];
/// Voxels between two lookups of the density.
const STRIDES: [f32; 4] = [8.0, 4.0, 2.0, 1.0];

/// Why a rival has no row although its error was measured.
const UNREACHED: &str = "does not reach the error of the splats";

/// Everything that was measured.
#[derive(Serialize)]
pub struct Report {
    adapter: String,
    /// What `ms` is by: the adapter's own clock, or the wall's until the picture is in memory.
    clock: &'static str,
    size: [u32; 2],
    error_size: [u32; 2],
    views: u32,
    truth_steps: u32,
    pub rows: Vec<Row>,
    skipped: Vec<Skipped>,
    crossovers: Vec<Crossover>,
}

/// One method with so many lights.
#[derive(Serialize)]
pub struct Row {
    pub method: Method,
    pub lights: usize,
    /// Median of a frame.
    pub ms: f64,
    /// Against the truth; `None` where that would have taken too long.
    pub rel_rmse: Option<f64>,
    /// The same of a march with half of the truth's steps: a bound of the truth's own error.
    truth_error: Option<f64>,
    effort: Option<Effort>,
}

/// A cell that was not measured.
#[derive(Serialize)]
struct Skipped {
    method: Method,
    lights: usize,
    why: String,
}

/// From when on the splats win.
#[derive(Serialize)]
struct Crossover {
    against: Method,
    #[serde(flatten)]
    verdict: Verdict,
}

/// Errors with one number of lights.
struct Errors {
    splats: f64,
    truth: f64,
}

/// Measures and prints everything.
pub fn run(asset: &Asset, player: &mut Player, args: &BenchArgs) -> Result<Report> {
    let mut contest = Contest::new(asset, player)?;
    let mut report = Report {
        adapter: contest.rivals.adapter(),
        clock: if contest.by_adapter { "adapter" } else { "wall" },
        size: [args.rival_size; 2],
        error_size: SIZE,
        views: args.frames,
        truth_steps: TRUTH,
        rows: Vec::new(),
        skipped: Vec::new(),
        crossovers: Vec::new(),
    };
    args.say(&format!(
        "equal error, {0} x {0} pixels, {1} views, times by the {2}'s clock",
        args.rival_size, args.frames, report.clock
    ))?;
    args.say(&format!(
        "{:<12} {:>6} {:>9} {:>6} {:>6} {:>11} {:>9}",
        "method", "lights", "error %", "steps", "nodes", "frame ms", "/ splats"
    ))?;
    let mut efforts: [Option<(Effort, Option<f64>)>; 3] = [None; 3];
    for lights in LIGHTS {
        let errors = equalise(&mut contest, args, lights, &mut efforts, &mut report)?;
        for method in Method::ALL {
            time(&mut contest, args, lights, method, &errors, &efforts, &mut report)?;
        }
    }
    for against in [Method::March, Method::Grid] {
        let mut verdict = Verdict::of(&ratios(&report.rows, against));
        let unreached = |s: &Skipped| s.method == against && s.why == UNREACHED;
        if verdict == Verdict::Unmeasured && report.skipped.iter().any(unreached) {
            verdict = Verdict::OutOfReach;
        }
        args.say(&format!("against the {}: {}", against.name(), verdict.text()))?;
        report.crossovers.push(Crossover { against, verdict });
    }
    Ok(report)
}

/// Finds the rivals' least efforts that leave no more error than the splats have. Where the truth takes too long they stay as
/// they are.
fn equalise(
    contest: &mut Contest<'_>,
    args: &BenchArgs,
    lights: usize,
    efforts: &mut [Option<(Effort, Option<f64>)>; 3],
    report: &mut Report,
) -> Result<Option<Errors>> {
    let frames = contest.frames(lights, SIZE, args.frames)?.split_off(1);
    let varies = contest.rivals.is_heterogeneous();
    let best = Effort { steps: TRUTH, stride: if varies { 0.5 } else { 1.0 }, side: 0, lit: 0 };
    let half = Effort { steps: TRUTH / 2, stride: 1.0, ..best };
    if contest.predicted(best, &frames) + contest.predicted(half, &frames) > args.limit {
        // What was found before stays, without an error of its own.
        efforts.iter_mut().flatten().for_each(|e| e.1 = None);
        return Ok(None);
    }
    let truth = pictures(contest, Method::March, &frames, best)?.0;
    let error_of = |pictures: &[Picture]| Pooled::of(pictures.iter().zip(&truth));
    let own = error_of(&pictures(contest, Method::March, &frames, half)?.0);
    let splats = error_of(&pictures(contest, Method::Splats, &frames, best)?.0);
    // The cheapest of the candidates, by time.
    let mut cheapest: [Option<(f64, Effort, f64)>; 3] = [None; 3];
    let mut offer = |contest: &mut Contest<'_>, method: Method, effort: Effort, error: f64| -> Result<()> {
        let ms = pictures(contest, method, &frames, effort)?.1;
        let known = &mut cheapest[method as usize];
        if known.is_none_or(|(least, ..)| ms < least) {
            *known = Some((ms, effort, error));
        }
        Ok(())
    };
    for stride in if varies { &STRIDES[..] } else { &[1.0] } {
        let effort = |steps| Effort { steps, stride: *stride, side: 0, lit: 0 };
        let found = fewest(splats, TRUTH / 2, |steps| -> Result<_> {
            Ok(Some(error_of(&pictures(contest, Method::March, &frames, effort(steps))?.0)))
        })?;
        if let Some((steps, error)) = found {
            offer(contest, Method::March, effort(steps), error)?;
        }
    }
    // The smallest grid that will do, and the next, which may do with fewer steps.
    let mut grids = 0;
    for side in SIDES {
        let lit = contest.lay(side)?;
        for stride in if varies { &STRIDES[2..] } else { &[1.0] } {
            let effort = |steps| Effort { steps, stride: *stride, side, lit };
            // Shadow rays of a dozen searches.
            if 12.0 * contest.predicted(effort(1), &frames) > args.limit {
                break;
            }
            if error_of(&pictures(contest, Method::Grid, &frames, effort(TRUTH / 2))?.0) > splats {
                continue;
            }
            let found = fewest(splats, TRUTH / 2, |steps| -> Result<_> {
                Ok(Some(error_of(&pictures(contest, Method::Grid, &frames, effort(steps))?.0)))
            })?;
            if let Some((steps, error)) = found {
                offer(contest, Method::Grid, effort(steps), error)?;
                grids += 1;
            }
        }
        if grids >= 2 {
            break;
        }
    }
    for method in [Method::March, Method::Grid] {
        efforts[method as usize] = cheapest[method as usize].map(|(_, effort, error)| (effort, Some(error)));
        if efforts[method as usize].is_none() {
            let why = UNREACHED.to_owned();
            skip(args, report, method, lights, why)?;
        }
    }
    Ok(Some(Errors { splats, truth: own }))
}

/// Pictures of all frames, and their milliseconds together.
fn pictures(
    contest: &mut Contest<'_>,
    method: Method,
    frames: &[Frame],
    effort: Effort,
) -> Result<(Vec<Picture>, f64)> {
    let mut sum = 0.0;
    let mut list = Vec::with_capacity(frames.len());
    for frame in frames {
        let (picture, ms) = contest.draw(method, frame, effort)?;
        list.push(picture);
        sum += ms;
    }
    Ok((list, sum))
}

/// Times one method with so many lights.
fn time(
    contest: &mut Contest<'_>,
    args: &BenchArgs,
    lights: usize,
    method: Method,
    errors: &Option<Errors>,
    efforts: &[Option<(Effort, Option<f64>)>; 3],
    report: &mut Report,
) -> Result<()> {
    let known = efforts[method as usize];
    let effort = known.map(|k| k.0);
    if method != Method::Splats && effort.is_none() {
        if errors.is_none() {
            skip(args, report, method, lights, format!("its truth would take longer than {} s", args.limit))?;
        }
        return Ok(());
    }
    let frames = contest.frames(lights, [args.rival_size; 2], args.frames)?;
    let measured: Vec<(usize, f64)> =
        report.rows.iter().filter(|r| r.method == method).map(|r| (r.lights, r.ms)).collect();
    let before = 1e-3 * extrapolated(&measured, lights) * frames.len() as f64;
    let rays = effort.map_or(0.0, |e| contest.predicted(e, &frames));
    if before.max(rays) > args.limit {
        skip(args, report, method, lights, format!("would take longer than {} s", args.limit))?;
        return Ok(());
    }
    let nothing = Effort { steps: 0, stride: 1.0, side: 0, lit: 0 };
    let ms = contest.median_ms(method, &frames, effort.unwrap_or(nothing))?;
    let rel_rmse = match method {
        Method::Splats => errors.as_ref().map(|e| e.splats),
        _ => known.and_then(|k| k.1),
    };
    let row = Row { method, lights, ms, rel_rmse, truth_error: errors.as_ref().map(|e| e.truth), effort };
    report.rows.push(row);
    print(args, &report.rows)
}

fn skip(args: &BenchArgs, report: &mut Report, method: Method, lights: usize, why: String) -> Result<()> {
    args.say(&format!("{:<12} {lights:>6} skipped: {why}", method.name()))?;
    report.skipped.push(Skipped { method, lights, why });
    Ok(())
}

/// The last row.
fn print(args: &BenchArgs, rows: &[Row]) -> Result<()> {
    let Some(row) = rows.last() else { return Ok(()) };
    let some = |value: Option<u32>| value.filter(|v| *v > 0).map_or("-".to_owned(), |v| v.to_string());
    let splats = rows.iter().find(|r| r.method == Method::Splats && r.lights == row.lights);
    args.say(&format!(
        "{:<12} {:>6} {:>9} {:>6} {:>6} {:>11.1} {:>9}",
        row.method.name(),
        row.lights,
        row.rel_rmse.map_or("-".to_owned(), |e| format!("{:.2}", 100.0 * e)),
        some(row.effort.map(|e| e.steps)),
        some(row.effort.map(|e| e.side)),
        row.ms,
        splats.map_or("-".to_owned(), |s| format!("{:.2}", row.ms / s.ms)),
    ))?;
    Ok(())
}

/// (lights, the rival's time over the splats') where both were measured.
fn ratios(rows: &[Row], against: Method) -> Vec<(usize, f64)> {
    let of = |method: Method, lights: usize| {
        rows.iter().find(|r| r.method == method && r.lights == lights).map(|r| r.ms)
    };
    LIGHTS.into_iter().filter_map(|n| Some((n, of(against, n)? / of(Method::Splats, n)?))).collect()
}
