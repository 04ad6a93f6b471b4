//! References that were rendered before, in a folder: a picture and a small JSON file each, named by a hash of
//! everything that the picture depends on. A damaged entry is said to be so and rendered again.

use crate::reference::{self, Progress, Reference, Settings};
use diaphane_formats::medium::Medium;
use diaphane_formats::mesh::Mesh;
use diaphane_formats::scene::Scene;
use diaphane_formats::{Error, Result, files, picture};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Where a reference came from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Read back.
    Cached,
    /// Rendered: there was none.
    Rendered,
    /// Rendered: the stored one was damaged, for this reason.
    Damaged(String),
}

/// What stands beside a picture.
#[derive(Serialize, Deserialize)]
struct Facts {
    error: f64,
    converged: bool,
    rays: u64,
    /// BLAKE3 of the picture's file.
    picture: String,
}

/// What a reference is rendered from.
pub struct Subject<'a> {
    /// Boundary.
    pub mesh: &'a Mesh,
    /// Inside. Meshes within its density field are told apart by their size alone.
    pub medium: &'a Medium,
    /// Camera and lights.
    pub scene: &'a Scene,
    /// Quality.
    pub settings: &'a Settings,
}

/// Text straight into a hash.
struct Hashing(blake3::Hasher);

impl Write for Hashing {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

impl Subject<'_> {
    /// Name of the entry: 32 hexadecimal digits. Numbers enter by their shortest exact decimal form.
    pub fn key(&self) -> String {
        let mut hash = Hashing(blake3::Hasher::new());
        // Writing to a hash cannot fail.
        let _ = write!(
            hash,
            "{} {:?} {:?} {:?} {:?}",
            reference::VERSION,
            self.mesh,
            self.medium,
            self.scene,
            self.settings
        );
        hash.0.finalize().to_hex()[..32].to_owned()
    }

    /// The reference from `folder`, or rendered and stored there.
    ///
    /// # Errors
    /// A scene that makes no picture, a folder that takes no files.
    pub fn reference(
        &self,
        folder: &Path,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<(Reference, Origin)> {
        let paths = ["exr", "json"].map(|end| folder.join(format!("{}.{end}", self.key())));
        let origin = if paths.iter().any(|p| p.exists()) {
            match read(&paths, self.scene) {
                Ok(reference) => return Ok((reference, Origin::Cached)),
                Err(e) => Origin::Damaged(e.to_string()),
            }
        } else {
            Origin::Rendered
        };
        let reference = reference::render(self.mesh, self.medium, self.scene, self.settings, progress)?;
        write(&paths, &reference)?;
        Ok((reference, origin))
    }
}

fn read([exr, json]: &[PathBuf; 2], scene: &Scene) -> Result<Reference> {
    let facts: Facts = serde_json::from_str(&files::read_text(json)?)
        .map_err(|e| Error::file(json, format!("is damaged: {e}")))?;
    let bytes = files::read(exr, files::Kind::Kept)?;
    if blake3::hash(&bytes).to_hex().as_str() != facts.picture {
        return Err(Error::file(exr, "is damaged: its checksum is another one"));
    }
    let picture = picture::parse_exr(&bytes).map_err(|e| e.in_file(exr))?;
    if (picture.width, picture.height) != (scene.image.width as usize, scene.image.height as usize) {
        return Err(Error::file(exr, "has another size"));
    }
    Ok(Reference { picture, error: facts.error, converged: facts.converged, rays: facts.rays })
}

/// The picture first: an entry without its JSON file is not taken for whole.
fn write([exr, json]: &[PathBuf; 2], reference: &Reference) -> Result<()> {
    picture::write_exr(exr, &reference.picture)?;
    let facts = Facts {
        error: reference.error,
        converged: reference.converged,
        rays: reference.rays,
        picture: blake3::hash(&files::read(exr, files::Kind::Exr)?).to_hex().to_string(),
    };
    let text = serde_json::to_string(&facts)
        .map_err(|e| Error::file(json, format!("cannot hold the reference's facts: {e}")))?;
    files::write_atomically(json, text.as_bytes())
}
