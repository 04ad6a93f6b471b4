//! One module for each command; each returns whether its checks passed, or the error that ends the program with 2.

pub mod bake_scaling;
pub mod bake_speed;
pub mod compare;
pub mod demo;
pub mod image;
pub mod output;
pub mod progress;
pub mod range;
pub mod reference;
pub mod stress;
pub mod sweep;

use anyhow::Context;
use diaphane_formats::one_line;
use diaphane_formats::{files, material, medium::Medium, mesh, mesh::Mesh, scene, scene::Scene};
use std::path::{Path, PathBuf};

/// What the reference is rendered from.
#[derive(clap::Args)]
pub struct Inputs {
    /// Closed triangle mesh (OBJ)
    #[arg(value_name = "MESH.obj")]
    pub mesh: PathBuf,
    /// Material file (TOML)
    #[arg(long, value_name = "M.toml")]
    pub material: PathBuf,
    /// Scene file (TOML)
    #[arg(long, value_name = "S.toml")]
    pub scene: PathBuf,
}

/// The loaded inputs.
pub struct Loaded {
    /// The mesh.
    pub mesh: Mesh,
    /// The medium inside.
    pub medium: Medium,
    /// Camera and lights.
    pub scene: Scene,
    /// Sentences that a user should read.
    pub warnings: Vec<String>,
}

impl Inputs {
    /// Reads everything, cheap things first.
    pub fn load(&self) -> anyhow::Result<Loaded> {
        let scene = scene::load(&self.scene)?;
        let medium = material::load(&self.material)?;
        let (mesh, report) = mesh::load_obj(&self.mesh)?;
        let mut warnings = report.warnings();
        if scene.lights.is_empty() && scene.environment.is_none() {
            warnings.push("the scene has no lights; the picture will be black".to_owned());
        }
        Ok(Loaded { mesh, medium, scene, warnings })
    }

    /// Fails when `output` is one of the inputs.
    pub fn require_different(&self, output: &Path) -> anyhow::Result<()> {
        for input in [&self.mesh, &self.material, &self.scene] {
            files::require_different(output, input)?;
        }
        Ok(())
    }
}

/// Makes a folder for output unless it exists.
pub fn make_folder(path: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(path).with_context(|| format!("cannot make the folder '{}'", path.display()))
}

/// Fails early when [`make_folder`] would: something else is in the way, or the place takes no files.
pub fn check_folder(path: &Path) -> anyhow::Result<()> {
    // The empty path that ends a relative one stands for the current folder.
    let real = |p: &Path| {
        if p.as_os_str().is_empty() { PathBuf::from(".") } else { p.to_path_buf() }
    };
    let found = path.ancestors().map(real).find(|p| p.exists()).unwrap_or_else(|| PathBuf::from("."));
    anyhow::ensure!(
        found.is_dir(),
        "'{}' cannot be a folder: '{}' is a file",
        path.display(),
        found.display()
    );
    Ok(files::require_writable(&found.join("report.html"))?)
}

/// The first paragraph of clap's message and where to read more.
pub fn usage_error(e: &clap::Error) -> String {
    format!("{} (see --help)", one_line(&e.to_string()))
}
