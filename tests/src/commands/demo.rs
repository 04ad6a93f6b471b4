//! `diaphane-validate demo`: the whole story on the built-in objects.

use super::image::BackendName;
use super::output::{say, tell, warn};
use super::progress::Display;
use super::{Inputs, check_folder, make_folder};
use diaphane_bake::params::{Params, Preset};
use diaphane_bake::{Input, bake};
use diaphane_formats::{asset, mesh};
use diaphane_runtime::player::LightMode;
use std::path::PathBuf;
use std::time::Instant;
use validation::metrics::compare;
use validation::play::play;
use validation::reference::{Settings, render};
use validation::report::{Case, write_pictures, write_report};

/// Relative RMSE that every object must stay below.
const MAX_ERROR: f64 = 0.3;

/// Noise of the references.
const NOISE: f64 = 0.018;

/// Where to write.
#[derive(clap::Args)]
#[command(
    after_help = "Writes the objects' files, assets, pictures and error maps to one folder for each object, and \
                        report.html and report.json beside them.\n\nExample:\n  diaphane-validate demo --output-dir out"
)]
pub struct Arguments {
    /// Folder for everything, made if missing
    #[arg(long, value_name = "DIR", default_value = "out")]
    output_dir: PathBuf,
    /// What draws
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    backend: BackendName,
    /// Stored samples of each object
    #[arg(long, default_value_t = 8_000)]
    samples: usize,
}

/// One line of the table.
struct Line {
    samples: usize,
    bytes: usize,
    bake: f64,
    reference: f64,
}

/// Bakes, plays and checks.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    let start = Instant::now();
    check_folder(&a.output_dir)?;
    make_folder(&a.output_dir)?;
    let written = diaphane_assets::write_all(&a.output_dir.join("inputs"))?;
    let mut cases = Vec::new();
    let mut lines = Vec::new();
    for (files, object) in written.iter().zip(diaphane_assets::OBJECTS) {
        let folder = a.output_dir.join(object.name);
        make_folder(&folder)?;
        let inputs =
            Inputs { mesh: files.mesh.clone(), material: files.material.clone(), scene: files.scene.clone() };
        let (case, line) = object_case(a, object.name, object.title, &inputs, &folder)?;
        warn(&case.played.warnings);
        write_pictures(&folder, &case)?;
        cases.push(case);
        lines.push(line);
    }
    write_report(&a.output_dir, "diaphane: from mesh to picture", &cases)?;
    print_table(&cases, &lines);
    say(&format!(
        "{:.1} s in all; see {}",
        start.elapsed().as_secs_f64(),
        a.output_dir.join("report.html").display()
    ));
    let mut good = true;
    for c in &cases {
        if !(c.metrics.rel_rmse <= MAX_ERROR && c.metrics.non_finite == 0) {
            good = false;
            tell(&format!(
                "check failed: {}: rel_rmse {:.3} (at most {MAX_ERROR}), {} values not finite",
                c.title, c.metrics.rel_rmse, c.metrics.non_finite
            ));
        }
    }
    Ok(good)
}

fn object_case(
    a: &Arguments,
    name: &str,
    title: &str,
    inputs: &Inputs,
    folder: &std::path::Path,
) -> anyhow::Result<(Case, Line)> {
    let loaded = inputs.load()?;
    let (_, mesh_report) = mesh::load_obj(&inputs.mesh)?;
    let display = Display::new(&format!("{name}: bake"));
    display.announce();
    let params = Params { samples: a.samples, ..Params::preset(Preset::Standard) };
    let file_name =
        |p: &PathBuf| p.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let input = Input {
        mesh: &loaded.mesh,
        mesh_report: &mesh_report,
        medium: &loaded.medium,
        mesh_name: file_name(&inputs.mesh),
        material_name: file_name(&inputs.material),
    };
    let begun = Instant::now();
    let (baked, report) = bake(&input, &params, &display)?;
    let bake_seconds = begun.elapsed().as_secs_f64();
    display.finish();
    let path = folder.join(format!("{name}.dph"));
    asset::write(&path, &baked)?;
    // What is played is what was written.
    let baked = asset::read(&path)?;
    let played = play(&baked, &loaded.scene, a.backend.into(), LightMode::Baked, 2)?;
    let settings = Settings { tolerance: NOISE, ..Settings::default() };
    let display = Display::new(&format!("{name}: reference"));
    let begun = Instant::now();
    let reference =
        render(&loaded.mesh, &loaded.medium, &loaded.scene, &settings, &|p| display.reference(p))?;
    let reference_seconds = begun.elapsed().as_secs_f64();
    display.finish();
    let coverage = reference.picture.coverage.clone().unwrap_or_default();
    let metrics = compare(&played.picture, &reference.picture, &coverage)?;
    let line = Line {
        samples: report.samples,
        bytes: report.bytes,
        bake: bake_seconds,
        reference: reference_seconds,
    };
    let facts = [
        ("triangles", loaded.mesh.triangles.len().to_string()),
        ("lights", loaded.scene.lights.len().to_string()),
        ("samples", report.samples.to_string()),
        ("directions", report.directions.to_string()),
        ("harmonic bands", report.sh_order.to_string()),
        ("asset", format!("{:.2} MB", report.bytes as f64 * 1e-6)),
        ("bake", format!("{bake_seconds:.1} s")),
        ("reference", format!("{reference_seconds:.1} s")),
    ];
    let facts = facts.map(|(n, v)| (n.to_owned(), v)).to_vec();
    Ok((Case { title: format!("{name}: {title}"), played, reference, metrics, facts }, line))
}

fn print_table(cases: &[Case], lines: &[Line]) {
    say(&format!(
        "{:<8} {:>8} {:>10} {:>7} {:>10} {:>9} {:>8} {:>9} {:>7}",
        "object", "samples", "bytes", "bake s", "frame ms", "rel_rmse", "PSNR dB", "ref. s", "noise"
    ));
    for (c, l) in cases.iter().zip(lines) {
        say(&format!(
            "{:<8} {:>8} {:>10} {:>7.1} {:>10.1} {:>9.4} {:>8.2} {:>9.1} {:>5.2} %",
            c.title.split(':').next().unwrap_or_default(),
            l.samples,
            l.bytes,
            l.bake,
            c.played.frame_ms,
            c.metrics.rel_rmse,
            c.metrics.psnr_db,
            l.reference,
            100.0 * c.reference.error
        ));
    }
}
