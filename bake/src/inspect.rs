//! `diaphane-bake inspect`.

use crate::terminal::say;
use diaphane_bake::report;
use diaphane_formats::asset::{self, Asset, Certificate};
use diaphane_formats::files;
use serde_json::{Value, json};
use std::path::Path;

/// Prints what is in an asset.
pub fn show(path: &Path, as_json: bool) -> anyhow::Result<()> {
    let bytes = files::read(path, files::Kind::Asset)?;
    let in_file = |e: diaphane_formats::Error| e.in_file(path);
    let asset = asset::parse(&bytes).map_err(in_file)?;
    let sections = asset::section_sizes(&bytes).map_err(in_file)?;
    if as_json {
        say(&format!("{:#}", describe(&asset, &sections, bytes.len())));
    } else {
        print_text(path, &asset, &sections, bytes.len());
    }
    Ok(())
}

fn describe(asset: &Asset, sections: &[(&'static str, usize)], bytes: usize) -> Value {
    let sizes: serde_json::Map<String, Value> =
        sections.iter().map(|(n, s)| ((*n).to_owned(), json!(s))).collect();
    json!({
        "format_version": asset::FORMAT_VERSION,
        "bytes": bytes,
        "bytes_per_sample": bytes_per_sample(asset, sections),
        "sections": sizes,
        "diagonal": asset.info.diagonal(),
        "levels": report::levels(asset),
        "info": asset.info,
    })
}

/// Average over the sections that grow with the samples.
fn bytes_per_sample(asset: &Asset, sections: &[(&'static str, usize)]) -> f64 {
    const PER_SAMPLE: [&str; 8] =
        ["place", "offset", "weight", "depth", "depth_scale", "lobe", "boundary", "boundary_scale"];
    let sum: usize = sections.iter().filter(|(n, _)| PER_SAMPLE.contains(n)).map(|(_, s)| s).sum();
    sum as f64 / asset.samples.len().max(1) as f64
}

/// A relative error for people.
pub fn percent(error: f64) -> String {
    format!("{:.2} %", 100.0 * error)
}

/// The certificate in one line.
pub fn certified(certificate: Option<&Certificate>) -> String {
    let Some(c) = certificate else { return "no certificate: the bake did not measure it".to_owned() };
    let with = format!("{} rays in {} views, {} lights, seed {}", c.rays, c.views, c.lights, c.seed);
    let Some(e) = &c.error else { return format!("not measurable: no light leaves the object ({with})") };
    format!(
        "{} rel. RMSE, {:.1} dB, bias {:+.2} %; interpolation {:.2} %, light representation {:.2} % ({with})",
        percent(e.rel_rmse),
        e.psnr_db,
        100.0 * e.bias,
        100.0 * e.interpolation,
        100.0 * e.representation
    )
}

fn print_text(path: &Path, asset: &Asset, sections: &[(&'static str, usize)], bytes: usize) {
    let i = &asset.info;
    let p = &i.provenance;
    say(&format!("{}  {:.2} MB, format {}", path.display(), bytes as f64 / 1e6, asset::FORMAT_VERSION));
    say(&format!(
        "  made by      {} from {} and {}, seed {}",
        p.program, p.mesh_name, p.material_name, p.seed
    ));
    say(&format!(
        "  mesh         {} vertices, {} triangles, diagonal {}",
        p.mesh_report.vertices,
        p.mesh_report.triangles,
        i.diagonal()
    ));
    for line in p.mesh_report.warnings() {
        say(&format!("               {line}"));
    }
    say(&format!("  extinction   {:?} per mesh unit", i.extinction));
    say(&format!("  albedo       {:?}", i.albedo));
    say(&format!("  phase        {:?}, ior {}", i.phase, i.ior));
    let density = asset.density.as_ref().map_or_else(
        || format!("{} everywhere", i.uniform_density),
        |g| format!("grid of {} x {} x {}", g.size[0], g.size[1], g.size[2]),
    );
    say(&format!("  density      {density}"));
    say(&format!(
        "  samples      {} ({} dropped as dark), {} directions, at most {} bands, {:?}, width factor {}",
        i.samples, i.discarded, p.directions, i.order, i.encoding, i.width_factor
    ));
    for (k, level) in report::levels(asset).iter().enumerate().skip(1) {
        let error = level.error.map_or(String::new(), |e| format!(", error {:.2} %", 100.0 * e));
        say(&format!("  level {k:<7}{} samples, width factor {}{error}", level.samples, level.width_factor));
    }
    say(&format!("  error        {}", certified(i.certificate.as_ref())));
    say(&format!("  per sample   {:.1} bytes", bytes_per_sample(asset, sections)));
    for (name, size) in sections {
        say(&format!("    {name:<16} {size:>12} bytes"));
    }
}
