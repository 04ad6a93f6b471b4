//! Arguments and what they do.

use crate::batch::{self, BatchArguments};
use crate::inspect;
use crate::terminal::{Bars, say, tell};
use anyhow::{Context, bail};
use clap::{Args, Parser, Subcommand, ValueEnum};
use diaphane_bake::params::{Params, Preset, Representation, Visibility};
use diaphane_bake::report::Report;
use diaphane_bake::{Input, bake, memory};
use diaphane_formats::{asset, files, material, mesh};
use std::path::{Path, PathBuf};

/// Bakes a closed mesh filled with a translucent material into one compact asset for the player.
#[derive(Parser)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  \
        diaphane-bake bunny.obj --material wax.material.toml --output bunny.dph\n  \
        diaphane-bake bunny.obj --material wax.material.toml --output bunny.dph --preset draft\n  \
        diaphane-bake bunny.obj --material wax.material.toml --output bunny.dph --samples 100000 --report bake.json\n  \
        diaphane-bake bunny.obj --material wax.material.toml --output bunny.dph --max-error 0.03\n  \
        diaphane-bake bunny.obj --material wax.material.toml --output bunny.dph --cache bakes --sh-order 8\n  \
        diaphane-bake inspect bunny.dph --json\n  \
        diaphane-bake batch assets.toml"
)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    bake: BakeArguments,
}

#[derive(Subcommand)]
enum Command {
    /// Shows what is in an asset, its sizes and its error certificate.
    Inspect {
        /// The asset.
        asset: PathBuf,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Bakes a list, one after the other; a failure does not stop the rest.
    Batch(BatchArguments),
}

#[derive(Args)]
struct BakeArguments {
    /// The mesh: a closed surface in OBJ format.
    #[arg(required = true)]
    mesh: Option<PathBuf>,
    /// What fills it (*.material.toml).
    #[arg(long, required = true, value_name = "M.toml")]
    material: Option<PathBuf>,
    /// The asset to write.
    #[arg(long, short, required = true, value_name = "A.dph")]
    output: Option<PathBuf>,
    /// A set of parameters; the options below override it.
    #[arg(long, value_enum, default_value_t = PresetName::Standard)]
    preset: PresetName,
    /// Stored samples (met within 5 %).
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
    /// Directions in which the optical depth of each sample is computed (rounded up to an even number).
    #[arg(long, value_name = "D")]
    directions: Option<usize>,
    /// Points around each sample that one direction sees; others see other points, 16 in all.
    #[arg(long, value_name = "P")]
    points: Option<usize>,
    /// Most bands of spherical harmonics, 1 to 14; a sample gets as few as it needs. Not given, samples in need get up to
    /// 14 with the bytes that others leave.
    #[arg(long, value_name = "K")]
    sh_order: Option<usize>,
    /// Error of a sample's transmittance below which it gets no more bands (0: every sample gets all).
    #[arg(long, value_name = "E")]
    light_error: Option<f64>,
    /// Most times that all samples are moved and resized to lower the error of rays (0: never).
    #[arg(long, value_name = "ROUNDS")]
    refine: Option<usize>,
    /// How optical depths are found; the result is the same.
    #[arg(long, value_enum, default_value_t = VisibilityName::Auto)]
    visibility: VisibilityName,
    /// What the harmonics represent.
    #[arg(long, value_enum, default_value_t = EncodingName::Lobe)]
    encoding: EncodingName,
    /// Seed of all random choices.
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Threads to use; all cores if not given. The asset does not depend on it.
    #[arg(long, value_name = "T")]
    threads: Option<usize>,
    /// Largest relative error of the certificate (0.03 is 3 %): adds samples or bands until it is met, or fails.
    #[arg(long, value_name = "E", conflicts_with = "no_certificate")]
    max_error: Option<f64>,
    /// Does not measure the asset's error.
    #[arg(long)]
    no_certificate: bool,
    /// Keeps the results of all stages in this folder and finds them there again: a bake with another albedo or fewer bands,
    /// or one that was interrupted, repeats only what differs. About 2 bytes for each sample and direction; anything in it can
    /// be deleted at any time.
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Refuses bakes that would take more memory (such as 4G or 500M); the need is predicted before any work.
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    memory_limit: Option<u64>,
    /// Writes a report in JSON.
    #[arg(long, value_name = "R.json")]
    report: Option<PathBuf>,
    /// No progress bars and no summary.
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum PresetName {
    /// 5,000 samples, 96 directions, at most 6 bands.
    Draft,
    /// 50,000 samples, 1,024 directions, at most 10 bands.
    Standard,
    /// 50,000 samples, refined, 1,536 directions, at most 14 bands.
    Fine,
}

#[derive(Clone, Copy, ValueEnum)]
enum VisibilityName {
    /// Whichever should be faster.
    Auto,
    /// Triangles are projected onto the samples.
    Project,
    /// Rays are traced through a box hierarchy: the oracle.
    Trace,
}

#[derive(Clone, Copy, ValueEnum)]
enum EncodingName {
    /// 1/(τ+ε), fitted to the transmittance.
    Reciprocal,
    /// The same, with a lobe towards the nearest surface for samples that it helps.
    Lobe,
    /// The optical depth τ, fitted to the transmittance.
    Depth,
    /// The transmittance, projected: the baseline.
    Transmittance,
}

impl BakeArguments {
    fn params(&self) -> Params {
        let mut params = Params::preset(match self.preset {
            PresetName::Draft => Preset::Draft,
            PresetName::Standard => Preset::Standard,
            PresetName::Fine => Preset::Fine,
        });
        params.samples = self.samples.unwrap_or(params.samples);
        params.directions = self.directions.unwrap_or(params.directions);
        params.points_per_sample = self.points.unwrap_or(params.points_per_sample);
        if let Some(order) = self.sh_order {
            (params.order, params.extra_bands) = (order, 0);
        }
        params.light_error = self.light_error.unwrap_or(params.light_error);
        params.refine = self.refine.unwrap_or(params.refine);
        params.seed = self.seed.unwrap_or(params.seed);
        params.certificate = !self.no_certificate;
        params.max_error = self.max_error;
        params.cache = self.cache.clone();
        params.memory_limit = self.memory_limit;
        params.visibility = match self.visibility {
            VisibilityName::Auto => Visibility::Auto,
            VisibilityName::Project => Visibility::Project,
            VisibilityName::Trace => Visibility::Trace,
        };
        params.representation = match self.encoding {
            EncodingName::Reciprocal => Representation::Reciprocal,
            EncodingName::Lobe => Representation::Lobe,
            EncodingName::Depth => Representation::Depth,
            EncodingName::Transmittance => Representation::Transmittance,
        };
        params
    }
}

impl Arguments {
    /// The asset to write; empty for other commands than a bake.
    pub fn output(&self) -> &Path {
        self.bake.output.as_deref().unwrap_or(Path::new(""))
    }
}

/// Runs the command line.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    match &arguments.command {
        Some(Command::Inspect { asset, json }) => inspect::show(asset, *json),
        Some(Command::Batch(batch)) => batch::run(batch),
        None => {
            use_threads(arguments.bake.threads)?;
            let bars = Bars::new(arguments.bake.quiet);
            bars.cancel_on_interrupt().context("cannot listen for Ctrl-C")?;
            let report = run_bake(arguments, &bars)?;
            if !arguments.bake.quiet {
                say(&summary(arguments.output(), &report));
            }
            Ok(())
        }
    }
}

/// Bakes with so many threads from now on.
pub fn use_threads(threads: Option<usize>) -> anyhow::Result<()> {
    let Some(threads) = threads else { return Ok(()) };
    if !(1..=1024).contains(&threads) {
        bail!("--threads must lie within 1..1024, not {threads}");
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("cannot start the threads")
}

/// One bake.
pub fn run_bake(arguments: &Arguments, bars: &Bars) -> anyhow::Result<Report> {
    let arguments = &arguments.bake;
    let (Some(mesh_path), Some(material_path), Some(output)) =
        (&arguments.mesh, &arguments.material, &arguments.output)
    else {
        bail!("MESH, --material and --output are needed; see --help");
    };
    for input in [mesh_path, material_path] {
        files::require_different(output, input)?;
        if let Some(report) = &arguments.report {
            files::require_different(report, input)?;
        }
    }
    if let Some(report) = &arguments.report {
        files::require_different(report, output)?;
        files::require_writable(report)?;
    }
    files::require_writable(output)?;
    let left = files::remove_unfinished(output);
    if left > 0 && !arguments.quiet {
        tell(&format!(
            "note: removed {left} unfinished file(s) of earlier bakes beside '{}'",
            output.display()
        ));
    }
    let medium = material::load(material_path)?;
    let (mesh, mesh_report) = mesh::load_obj(mesh_path)?;
    if !arguments.quiet {
        for line in mesh_report.warnings() {
            tell(&format!("{}: {line}", mesh_path.display()));
        }
    }
    let input = Input {
        mesh: &mesh,
        mesh_report: &mesh_report,
        medium: &medium,
        mesh_name: file_name(mesh_path),
        material_name: file_name(material_path),
    };
    let params = arguments.params();
    let needed = memory::required(&input, &params)?;
    if !arguments.quiet {
        tell(&format!("about {} of memory will be needed", memory::megabytes(needed)));
    }
    let result = bake(&input, &params, bars);
    bars.finish();
    let (baked, report) = result?;
    asset::write(output, &baked)?;
    if let Some(path) = &arguments.report {
        let text = serde_json::to_string_pretty(&report).context("cannot encode the report")?;
        files::write_atomically(path, text.as_bytes())?;
    }
    for line in &report.shortfalls {
        tell(&format!("warning: {line}"));
    }
    Ok(report)
}

/// Two lines on a bake.
fn summary(output: &Path, report: &Report) -> String {
    format!(
        "{}: {} samples, {} directions, {} bands, {:.1} MB, {:.1} s\nerror: {}",
        output.display(),
        report.samples,
        report.directions,
        report.sh_order,
        report.bytes as f64 / 1e6,
        report.seconds.get("total").copied().unwrap_or_default(),
        inspect::certified(report.certificate.as_ref())
    )
}

/// Bytes from a number with K, M or G (powers of 1,000), KiB, MiB or GiB (of 1,024), or nothing behind it.
fn memory_size(text: &str) -> Result<u64, String> {
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let factor = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "kib" => 1024.0,
        "mib" => 1024.0 * 1024.0,
        "gib" => 1024.0 * 1024.0 * 1024.0,
        _ => return Err("write it as 500M, 4G or 4GiB".to_owned()),
    };
    match number.parse::<f64>() {
        Ok(n) if n * factor >= 1.0 && n.is_finite() => Ok((n * factor) as u64),
        _ => Err("write it as 500M, 4G or 4GiB".to_owned()),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}
