//! Other ways to draw the same light on the same adapter, to compare the player with. Nothing baked enters: they know the
//! asset's mesh and medium alone, and no surface reflection.
//!
//! ```text
//! march   camera ray -> steps of equal emission -> a shadow ray to every light at each
//! grid    nodes x lights, by shadow rays -> march that looks the light up, trilinearly
//! ```
//!
//! Shadow rays go through a box hierarchy (`gpu/hierarchy.rs`) and take every crossing: their depth is exact where the medium is
//! uniform, and a sum of lookups of the density grid, one every [`Settings::stride`] voxels, where it is not. At most the 16
//! nearest crossings of a camera ray count, and of a shadow ray through a density grid. Compared with shadow rays in f64 by
//! tests/tests/gpu_rivals.rs.

mod lattice;
mod parts;
mod stage;
mod uniforms;

use super::bindings::most_bound;
use super::device::{GpuDevice, instance};
use super::hierarchy::Hierarchy;
use crate::frame::Frame;
use crate::{Error, Result};
use diaphane_formats::asset::Asset;
use diaphane_formats::mesh::Mesh;
use diaphane_formats::picture::Picture;
use diaphane_formats::visibility::Accel;
use lattice::Lattice;
use stage::{Grid, Stage};

/// How finely a rival marches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Steps of a camera ray, at least 1.
    pub steps: u32,
    /// Voxels between two lookups of the density grid along any ray, above 0; without a grid it does nothing.
    pub stride: f32,
}

/// A picture of a rival.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Linear radiance of the ray through each pixel's centre; coverage 1 where that meets the object.
    pub picture: Picture,
    /// Milliseconds from the lights' upload until the picture is in memory.
    pub frame_ms: f64,
    /// Milliseconds by the adapter's clock; `None` without one.
    pub clock_ms: Option<f64>,
}

/// The rivals for one asset, on a device of their own.
pub struct Rivals {
    owned: GpuDevice,
    stage: Stage,
    mesh: Mesh,
    accel: Accel,
    grid: Option<Grid>,
}

impl Rivals {
    /// Finds the adapter that the player finds, and uploads mesh and medium.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] without a usable adapter; an asset that makes no sense or does not fit, whose boundary refracts
    /// or whose shells overlap: the rivals know neither.
    pub fn new(asset: &Asset) -> Result<Self> {
        asset.validate()?;
        let refuse = |what: &str| Err(Error::Rival(format!("the ray-marching rivals know no {what}")));
        if asset.info.ior != 1.0 {
            return refuse("refracting boundary (ior is not 1)");
        }
        if asset.info.provenance.mesh_report.mending.overlapping > 0 {
            return refuse("overlapping shells");
        }
        let owned = GpuDevice::open(&instance(), None)?;
        let mesh = asset.mesh()?;
        let hierarchy = Hierarchy::new(&asset.mesh_positions, &asset.mesh_triangles);
        if !hierarchy.fits(most_bound(&owned.device)) {
            return Err(Error::Rival("the mesh has too many triangles for the rivals".to_owned()));
        }
        let stage = Stage::new(&owned, asset, &hierarchy);
        owned.check()?;
        Ok(Self { stage, accel: Accel::new(&mesh), mesh, grid: None, owned })
    }

    /// The adapter's name, backend, and whether it is software.
    pub fn adapter(&self) -> String {
        self.owned.describe()
    }

    /// Whether the adapter is a program itself.
    pub fn is_software(&self) -> bool {
        self.owned.is_software()
    }

    /// Whether the medium has a density grid, so that [`Settings::stride`] matters.
    pub fn is_heterogeneous(&self) -> bool {
        self.stage.heterogeneous
    }

    /// Marches with shadow rays.
    ///
    /// # Errors
    /// The GPU failed.
    pub fn march(&self, frame: &Frame, settings: Settings) -> Result<Drawn> {
        self.stage.draw(&self.owned, frame, settings, None)
    }

    /// Lays a grid with `side` nodes (2..=256) along the longest edge of the bounding box; says how many of its nodes are
    /// lit in every frame.
    ///
    /// # Errors
    /// A grid that does not fit the adapter.
    pub fn set_grid(&mut self, side: u32) -> Result<usize> {
        let lattice = Lattice::new(&self.mesh, &self.accel, side.clamp(2, 256));
        if 16 * lattice.nodes() > most_bound(&self.owned.device) {
            return Err(Error::Rival(format!("a grid of {side} nodes a side does not fit the adapter")));
        }
        let lit = lattice.listed.len();
        self.grid = Some(Grid::new(&self.owned.device, lattice));
        Ok(lit)
    }

    /// Lights the grid's nodes, then marches with what is looked up there.
    ///
    /// # Errors
    /// No grid was laid; the GPU failed.
    pub fn grid(&self, frame: &Frame, settings: Settings) -> Result<Drawn> {
        let grid = self.grid.as_ref().ok_or_else(|| Error::Rival("no grid was laid".to_owned()))?;
        self.stage.draw(&self.owned, frame, settings, Some(grid))
    }
}
