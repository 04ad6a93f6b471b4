//! `diaphane-validate image`.

use super::compare::print_metrics;
use super::output::{say, tell, warn};
use super::progress::Display;
use super::{Inputs, check_folder, make_folder};
use clap::ValueEnum;
use diaphane_formats::asset::{self, Asset};
use diaphane_formats::files;
use diaphane_formats::mesh::Mesh;
use diaphane_runtime::edit::{Edit, parse_channels};
use diaphane_runtime::player::{Backend, LightMode};
use glam::{DVec3, Vec3};
use std::path::PathBuf;
use validation::metrics::compare;
use validation::play::play_edited;
use validation::reference::{Settings, render};
use validation::report::{Case, PICTURES, write_pictures, write_report};

/// What to play and what to compare it with.
#[derive(clap::Args)]
#[command(
    after_help = "Writes played.exr, played.png, reference.exr, reference.png, error.png, report.html and \
                        report.json.\n\nExample:\n  diaphane-validate image bunny.dph bunny.obj --material \
                        jade.material.toml \\\n      --scene studio.scene.toml --output-dir check --max-error 0.15\n  \
                        diaphane-validate image bunny.dph bunny.obj --material jade.material.toml \\\n      \
                        --scene studio.scene.toml --extinction-scale 2 --albedo 0.9,0.8,0.6"
)]
pub struct Arguments {
    /// Baked asset
    #[arg(value_name = "A.dph")]
    asset: PathBuf,
    #[command(flatten)]
    inputs: Inputs,
    /// Folder for pictures and report, made if missing
    #[arg(long, value_name = "DIR", default_value = "out")]
    output_dir: PathBuf,
    /// Largest relative RMSE that passes (0.15 is 15 %)
    #[arg(long, value_name = "E")]
    max_error: Option<f64>,
    /// What draws
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    backend: BackendName,
    /// Where the depth towards lights comes from
    #[arg(long, value_enum, default_value_t = LightName::Baked)]
    light: LightName,
    /// Play with the baked extinction times S, one factor or one for each channel; the reference renders the material
    /// file's extinction times S
    #[arg(long, value_name = "S|R,G,B", value_parser = parse_channels, allow_hyphen_values = true)]
    extinction_scale: Option<DVec3>,
    /// Single-scattering albedo (0..1) of player and reference instead of the asset's and the material file's
    #[arg(long, value_name = "A|R,G,B", value_parser = parse_channels, allow_hyphen_values = true)]
    albedo: Option<DVec3>,
    /// Relative noise of the reference at which to stop
    #[arg(long, default_value_t = 0.005)]
    tolerance: f64,
    /// Seed of the reference's noise
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Backends by name.
#[derive(Clone, Copy, ValueEnum)]
pub enum BackendName {
    /// The GPU where there is one, else the CPU
    Auto,
    /// The GPU or an error
    Gpu,
    /// The CPU
    Cpu,
}

impl From<BackendName> for Backend {
    fn from(name: BackendName) -> Self {
        match name {
            BackendName::Auto => Self::Auto,
            BackendName::Gpu => Self::Gpu,
            BackendName::Cpu => Self::Cpu,
        }
    }
}

/// Light modes by name.
#[derive(Clone, Copy, ValueEnum)]
pub enum LightName {
    /// Baked spherical harmonics
    Baked,
    /// Rays to every light
    Exact,
    /// Rays to lights inside the bounding box only
    Auto,
}

impl From<LightName> for LightMode {
    fn from(name: LightName) -> Self {
        match name {
            LightName::Baked => Self::Baked,
            LightName::Exact => Self::Exact,
            LightName::Auto => Self::Auto,
        }
    }
}

/// Plays, renders, compares, writes.
pub fn run(a: &Arguments) -> anyhow::Result<bool> {
    if let Some(e) = a.max_error {
        anyhow::ensure!(e >= 0.0, "--max-error must be a number that is not negative, not {e}");
    }
    anyhow::ensure!(
        a.tolerance > 0.0 && a.tolerance.is_finite(),
        "--tolerance must be above 0, not {}",
        a.tolerance
    );
    let edit = Edit { extinction_scale: a.extinction_scale.unwrap_or(DVec3::ONE), albedo: a.albedo };
    edit.validate()?;
    let asset = asset::read(&a.asset)?;
    let mut loaded = a.inputs.load()?;
    loaded.medium = edit.medium(loaded.medium)?;
    for name in PICTURES.into_iter().chain(["report.html", "report.json"]) {
        let output = a.output_dir.join(name);
        a.inputs.require_different(&output)?;
        files::require_different(&output, &a.asset)?;
    }
    check_folder(&a.output_dir)?;
    let mut played = play_edited(&asset, &edit, &loaded.scene, a.backend.into(), a.light.into(), 1)?;
    make_folder(&a.output_dir)?;
    played.warnings.extend(loaded.warnings);
    if !same_object(&asset, &loaded.mesh) {
        played.warnings.push(
            "the asset's bounding box is not that of the mesh; was it baked from another one?".to_owned(),
        );
    }
    warn(&played.warnings);
    let settings = Settings { tolerance: a.tolerance, seed: a.seed, ..Settings::default() };
    let display = Display::new("reference");
    let reference =
        render(&loaded.mesh, &loaded.medium, &loaded.scene, &settings, &|p| display.reference(p))?;
    display.finish();
    let coverage = reference.picture.coverage.clone().unwrap_or_default();
    let metrics = compare(&played.picture, &reference.picture, &coverage)?;
    let info = edit.apply(&asset.info)?;
    let facts = [
        ("mesh", info.provenance.mesh_name.clone()),
        ("material", info.provenance.material_name.clone()),
        ("samples", info.samples.to_string()),
        ("directions", info.provenance.directions.to_string()),
        ("harmonic bands", info.order.to_string()),
        ("extinction", channels(info.extinction)),
        ("albedo", channels(info.albedo)),
        ("lights", loaded.scene.lights.len().to_string()),
    ];
    let case = Case {
        title: a.asset.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        played,
        reference,
        metrics,
        facts: facts.map(|(n, v)| (n.to_owned(), v)).to_vec(),
    };
    write_pictures(&a.output_dir, &case)?;
    let heading = format!("{} against the reference", case.title);
    write_report(&a.output_dir, &heading, std::slice::from_ref(&case))?;
    print_metrics(&metrics);
    say(&format!("noise      {:.5}  (of the reference)", case.reference.error));
    say(&format!(
        "frame      {:.1} ms on {} ({})",
        case.played.frame_ms, case.played.backend, case.played.adapter
    ));
    say(&format!("report     {}", a.output_dir.join("report.html").display()));
    let good = a.max_error.is_none_or(|e| metrics.rel_rmse <= e);
    if let (false, Some(e)) = (good, a.max_error) {
        tell(&format!("check failed: rel_rmse {:.5} is above {e}", metrics.rel_rmse));
    }
    if metrics.non_finite > 0 {
        tell(&format!("check failed: {} values are not finite", metrics.non_finite));
    }
    Ok(good && metrics.non_finite == 0)
}

/// Three numbers for people.
fn channels(rgb: [f64; 3]) -> String {
    rgb.map(|v| format!("{v:.4}")).join(", ")
}

/// Whether the bounding boxes agree to a thousandth of the diagonal.
fn same_object(asset: &Asset, mesh: &Mesh) -> bool {
    let (low, high) = mesh.bounds();
    let centre = DVec3::from(asset.info.centre);
    let [a, b] = asset.info.bounds.map(|p| Vec3::from(p).as_dvec3() + centre);
    let near = 1e-3 * mesh.diagonal();
    a.distance(low) < near && b.distance(high) < near
}
