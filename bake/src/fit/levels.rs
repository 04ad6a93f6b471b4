//! Directions that fits look at: all of them, or a part on the way there.

use super::depths::ONE;
use super::least_squares::Basis;
use glam::{DVec3, Vec3};
use ndarray::Array2;

/// Every so manieth pair is in a part. Three and two golden angles, by which [`even_directions`] turn, are good angles too.
///
/// [`even_directions`]: diaphane_formats::directions::even_directions
const PARTS: [usize; 2] = [3, 2];
/// Directions of a part for each unknown, at least: where unknowns are fitted, and where they are known and rounded.
const FITTED: f32 = 3.0;
const ROUNDED: f32 = 2.5;

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

/// All directions and parts of them.
pub(super) struct Levels {
    /// Smallest first.
    parts: [Level; 2],
    pub all: Level,
}

impl Levels {
    /// For fits of at most `order` bands in `directions`: opposite pairs, all first ones before all second ones.
    pub fn new(directions: &[DVec3], order: usize) -> Self {
        Self {
            parts: PARTS.map(|step| Level::new(directions, order, step)),
            all: Level::new(directions, order, 1),
        }
    }

    /// All levels, the smallest first and all directions last.
    pub fn each(&self) -> [&Level; PARTS.len() + 1] {
        let [a, b] = &self.parts;
        [a, b, &self.all]
    }

    /// Index of the smallest level that is enough to round so many coefficients.
    pub fn for_rounding(&self, unknowns: usize) -> usize {
        self.smallest(ROUNDED * unknowns as f32)
    }

    /// The smallest part of the directions that is enough to fit so many unknowns, if one is.
    pub fn part(&self, unknowns: usize) -> Option<&Level> {
        self.parts.get(self.smallest(FITTED * unknowns as f32))
    }

    /// Index of the smallest level of so many directions, or of all directions.
    fn smallest(&self, directions: f32) -> usize {
        let enough = |part: &Level| part.columns.len() as f32 >= directions;
        self.parts.iter().position(enough).unwrap_or(self.parts.len())
    }
}
