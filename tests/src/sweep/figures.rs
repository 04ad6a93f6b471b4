//! Measurements as charts: error against frame time, bytes and bake time.

use super::analysis::front;
use super::plan::{Base, EncodingName};
use super::record::{Method, Record};
use diaphane_runtime::plot::{Chart, Joined, Panel, Point, Series, Unit};

/// What stands on the horizontal axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// Frame time with this many lights.
    Time(usize),
    /// Bytes of samples or nodes.
    Bytes,
    /// Seconds of the bake.
    Bake,
}

impl Against {
    fn axis(self) -> (String, Unit) {
        match self {
            Self::Time(_) => ("time of a frame".to_owned(), Unit::Milliseconds),
            Self::Bytes => {
                ("bytes of samples or nodes (mesh and density not counted)".to_owned(), Unit::Bytes)
            }
            Self::Bake => ("time of the bake".to_owned(), Unit::Seconds),
        }
    }

    fn value(self, record: &Record) -> f64 {
        match self {
            Self::Time(_) => record.outcome.frame_ms[1],
            Self::Bytes => record.outcome.light_bytes as f64,
            Self::Bake => record.outcome.bake_s,
        }
    }
}

/// The chart of all cases on one backend. Against bytes and bake time the errors are those with `lights` lights.
pub fn chart(records: &[Record], base: Base, against: Against, lights: usize, backend: &str) -> Chart {
    let lights = if let Against::Time(n) = against { n } else { lights };
    let mut cases: Vec<&str> = Vec::new();
    for r in records {
        if !cases.contains(&r.key.case.as_str()) {
            cases.push(&r.key.case);
        }
    }
    let panels = cases
        .iter()
        .map(|case| {
            let here: Vec<&Record> = records
                .iter()
                .filter(|r| r.key.case == *case && r.key.lights == lights)
                // Rivals have no twin on the GPU and stand in every chart.
                .filter(|r| r.key.backend == backend || r.key.method != Method::Splats)
                // Marching stores and bakes nothing: it has no place on those axes.
                .filter(|r| matches!(against, Against::Time(_)) || r.key.method != Method::March)
                .collect();
            Panel { title: (*case).to_owned(), series: series(&here, base, against) }
        })
        .collect();
    let plural = if lights == 1 { "" } else { "s" };
    let what = match against {
        Against::Time(_) => "frame time",
        Against::Bytes => "size",
        Against::Bake => "bake time",
    };
    let threads = rayon::current_num_threads();
    let machine = if backend == "gpu" {
        format!("splats on the GPU, the others on {threads} CPU threads")
    } else {
        format!("{threads} CPU threads")
    };
    Chart {
        title: format!("Error against {what}, {lights} light{plural}"),
        subtitle: format!(
            "relative RMSE against a ray-marched reference; {machine}; lower left is better; numbers: samples or steps"
        ),
        x: against.axis(),
        y: ("relative RMSE".to_owned(), Unit::Percent),
        panels,
    }
}

fn series(records: &[&Record], base: Base, against: Against) -> Vec<Series> {
    let values: Vec<(f64, f64)> = records.iter().map(|r| (against.value(r), r.outcome.rel_rmse)).collect();
    let fronts = front(&values);
    let on_axis = |r: &Record| {
        let k = &r.key;
        k.method != Method::Splats
            || (k.order == base.order
                && k.directions == base.directions
                && k.encoding == EncodingName::DEFAULT.name()
                && k.preset == "standard")
    };
    let pick = |name: &str, style: usize, joined: Joined, wanted: &dyn Fn(&Record) -> bool| {
        let mut points: Vec<(usize, Point)> = records
            .iter()
            .zip(&fronts)
            .zip(&values)
            .filter(|((r, _), _)| wanted(r))
            .map(|((r, front), (x, y))| {
                let number = if r.key.method == Method::March { r.key.steps } else { r.key.samples };
                let mark = if joined == Joined::Line { short(number) } else { String::new() };
                (number, Point { x: *x, y: *y, tip: tip(r), mark, front: *front })
            })
            .collect();
        points.sort_by_key(|(number, _)| *number);
        Series { name: name.to_owned(), style, joined, points: points.into_iter().map(|p| p.1).collect() }
    };
    let is = |m: Method| move |r: &Record| r.key.method == m;
    vec![
        pick("splats, by samples", 0, Joined::Line, &|r| r.key.method == Method::Splats && on_axis(r)),
        pick("splats, other settings", 0, Joined::No, &|r| r.key.method == Method::Splats && !on_axis(r)),
        pick("thesis' recipe", 1, Joined::Line, &is(Method::Thesis)),
        pick("ray marcher, by steps", 2, Joined::Line, &is(Method::March)),
        pick("grid of equal bytes", 3, Joined::Line, &is(Method::Grid)),
    ]
}

/// 8000 as 8k.
fn short(n: usize) -> String {
    if n >= 1000 && n.is_multiple_of(100) { format!("{}k", n as f64 / 1e3) } else { n.to_string() }
}

/// Everything about a measurement in one line.
fn tip(record: &Record) -> String {
    let (k, o) = (&record.key, &record.outcome);
    let mut parts = vec![k.method.name().to_owned()];
    if k.samples > 0 {
        parts.push(format!("{} samples", k.samples));
        parts.push(format!("{} bands of {}", k.order, k.encoding));
        parts.push(format!("{} directions", k.directions));
        parts.push(k.preset.clone());
    }
    if k.steps > 0 {
        parts.push(format!("{} steps", k.steps));
    }
    parts.push(format!("{:.2} %", 100.0 * o.rel_rmse));
    parts.push(Unit::Milliseconds.label(o.frame_ms[1]));
    parts.push(Unit::Bytes.label(o.bytes as f64) + " in all");
    if !o.note.is_empty() {
        parts.push(o.note.clone());
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::record::samples::record;

    #[test]
    fn points_go_where_they_belong() {
        let mut marched = record(0);
        marched.key.method = Method::March;
        marched.key.steps = 4;
        marched.outcome.rel_rmse = 0.2;
        marched.outcome.frame_ms = [9.0; 3];
        let mut odd = record(100);
        odd.key.order = 9;
        odd.outcome.rel_rmse = 0.05;
        odd.outcome.frame_ms = [4.0; 3];
        let mut other_light = record(200);
        other_light.key.lights = 1;
        let base = Base { samples: 100, order: 5, directions: 64 };
        let all = [record(100), marched, odd, other_light];
        let c = chart(&all, base, Against::Time(8), 8, "cpu");
        assert_eq!(c.panels.len(), 1);
        let counts: Vec<usize> = c.panels[0].series.iter().map(|s| s.points.len()).collect();
        assert_eq!(counts, [1, 1, 0, 1, 0]);
        let fronts: Vec<bool> = c.panels[0].series.iter().flat_map(|s| &s.points).map(|p| p.front).collect();
        // 2 ms at 10 %, 4 ms at 5 %, and a marcher that is worse in both.
        assert_eq!(fronts, [true, true, false]);
        // No march on the axis of bake times.
        let c = chart(&all, base, Against::Bake, 8, "cpu");
        assert!(c.panels[0].series[3].points.is_empty());
        assert_eq!((short(8000), short(2500), short(750)), ("8k".into(), "2.5k".into(), "750".into()));
    }
}
