//! The benchmark's charts: a file for each axis, and one of all methods at equal error.

use super::methods::Method;
use super::{Row, Table};
use anyhow::Result;
use diaphane_formats::files;
use diaphane_runtime::plot::{Chart, Joined, Panel, Point, Series, Unit, render};
use std::path::Path;

/// Writes the charts of what was measured.
pub fn write(folder: &Path, table: &Table) -> Result<()> {
    for (name, chart) in charts(table) {
        files::write_atomically(&folder.join(format!("{name}.svg")), render(&chart).as_bytes())?;
    }
    Ok(())
}

fn charts(table: &Table) -> Vec<(&'static str, Chart)> {
    let along = |x: fn(&Row) -> f64, axes: &[(&'static str, usize)]| -> Vec<Series> {
        let series = |(axis, style): &(&'static str, usize)| Series {
            name: (*axis).to_owned(),
            style: *style,
            joined: Joined::Line,
            points: table
                .rows
                .iter()
                .filter(|r| r.cell.axis == *axis)
                .map(|r| point(x(r), r.frame_ms))
                .collect(),
        };
        axes.iter().map(series).filter(|s| !s.points.is_empty()).collect()
    };
    let pixels = |r: &Row| f64::from(r.cell.size[0]) * f64::from(r.cell.size[1]);
    let lights = along(|r| r.cell.lights as f64, &[("point lights", 0), ("directional lights", 1)]);
    let samples = along(|r| r.samples as f64, &[("level of detail", 0), ("samples", 1)]);
    let mut all = vec![
        ("lights", "Frame time against lights", "lights", lights),
        ("resolution", "Frame time against pixels", "pixels", along(pixels, &[("resolution", 0)])),
        ("samples", "Frame time against samples", "samples", samples),
    ];
    if let Some(rivals) = &table.rivals {
        let series = |method: Method| Series {
            name: method.name().to_owned(),
            style: method as usize,
            joined: Joined::Line,
            points: rivals
                .rows
                .iter()
                .filter(|r| r.method == method)
                .map(|r| point(r.lights as f64, r.ms))
                .collect(),
        };
        let series = Method::ALL.into_iter().map(series).filter(|s| !s.points.is_empty()).collect();
        all.push(("rivals", "Frame time at equal error", "point lights", series));
    }
    all.into_iter()
        .filter(|(.., series)| !series.is_empty())
        .map(|(name, title, x, series)| {
            let chart = Chart {
                title: title.to_owned(),
                subtitle: table.adapter.clone(),
                x: (x.to_owned(), Unit::Count),
                y: ("frame".to_owned(), Unit::Milliseconds),
                panels: vec![Panel { title: String::new(), series }],
            };
            (name, chart)
        })
        .collect()
}

fn point(x: f64, ms: f64) -> Point {
    Point { x, y: ms, tip: format!("{x}: {ms:.1} ms"), mark: String::new(), front: false }
}
