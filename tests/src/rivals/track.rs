//! The medium along a camera ray as a coordinate for steps: where an equal share of what the eye sees lies.
//!
//! Between neighbouring knots the medium is uniform. With m the density length from the camera and σ the scattering
//! part of the density, a channel of extinction κ sees of the stretch up to m
//!
//!   A(m) = ∫ e^{-κ m'} κ (σ/ρ) dm'
//!
//! in closed form, so a source that is the same everywhere comes out exactly however few the steps are. Steps end where
//! A of the reference extinction reaches equal parts of its whole.

use super::object::Object;
use super::rays::CameraRay;
use diaphane_formats::reconstruct::{Along, PROFILE_CELLS};
use glam::Vec3;

/// A uniform bit of the ray.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Ray parameters of its ends.
    ends: [f32; 2],
    /// Optical depth per unit extinction before it, and its own.
    before: f32,
    length: f32,
    /// Scattering part of its density, times the boundary's factor in front of it.
    emits: f32,
    /// Grey emission before it.
    grey: f32,
}

/// A ray's cells and their grey emission.
#[derive(Default)]
pub struct Track {
    cells: Vec<Cell>,
    total: f32,
}

/// A place on a track.
#[derive(Clone, Copy, Debug)]
pub struct Mark {
    cell: usize,
    /// Density length from the beginning of the cell.
    into: f32,
    /// Ray parameter.
    pub t: f32,
}

impl Track {
    /// Follows a ray through `object`; `grey` is the extinction that spaces the steps.
    pub fn follow(&mut self, object: &Object<'_>, ray: &CameraRay<'_>, grey: f32) {
        self.cells.clear();
        self.total = 0.0;
        let medium = object.ray_medium();
        let uniform = object.medium.uniform_density() as f32;
        let mut before = 0.0;
        for piece in ray.pieces.iter().filter(|p| p.end > p.start) {
            let length = piece.end - piece.start;
            match medium.along(ray.origin, ray.direction, piece.start, piece.end) {
                Along::Uniform(_) => {
                    let ends = [piece.start, piece.end];
                    before = self.push(ends, before, [uniform * length; 2], piece.boundary, grey);
                }
                Along::Profile(_, profile) => {
                    let at = |k: usize| piece.start + length * k as f32 / PROFILE_CELLS as f32;
                    for k in 0..PROFILE_CELLS {
                        let part = |v: &[f32]| v[k + 1] - v[k];
                        let lengths = [part(&profile.density), part(&profile.scattering)];
                        before = self.push([at(k), at(k + 1)], before, lengths, piece.boundary, grey);
                    }
                }
            }
        }
    }

    fn push(
        &mut self,
        ends: [f32; 2],
        before: f32,
        [length, scattering]: [f32; 2],
        boundary: f32,
        grey: f32,
    ) -> f32 {
        if length > 0.0 {
            let cell = Cell { ends, before, length, emits: boundary * scattering / length, grey: self.total };
            self.cells.push(cell);
            self.total += cell.emission(grey, length);
        }
        before + length
    }

    /// Whether the ray scatters any light.
    pub fn is_dark(&self) -> bool {
        !(self.total > 0.0)
    }

    /// Where the grey emission has reached the share `u` (0..1) of the whole, at or after `from`.
    pub fn mark(&self, u: f32, grey: f32, from: usize) -> Mark {
        let wanted = u * self.total;
        let mut cell = from;
        while cell + 1 < self.cells.len() && self.cells[cell + 1].grey <= wanted {
            cell += 1;
        }
        let c = &self.cells[cell];
        let here = wanted - c.grey;
        // Inverse of Cell::emission.
        let seen = c.emits * (-grey * c.before).exp();
        let into = if grey * c.length < 1e-4 {
            here / (seen * grey).max(f32::MIN_POSITIVE)
        } else {
            -(1.0 - here / seen.max(f32::MIN_POSITIVE)).max(1e-30).ln() / grey
        };
        let into = into.clamp(0.0, c.length);
        Mark { cell, into, t: c.ends[0] + (c.ends[1] - c.ends[0]) * (into / c.length) }
    }

    /// The last place.
    pub fn end(&self) -> Mark {
        let cell = self.cells.len().saturating_sub(1);
        let (into, t) = self.cells.get(cell).map_or((0.0, 0.0), |c| (c.length, c.ends[1]));
        Mark { cell, into, t }
    }

    /// Emission between two marks, per channel of extinction `kappa`.
    pub fn emission(&self, from: Mark, to: Mark, kappa: Vec3) -> Vec3 {
        let up_to =
            |cell: usize, m: f32| Vec3::from(kappa.to_array().map(|k| self.cells[cell].emission(k, m)));
        let mut sum = -up_to(from.cell, from.into);
        for cell in from.cell..to.cell {
            sum += up_to(cell, self.cells[cell].length);
        }
        (sum + up_to(to.cell, to.into)).max(Vec3::ZERO)
    }

    /// The cell of a mark, from which the next one may be sought.
    pub fn cell(mark: Mark) -> usize {
        mark.cell
    }
}

impl Cell {
    /// A of the first `m` of the cell.
    fn emission(&self, kappa: f32, m: f32) -> f32 {
        self.emits * (-kappa * self.before).exp() * -(-kappa * m).exp_m1()
    }
}
