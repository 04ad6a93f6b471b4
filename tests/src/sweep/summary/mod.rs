//! What a sweep shows, in figures that a person can check against the table: the distance to the published recipe, the
//! number of lights from which splats are faster than marching, and where something else is the better choice.

mod text;

pub use text::text;

use super::analysis::{Cost, Rival, Verdict, crossover};
use super::plan::{Base, EncodingName};
use super::record::{Key, Method, Record};
use serde::Serialize;
use std::collections::BTreeMap;

/// Errors below which the fastest method is sought.
const TARGETS: [f64; 6] = [0.2, 0.1, 0.05, 0.03, 0.02, 0.01];

/// One case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaseSummary {
    /// Its name.
    pub case: String,
    /// The published recipe against the player, at equal samples.
    pub recipe: Vec<Ratio>,
    /// Against the marcher at equal error.
    pub crossovers: Vec<Crossing>,
    /// The fastest method below each error.
    pub fastest: Vec<Fastest>,
}

/// Errors of the published recipe and of the player at equal samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// Samples asked for.
    pub samples: usize,
    /// Lights.
    pub lights: usize,
    /// Error of the recipe.
    pub recipe: f64,
    /// Error of the player.
    pub splats: f64,
    /// The one over the other.
    pub ratio: f64,
}

/// From how many lights on splats are faster than the marcher.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Crossing {
    /// What draws the splats.
    pub backend: String,
    /// Samples asked for.
    pub samples: usize,
    /// Root mean square of their errors over the measured numbers of lights.
    pub error: f64,
    /// In words.
    pub verdict: String,
    /// The number of lights, where there is one.
    pub lights: Option<f64>,
    /// Milliseconds of the splats: fixed, and of each light.
    pub splats_ms: [f64; 2],
    /// The same of the marcher at that error; absent where it does not reach it.
    pub march_ms: Option<[f64; 2]>,
    /// The marcher's steps there, between measured numbers.
    pub march_steps: Option<f64>,
}

/// The fastest way below an error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fastest {
    /// Lights.
    pub lights: usize,
    /// Error that must not be exceeded.
    pub target: f64,
    /// Its method.
    pub method: Method,
    /// Its settings.
    pub setting: String,
    /// Milliseconds of its frame.
    pub frame_ms: f64,
    /// Its error.
    pub error: f64,
    /// Milliseconds of the fastest splats below the error, if any are.
    pub splats_ms: Option<f64>,
}

/// Summaries of all cases, in their order.
pub fn summarise(records: &[Record], base: Base) -> Vec<CaseSummary> {
    let mut names: Vec<&str> = Vec::new();
    for r in records {
        if !names.contains(&r.key.case.as_str()) {
            names.push(&r.key.case);
        }
    }
    names
        .into_iter()
        .map(|name| {
            let here: Vec<&Record> = records.iter().filter(|r| r.key.case == name).collect();
            CaseSummary {
                case: name.to_owned(),
                recipe: ratios(&here, base),
                crossovers: crossings(&here, base),
                fastest: fastest(&here),
            }
        })
        .collect()
}

/// Splats with default settings apart from the samples.
fn is_default(key: &Key, base: Base) -> bool {
    key.method == Method::Splats
        && key.order == base.order
        && key.directions == base.directions
        && key.encoding == EncodingName::DEFAULT.name()
        && key.preset == "standard"
}

fn ratios(records: &[&Record], base: Base) -> Vec<Ratio> {
    let mut out: Vec<Ratio> = Vec::new();
    for t in records.iter().filter(|r| r.key.method == Method::Thesis) {
        let same = |r: &&&Record| {
            is_default(&r.key, base)
                && (r.key.samples, r.key.lights) == (t.key.samples, t.key.lights)
                && r.key.backend == "cpu"
        };
        if let Some(s) = records.iter().find(same) {
            let (recipe, splats) = (t.outcome.rel_rmse, s.outcome.rel_rmse);
            let (samples, lights) = (t.key.samples, t.key.lights);
            out.push(Ratio { samples, lights, recipe, splats, ratio: recipe / splats });
        }
    }
    out.sort_by_key(|r| (r.samples, r.lights));
    out
}

/// Error (root mean square over the lights) and cost of equal settings with different lights.
fn by_setting(records: &[&Record]) -> Vec<(Key, f64, Cost)> {
    let mut groups: BTreeMap<Key, Vec<&Record>> = BTreeMap::new();
    for r in records {
        groups.entry(Key { lights: 0, ..r.key.clone() }).or_default().push(r);
    }
    groups
        .into_iter()
        .filter_map(|(key, group)| {
            let times: Vec<(f64, f64)> =
                group.iter().map(|r| (r.key.lights as f64, r.outcome.frame_ms[1])).collect();
            let square: f64 = group.iter().map(|r| r.outcome.rel_rmse.powi(2)).sum();
            Some((key, (square / group.len() as f64).sqrt(), Cost::fit(&times)?))
        })
        .collect()
}

fn crossings(records: &[&Record], base: Base) -> Vec<Crossing> {
    let all = by_setting(records);
    let marcher: Vec<Rival> = all
        .iter()
        .filter(|(k, _, _)| k.method == Method::March)
        .map(|(k, error, cost)| Rival { steps: k.steps, error: *error, cost: *cost })
        .collect();
    let coarsest = marcher.iter().min_by_key(|r| r.steps).copied();
    all.iter()
        .filter(|(k, _, _)| is_default(k, base))
        .filter_map(|(k, error, cost)| {
            let (verdict, at) = crossover(*error, *cost, &marcher)?;
            let (words, lights) = match verdict {
                Verdict::Always => ("splats are faster for any number of lights".to_owned(), None),
                Verdict::From(n) => (format!("splats are faster from {:.0} lights on", n.ceil()), Some(n)),
                Verdict::Until(n) => (format!("splats are faster up to {} lights", n.floor()), Some(n)),
                Verdict::Never => ("the marcher is faster for any number of lights".to_owned(), None),
                Verdict::OutOfReach => ("the marcher does not reach this error".to_owned(), None),
            };
            let better = coarsest.filter(|c| *error >= c.error).map_or_else(String::new, |c| {
                format!(" (its fewest steps, {}, have less error: {:.1} %)", c.steps, 100.0 * c.error)
            });
            Some(Crossing {
                backend: k.backend.clone(),
                samples: k.samples,
                error: *error,
                verdict: words + &better,
                lights,
                splats_ms: [cost.fixed, cost.per_light],
                march_ms: at.map(|(_, c)| [c.fixed, c.per_light]),
                march_steps: at.map(|(steps, _)| steps),
            })
        })
        .collect()
}

fn fastest(records: &[&Record]) -> Vec<Fastest> {
    let mut lights: Vec<usize> = records.iter().map(|r| r.key.lights).collect();
    lights.sort_unstable();
    lights.dedup();
    let mut out = Vec::new();
    for n in lights {
        for target in TARGETS {
            let time = |r: &&&Record| r.outcome.frame_ms[1];
            let good: Vec<&&Record> =
                records.iter().filter(|r| r.key.lights == n && r.outcome.rel_rmse <= target).collect();
            let least = |a: &&&&Record, b: &&&&Record| time(a).total_cmp(&time(b));
            let Some(best) = good.iter().min_by(least) else { continue };
            let splats = good.iter().filter(|r| r.key.method == Method::Splats).min_by(least);
            out.push(Fastest {
                lights: n,
                target,
                method: best.key.method,
                setting: setting(&best.key),
                frame_ms: best.outcome.frame_ms[1],
                error: best.outcome.rel_rmse,
                splats_ms: splats.map(|r| r.outcome.frame_ms[1]),
            });
        }
    }
    out
}

/// Settings in a few words.
fn setting(key: &Key) -> String {
    match key.method {
        Method::March => format!("{} steps", key.steps),
        Method::Thesis => format!("{} samples", key.samples),
        Method::Splats | Method::Grid => {
            format!("{} samples, {} bands, {}", key.samples, key.order, key.backend)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::record::samples::record;

    #[test]
    fn figures_by_hand() {
        let base = Base { samples: 100, order: 5, directions: 64 };
        let at = |method: Method, steps: usize, lights: usize, error: f64, ms: f64| {
            let mut r = record(if method == Method::March { 0 } else { 100 });
            (r.key.method, r.key.steps, r.key.lights) = (method, steps, lights);
            (r.outcome.rel_rmse, r.outcome.frame_ms) = (error, [ms; 3]);
            r
        };
        // Splats 19 + 1 n ms at 5 %, marcher 1 + 4 n ms at 5 %: 19 + n = 1 + 4 n at n = 6.
        let all = [
            at(Method::Splats, 0, 1, 0.05, 20.0),
            at(Method::Splats, 0, 8, 0.05, 27.0),
            at(Method::March, 2, 1, 0.05, 5.0),
            at(Method::March, 2, 8, 0.05, 33.0),
            at(Method::Thesis, 0, 1, 0.15, 9.0),
        ];
        let s = &summarise(&all, base)[0];
        assert_eq!(s.recipe.len(), 1);
        assert!((s.recipe[0].ratio - 3.0).abs() < 1e-12);
        assert_eq!(s.crossovers.len(), 1);
        assert!((s.crossovers[0].lights.unwrap() - 6.0).abs() < 1e-9, "{:?}", s.crossovers);
        let pick = |lights: usize, target: f64| {
            s.fastest.iter().find(|f| f.lights == lights && f.target == target).map(|f| f.method)
        };
        assert_eq!(pick(1, 0.2), Some(Method::March));
        assert_eq!(pick(8, 0.2), Some(Method::Splats));
        assert_eq!(pick(8, 0.02), None);
        let text = text(std::slice::from_ref(s));
        assert!(text.contains("= 3.0") && text.contains("from 6 lights on"), "{text}");
    }
}
