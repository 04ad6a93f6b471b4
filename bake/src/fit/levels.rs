//! Directions that fits look at: all of them, or a part on the way there.

use super::depths::ONE;
use super::least_squares::Basis;
use glam::{DVec3, Vec3};
use ndarray::Array2;

/// Every so manieth pair is in the part: 3 goes well with the golden angle of [`even_directions`], three turns of which are
/// a good angle too.
///
/// [`even_directions`]: diaphane_formats::directions::even_directions
const PART: usize = 3;
/// Directions of the part for each unknown, at least.
const EACH: usize = 3;

/// Some of the directions, with the harmonics in them.
pub(super) struct Level {
    /// Numbers of the directions: first ones of pairs, then their opposites.
    pub columns: Vec<usize>,
    /// Unit vectors.
    pub directions: Vec<Vec3>,
    pub basis: Basis,
}

impl Level {
    /// Every `step`th of the pairs `directions`, all first ones before all second ones.
    fn new(directions: &[DVec3], order: usize, step: usize) -> Self {
        let half = directions.len() / 2;
        let columns: Vec<usize> = (0..half).step_by(step).chain((half..2 * half).step_by(step)).collect();
        let own: Vec<DVec3> = columns.iter().map(|d| directions[*d]).collect();
        let basis = Basis::new(&own, order);
        Self { columns, directions: own.iter().map(|d| d.as_vec3()).collect(), basis }
    }

    /// These columns of rows over all directions, in the unit 1/[`ONE`].
    pub fn gathered<'a>(&self, rows: impl ExactSizeIterator<Item = &'a [u16]>) -> Array2<f32> {
        let mut out = Array2::zeros((rows.len(), self.columns.len()));
        for (mut out, row) in out.rows_mut().into_iter().zip(rows) {
            out.iter_mut().zip(&self.columns).for_each(|(out, d)| *out = f32::from(row[*d]) * (1.0 / ONE));
        }
        out
    }

    /// Cosines of the directions to each axis, 0 where they are negative.
    pub fn cosines(&self, axes: impl ExactSizeIterator<Item = Vec3>) -> Array2<f32> {
        let mut out = Array2::zeros((axes.len(), self.columns.len()));
        for (mut out, axis) in out.rows_mut().into_iter().zip(axes) {
            out.iter_mut().zip(&self.directions).for_each(|(out, d)| *out = axis.dot(*d).max(0.0));
        }
        out
    }
}

/// Both levels.
pub(super) struct Levels {
    part: Level,
    pub all: Level,
}

impl Levels {
    /// For fits of at most `order` bands in `directions`: opposite pairs, all first ones before all second ones.
    pub fn new(directions: &[DVec3], order: usize) -> Self {
        Self { part: Level::new(directions, order, PART), all: Level::new(directions, order, 1) }
    }

    /// A part of the directions, if it is enough for so many unknowns.
    pub fn part(&self, unknowns: usize) -> Option<&Level> {
        Some(&self.part).filter(|part| part.columns.len() >= EACH * unknowns)
    }
}
