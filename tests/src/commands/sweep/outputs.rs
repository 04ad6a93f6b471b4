//! What a sweep leaves for people and other programs.

use super::arguments::{Checked, SweepBackend};
use diaphane_formats::files::write_atomically;
use diaphane_runtime::plot;
use std::path::Path;
use validation::sweep::figures::{Against, chart};
use validation::sweep::plan::Base;
use validation::sweep::record::Record;
use validation::sweep::summary::{self, summarise};
use validation::sweep::table::csv;

/// Writes table, summaries and charts.
pub fn write(
    folder: &Path,
    records: &[Record],
    checked: &Checked,
    backend: SweepBackend,
) -> anyhow::Result<()> {
    let put = |name: String, text: &str| write_atomically(&folder.join(name), text.as_bytes());
    put("sweep.csv".to_owned(), &csv(records))?;
    let base = checked.axes.base;
    put("summary.txt".to_owned(), &text(records, base))?;
    put("summary.json".to_owned(), &serde_json::to_string_pretty(&summarise(records, base))?)?;
    // Bytes and bake time do not depend on the lights; the middle number of them shows the errors.
    let lights = &checked.axes.lights;
    let middle = lights[lights.len() / 2];
    let backends: &[&str] = match backend {
        SweepBackend::Cpu => &["cpu"],
        SweepBackend::Gpu => &["cpu", "gpu"],
    };
    for backend in backends {
        let draw = |name: String, against: Against| {
            put(
                format!("{name}-{backend}.svg"),
                &plot::render(&chart(records, base, against, middle, backend)),
            )
        };
        for n in lights {
            draw(format!("error-time-{n}"), Against::Time(*n))?;
        }
        draw("error-bytes".to_owned(), Against::Bytes)?;
        draw("error-bake".to_owned(), Against::Bake)?;
    }
    Ok(())
}

/// The summary as text.
pub fn text(records: &[Record], base: Base) -> String {
    summary::text(&summarise(records, base))
}
