//! The files that the window shows: asset and scene, read again when they change.

use super::app::View;
use super::levels::Levels;
use super::reload::{Look, Watch};
use super::session::Session;
use anyhow::Result;
use diaphane_formats::asset::Asset;
use diaphane_formats::{asset, one_line, scene};
use std::path::Path;

/// Asset and scene.
pub struct Sources {
    asset: Watch,
    scene: Option<Watch>,
}

impl Sources {
    /// Begins before the files are read for the first time.
    pub fn new(asset: &Path, scene: Option<&Path>) -> Self {
        Self { asset: Watch::new(asset), scene: scene.map(Watch::new) }
    }

    /// Takes over what has changed. Returns what to tell: what was read again, or what could not be and why; the session then stays
    /// as it was.
    pub fn look(
        &mut self,
        session: &mut Session,
        view: Option<&mut View>,
        budget: Option<f64>,
    ) -> Option<String> {
        let mut told = Vec::new();
        let found = self.asset.look(asset::read);
        told.extend(tell(self.asset.path(), found, |asset| show(session, view, asset, budget)));
        if let Some(scene) = &mut self.scene {
            let found = scene.look(scene::load);
            told.extend(tell(scene.path(), found, |scene| session.replace_scene(scene)));
        }
        (!told.is_empty()).then(|| told.join("; "))
    }
}

/// Takes over what a look has found; says what came of it.
fn tell<T>(
    path: &Path,
    found: Look<T, diaphane_formats::Error>,
    take: impl FnOnce(T) -> Result<()>,
) -> Option<String> {
    let done = match found {
        Look::Same => return None,
        Look::New(contents) => take(contents),
        Look::Unreadable(e) => Err(e.into()),
    };
    let name = path.display();
    Some(match done {
        Ok(()) => format!("read '{name}' again"),
        Err(e) => format!(
            "'{name}' has changed but cannot be shown, what was read before stays: {}",
            one_line(&format!("{e:#}"))
        ),
    })
}

/// Shows another asset, on the GPU and in the session or in neither.
fn show(session: &mut Session, view: Option<&mut View>, asset: Asset, budget: Option<f64>) -> Result<()> {
    let Some(view) = view else { return session.replace_asset(asset) };
    view.screen.set_asset(&asset)?;
    view.shown = None;
    if let Err(e) = session.replace_asset(asset) {
        view.screen.set_asset(&session.asset)?;
        return Err(e);
    }
    view.levels = Levels::new(&session.asset, budget, view.screen.gpu.is_software());
    Ok(())
}
