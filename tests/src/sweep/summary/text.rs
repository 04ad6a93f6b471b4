//! Summaries as text.

use super::{CaseSummary, Crossing, Fastest, Ratio};
use crate::sweep::record::Method;

/// The summaries of all cases, one after the other; parts without figures are left out.
pub fn text(summaries: &[CaseSummary]) -> String {
    let mut lines = Vec::new();
    for s in summaries {
        lines.push(format!("== {} ==", s.case));
        let recipe = "Error of the published recipe (its best width and scale) over ours, equal samples:";
        part(&mut lines, recipe, &s.recipe, ratio);
        part(&mut lines, "Against the ray marcher at equal error:", &s.crossovers, crossing);
        part(&mut lines, "Fastest below an error:", &s.fastest, fastest);
        lines.push(String::new());
    }
    lines.join("\n")
}

fn part<T>(lines: &mut Vec<String>, heading: &str, items: &[T], line: fn(&T) -> String) {
    if !items.is_empty() {
        lines.push(heading.to_owned());
        lines.extend(items.iter().map(line));
    }
}

fn ratio(r: &Ratio) -> String {
    let (recipe, splats) = (100.0 * r.recipe, 100.0 * r.splats);
    format!(
        "  {:>6} samples, lights: {:>3}: {recipe:>6.2} % / {splats:>6.2} % = {:.1}",
        r.samples, r.lights, r.ratio
    )
}

fn crossing(c: &Crossing) -> String {
    let marcher = match (c.march_ms, c.march_steps) {
        (Some([fixed, each]), Some(steps)) => {
            format!("; marcher {fixed:.0} + {each:.1} ms a light at {steps:.1} steps")
        }
        _ => String::new(),
    };
    let [fixed, each] = c.splats_ms;
    format!(
        "  {:>6} samples on the {}, {:.2} %, {fixed:.0} + {each:.2} ms a light{marcher}: {}",
        c.samples,
        c.backend,
        100.0 * c.error,
        c.verdict
    )
}

fn fastest(f: &Fastest) -> String {
    let instead = match (f.method, f.splats_ms) {
        (Method::Splats, _) => String::new(),
        (_, Some(ms)) => format!("  (splats: {ms:.0} ms)"),
        (_, None) => "  (no splats get there)".to_owned(),
    };
    format!(
        "  lights: {:>3}, {:>4.0} %: {} ({}), {:.0} ms, {:.2} %{instead}",
        f.lights,
        100.0 * f.target,
        f.method.name(),
        f.setting,
        f.frame_ms,
        100.0 * f.error
    )
}
