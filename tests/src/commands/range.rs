//! `diaphane-validate range`: the whole range of media, lights and views in one table.

use super::image::LightName;
use super::output::{say, tell, warn};
use super::progress::RowDisplay;
use super::{check_folder, make_folder};
use clap::ValueEnum;
use diaphane_bake::params::{Params, Preset};
use diaphane_formats::files::write_atomically;
use diaphane_runtime::player::Backend;
use std::path::PathBuf;
use std::time::Instant;
use validation::metrics::compare;
use validation::play::play;
use validation::range::bakes::{Baked, bake_body, dye};
use validation::range::cache::{Origin, Subject};
use validation::range::objects::Placed;
use validation::range::rows::UNJUDGED_EXTINCTION;
use validation::range::table::{Line, csv, text};
use validation::range::{Row, rows};
use validation::reference::Settings;
use validation::report::{Case, write_pictures, write_report};

/// Which rows, and how.
#[derive(clap::Args)]
#[command(after_help = "Every distinct object and medium is baked once and played on the CPU. References \
                        are kept in DIR/references and used again while nothing that they depend on changes. Writes \
                        range.csv, report.html and report.json, and each row's pictures to DIR/pictures/ROW.\n\n\
                        Examples:\n  diaphane-validate range --output-dir range\n  diaphane-validate range --filter \
                        torus --samples 10000 --max-error 0.1")]
pub struct Arguments {
    /// Folder for everything, made if missing
    #[arg(long, value_name = "DIR", default_value = "out/range")]
    output_dir: PathBuf,
    /// A set of bake parameters; --samples overrides it
    #[arg(long, value_enum, default_value_t = PresetName::Standard, value_name = "P")]
    preset: PresetName,
    /// Stored samples of each bake
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
    /// Only rows whose name holds this text
    #[arg(long, value_name = "TEXT", default_value = "")]
    filter: String,
    /// Columns and rows of the pictures
    #[arg(long, value_name = "SIZE", default_value_t = 96)]
    image: u32,
    /// Largest relative RMSE that passes (0.15 is 15 %)
    #[arg(long, value_name = "E")]
    max_error: Option<f64>,
    /// Relative noise of the references at which to stop
    #[arg(long, default_value_t = 0.003)]
    tolerance: f64,
    /// Where the depth towards lights comes from; exact leaves out the error of the baked light
    #[arg(long, value_enum, default_value_t = LightName::Baked)]
    light: LightName,
    /// Seed of the references' noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print the rows' names and stop
    #[arg(long)]
    list: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum PresetName {
    Draft,
    Standard,
    Fine,
}

impl Arguments {
    fn check(&self) -> anyhow::Result<()> {
        if let Some(e) = self.max_error {
            anyhow::ensure!(e >= 0.0, "--max-error must be a number that is not negative, not {e}");
        }
        let t = self.tolerance;
        anyhow::ensure!(t > 0.0 && t.is_finite(), "--tolerance must be above 0, not {t}");
        anyhow::ensure!(
            (8..=4096).contains(&self.image),
            "--image must lie within 8..4096, not {}",
            self.image
        );
        anyhow::ensure!(self.samples != Some(0), "--samples must be at least 1");
        Ok(())
    }

    fn params(&self) -> Params {
        let preset = Params::preset(match self.preset {
            PresetName::Draft => Preset::Draft,
            PresetName::Standard => Preset::Standard,
            PresetName::Fine => Preset::Fine,
        });
        Params { samples: self.samples.unwrap_or(preset.samples), ..preset }
    }
}

/// Bakes, plays and compares all chosen rows.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    a.check()?;
    let mut chosen = rows();
    chosen.retain(|r| r.name.contains(&a.filter));
    anyhow::ensure!(!chosen.is_empty(), "no row's name holds '{}'; --list names them", a.filter);
    if a.list {
        chosen.iter().for_each(|r| say(&r.name));
        return Ok(true);
    }
    check_folder(&a.output_dir)?;
    make_folder(&a.output_dir.join("references"))?;
    let start = Instant::now();
    let display = RowDisplay::new(chosen.len());
    let mut measured: Vec<Option<(Case, Line)>> = chosen.iter().map(|_| None).collect();
    let mut bakes = 0;
    while let Some(first) = measured.iter().position(Option::is_none) {
        // One bake at a time, and all rows that share it.
        let body = chosen[first].body();
        let placed = body.object.place()?;
        display.work(&chosen[first].name);
        let mut baked = bake_body(&body, &placed, &a.params(), &display)?;
        bakes += 1;
        for (row, slot) in chosen.iter().zip(&mut measured).filter(|(r, _)| r.body() == body) {
            *slot = Some(measure(a, row, &placed, &mut baked, &display)?);
        }
    }
    display.finish();
    let (cases, lines): (Vec<Case>, Vec<Line>) = measured.into_iter().flatten().unzip();
    write_atomically(&a.output_dir.join("range.csv"), csv(&lines).as_bytes())?;
    write_report(&a.output_dir, "diaphane: the range of media, lights and views", &cases)?;
    say(&text(&lines));
    if lines.iter().any(|l| !l.judged) {
        say(&format!(
            "* extinction x diagonal of {UNJUDGED_EXTINCTION}: reported, not judged (no --max-error)"
        ));
    }
    if lines.iter().any(Line::is_noisy) {
        say("~ the reference's noise is above a fifth of the error; a lower --tolerance tells more");
    }
    say(&format!(
        "{} rows, {bakes} bakes, {:.0} s; see {}",
        lines.len(),
        start.elapsed().as_secs_f64(),
        a.output_dir.join("report.html").display()
    ));
    Ok(judge(&lines, a.max_error))
}

/// One row of a body that is baked.
fn measure(
    a: &Arguments,
    row: &Row,
    placed: &Placed,
    baked: &mut Baked,
    display: &RowDisplay,
) -> anyhow::Result<(Case, Line)> {
    display.work(&row.name);
    let scene = row.scene(placed, a.image);
    dye(&mut baked.asset, &row.material);
    let mut played = play(&baked.asset, &scene, Backend::Cpu, a.light.into(), 1)?;
    played.warnings.extend(baked.shortfalls.iter().cloned());
    let settings = Settings { tolerance: a.tolerance, seed: a.seed, ..Settings::default() };
    let medium = row.material.medium(placed)?;
    let subject = Subject { mesh: &placed.mesh, medium: &medium, scene: &scene, settings: &settings };
    let folder = a.output_dir.join("references");
    let (reference, origin) = subject.reference(&folder, &|p| display.reference(p))?;
    if let Origin::Damaged(why) = &origin {
        display.aside(|| tell(&format!("warning: {}: {why}; rendered again", row.name)));
    }
    if !reference.converged {
        played.warnings.push("the reference has more noise than asked for".to_owned());
    }
    let coverage = reference.picture.coverage.clone().unwrap_or_default();
    let metrics = compare(&played.picture, &reference.picture, &coverage)?;
    let line = Line {
        name: row.name.clone(),
        judged: row.is_judged(),
        metrics,
        splats_per_ray: played.splats_per_ray,
        reference_noise: reference.error,
        bake_seconds: baked.seconds,
        samples: baked.asset.info.samples,
        asset_bytes: baked.bytes,
    };
    let case = Case { title: row.name.clone(), played, reference, metrics, facts: facts(row, &line) };
    let pictures = a.output_dir.join("pictures").join(&row.name);
    make_folder(&pictures)?;
    write_pictures(&pictures, &case)?;
    display.aside(|| warn(&case.played.warnings));
    display.done(&format!("rel_rmse {:.4} (reference {})", metrics.rel_rmse, name_of(&origin)));
    Ok((case, line))
}

fn name_of(origin: &Origin) -> &'static str {
    if *origin == Origin::Cached { "cached" } else { "rendered" }
}

fn facts(row: &Row, line: &Line) -> Vec<(String, String)> {
    let m = &row.material;
    let facts = [
        ("object", row.object.name().to_owned()),
        ("extinction x diagonal", format!("{:?}", m.extinction)),
        ("albedo", format!("{:?}", m.albedo)),
        ("phase", format!("{:?}", m.phase)),
        ("index of refraction", m.ior.to_string()),
        ("density", format!("{:?}", m.field)),
        ("view, lights", format!("{:?}, {:?}", row.view, row.lights)),
        ("samples", line.samples.to_string()),
        ("asset", format!("{:.2} MB", line.asset_bytes as f64 * 1e-6)),
        ("bake", format!("{:.1} s", line.bake_seconds)),
    ];
    facts.map(|(n, v)| (n.to_owned(), v)).to_vec()
}

/// Whether all rows pass; says which do not.
fn judge(lines: &[Line], max_error: Option<f64>) -> bool {
    for l in lines.iter().filter(|l| !l.passes(max_error)) {
        let limit = max_error.map_or_else(String::new, |e| format!(" (at most {e})"));
        tell(&format!(
            "check failed: {}: rel_rmse {:.4}{limit}, {} values not finite",
            l.name, l.metrics.rel_rmse, l.metrics.non_finite
        ));
    }
    lines.iter().all(|l| l.passes(max_error))
}
