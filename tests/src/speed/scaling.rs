//! How the time of a bake grows: with samples, with triangles, with directions.

use super::bakes::{medium, seconds, timed};
use super::ball::bumpy_ball;
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::progress::Silent;
use diaphane_bake::report::Report;
use diaphane_runtime::plot::{Chart, Joined, Panel, Point, Series, Unit};
use serde::Serialize;

/// What is varied, the rest being held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Samples, 10,000 to 1,000,000.
    Samples,
    /// Triangles, 10,000 to 2,000,000.
    Triangles,
    /// Directions, 64 to 1,024.
    Directions,
}

/// All of them.
pub const AXES: [Axis; 3] = [Axis::Samples, Axis::Triangles, Axis::Directions];

/// One bake.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Wanted samples.
    pub samples: usize,
    /// About as many triangles.
    pub triangles: usize,
    /// Directions of each sample.
    pub directions: usize,
}

impl Axis {
    /// As it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Triangles => "triangles",
            Self::Directions => "directions",
        }
    }

    /// The bakes along it; `quick` leaves out those that take long.
    pub fn sizes(self, quick: bool) -> Vec<Size> {
        let usual = Size { samples: 30_000, triangles: 30_000, directions: 64 };
        let (steps, most): (&[usize], usize) = match self {
            Self::Samples => (&[10_000, 30_000, 100_000, 300_000, 1_000_000], 100_000),
            Self::Triangles => (&[10_000, 40_000, 150_000, 600_000, 2_000_000], 150_000),
            Self::Directions => (&[64, 128, 256, 512, 1_024], 256),
        };
        let with = |n: &usize| match self {
            Self::Samples => Size { samples: *n, ..usual },
            Self::Triangles => Size { triangles: *n, ..usual },
            Self::Directions => Size { directions: *n, ..usual },
        };
        steps.iter().filter(|n| !quick || **n <= most).map(with).collect()
    }

    fn of(self, size: &Size) -> usize {
        match self {
            Self::Samples => size.samples,
            Self::Triangles => size.triangles,
            Self::Directions => size.directions,
        }
    }
}

/// One measured bake.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Name of what was varied.
    pub axis: &'static str,
    /// How much of it there was.
    pub value: usize,
    /// The bake's own report.
    pub report: Report,
}

/// Bakes a bumpy ball of this size.
///
/// # Errors
/// None that a sound mesh could cause.
pub fn measure(axis: Axis, size: &Size) -> anyhow::Result<Measured> {
    let mesh = bumpy_ball(size.triangles)?;
    let medium = medium(&mesh, false)?;
    let params = Params {
        samples: size.samples,
        directions: size.directions,
        order: 5,
        extra_bands: 0,
        ..Params::preset(Preset::Standard)
    };
    let report = timed(&mesh, &medium, &params, &Silent)?;
    Ok(Measured { axis: axis.name(), value: axis.of(size), report })
}

/// Parts of a bake in the chart.
const PARTS: [(&str, &[&str]); 4] = [
    ("whole bake", &["total"]),
    ("optical depth", &["optical depth"]),
    ("fits", &["harmonics", "more bands", "rounding", "weights"]),
    ("placing", &["mesh", "distance field", "layers", "density", "samples", "cells"]),
];

fn part(report: &Report, stages: &[&str]) -> f64 {
    stages.iter().map(|s| seconds(report, s)).sum()
}

/// Slope of the logarithms of the whole bake's time, by least squares; 0 for fewer than two bakes.
pub fn slope(bakes: &[&Measured]) -> f64 {
    let points: Vec<[f64; 2]> =
        bakes.iter().map(|b| [(b.value as f64).ln(), seconds(&b.report, "total").ln()]).collect();
    let n = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let moment = |k: usize| points.iter().map(|p| (p[0] - mean[0]) * (p[k] - mean[k])).sum::<f64>();
    if points.len() < 2 { 0.0 } else { moment(1) / moment(0) }
}

/// Slope between the two largest bakes: what is fixed counts least there.
pub fn last_slope(bakes: &[&Measured]) -> f64 {
    slope(&bakes[bakes.len().saturating_sub(2)..])
}

/// The chart of all bakes.
pub fn chart(bakes: &[Measured]) -> Chart {
    let panel = |axis: Axis| {
        let own: Vec<&Measured> = bakes.iter().filter(|b| b.axis == axis.name()).collect();
        let series = |(style, (name, stages)): (usize, &(&str, &[&str]))| Series {
            name: (*name).to_owned(),
            style,
            joined: Joined::Line,
            points: own
                .iter()
                .map(|b| {
                    let s = part(&b.report, stages);
                    Point {
                        x: b.value as f64,
                        y: s,
                        tip: format!("{} {}: {s:.2} s", b.value, axis.name()),
                        mark: String::new(),
                        front: false,
                    }
                })
                .collect(),
        };
        Panel {
            title: format!("{} (slope {:.2})", axis.name(), slope(&own)),
            series: PARTS.iter().enumerate().map(series).collect(),
        }
    };
    Chart {
        title: "Time of a bake".to_owned(),
        subtitle: "a bumpy ball; 30,000 samples, 30,000 triangles and 64 directions where not varied"
            .to_owned(),
        x: ("how many".to_owned(), Unit::Count),
        y: ("time".to_owned(), Unit::Seconds),
        panels: AXES.map(panel).to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_bakes_are_measured_and_drawn() {
        let size = Size { samples: 300, triangles: 1_000, directions: 16 };
        let one = measure(Axis::Samples, &size).unwrap();
        let twice = Measured { value: 600, ..one.clone() };
        let mut four_times = Measured { value: 1_200, ..one.clone() };
        assert!(seconds(&one.report, "total") > 0.0);
        assert!(slope(&[&one, &twice]).abs() < 1e-9);
        assert_eq!(slope(&[&one]), 0.0);
        four_times.report.seconds.insert("total".to_owned(), 4.0 * seconds(&one.report, "total"));
        assert!((slope(&[&one, &four_times]) - 1.0).abs() < 1e-9);
        assert!((last_slope(&[&one, &twice, &four_times]) - 2.0).abs() < 1e-9);
        let drawn = diaphane_runtime::plot::render(&chart(&[one, twice, four_times]));
        assert!(drawn.contains("samples (slope") && drawn.contains("optical depth"));
        assert!(!drawn.contains("front"));
    }

    #[test]
    fn quick_leaves_out_the_long_ones() {
        for axis in AXES {
            assert!(axis.sizes(true).len() >= 3 && axis.sizes(false).len() == 5);
        }
    }
}
