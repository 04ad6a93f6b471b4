//! Factors on the samples' radii over a coarse grid.
//!
//! If a region's squared error falls as the fourth power of its samples' radius (interpolation that is exact for what
//! varies linearly) and the number of samples as the third, the sum of errors at a given number is least where every sample
//! bears the same error: from r⁴ c at density r^-3 it follows that r ∝ (error of a sample)^(-1/7) step by step.

use super::trial::{Measured, Trial};
use crate::field::Shape;
use crate::samples::Placed;
use glam::DVec3;

/// Cells along the longest edge of the box.
const CELLS: f64 = 24.0;
/// The power of the module's head.
const POWER: f64 = 1.0 / 7.0;
/// Factors of one step lie within this range around 1.
const MOST: f64 = 1.3;

/// A factor for each cell.
pub(super) struct Map {
    low: DVec3,
    inverse: f64,
    size: [usize; 3],
    factor: Vec<f64>,
}

impl Map {
    /// 1 everywhere.
    pub fn even(shape: &Shape<'_>) -> Self {
        let (low, high) = shape.mesh.bounds();
        let inverse = CELLS / (high - low).max_element();
        let size = ((high - low) * inverse).to_array().map(|n| n as usize + 1);
        Self { low, inverse, size, factor: vec![1.0; size.iter().product()] }
    }

    /// The factor at a point.
    pub fn factor(&self, p: DVec3) -> f64 {
        self.factor[self.cell(p)]
    }

    fn cell(&self, p: DVec3) -> usize {
        let s = (p - self.low) * self.inverse;
        let [x, y, z] = [0, 1, 2].map(|k| (s[k].max(0.0) as usize).min(self.size[k] - 1));
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// This map times what the errors of `measured`, which `placed` has, ask for.
    pub fn after(&self, trial: &Trial, measured: &Measured, placed: &Placed) -> Self {
        let mut error = vec![0.0; self.factor.len()];
        let mut count = vec![0.0; self.factor.len()];
        let total = trial.nodes.emission();
        for (position, ray, weight) in trial.nodes.emitters() {
            if total[ray] > 0.0 {
                error[self.cell(position)] += measured.rays[ray] * weight / total[ray];
            }
        }
        for s in &placed.samples {
            count[self.cell(s.position)] += 1.0;
        }
        let (error, count) = (self.blurred(&error), self.blurred(&count));
        let mean = error.iter().sum::<f64>() / count.iter().sum::<f64>().max(1.0);
        let step = |c: usize| {
            let own = error[c].max(0.0) / count[c];
            // Cells without samples, or without rays, follow nobody.
            if count[c] > 0.0 && own > 0.0 && mean > 0.0 {
                (mean / own).powf(POWER).clamp(1.0 / MOST, MOST)
            } else {
                1.0
            }
        };
        let factor = self.factor.iter().enumerate().map(|(c, f)| f * step(c)).collect();
        Self { factor, ..*self }
    }

    /// Sums over each cell and its neighbours along every axis, nearer ones counting double.
    fn blurred(&self, values: &[f64]) -> Vec<f64> {
        let mut out = values.to_vec();
        let strides = [1, self.size[0], self.size[0] * self.size[1]];
        for (axis, stride) in strides.into_iter().enumerate() {
            let before = out.clone();
            for (c, out) in out.iter_mut().enumerate() {
                let at = c / stride % self.size[axis];
                let low = if at > 0 { before[c - stride] } else { 0.0 };
                let high = if at + 1 < self.size[axis] { before[c + stride] } else { 0.0 };
                *out = low + 2.0 * before[c] + high;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blurring_keeps_the_middle_and_the_sum() {
        let size = [5, 4, 3];
        let map = Map { low: DVec3::ZERO, inverse: 1.0, size, factor: vec![1.0; 60] };
        let mut values = vec![0.0; 60];
        let middle = map.cell(DVec3::new(2.5, 1.5, 1.5));
        values[middle] = 1.0;
        let out = map.blurred(&values);
        // Weights 1, 2, 1 along each of three axes.
        assert_eq!(out.iter().sum::<f64>(), 64.0);
        assert_eq!(out[middle], 8.0);
        assert_eq!(out[map.cell(DVec3::new(3.5, 1.5, 1.5))], 4.0);
        assert_eq!(map.cell(DVec3::splat(-9.0)), 0);
        assert_eq!(map.cell(DVec3::splat(99.0)), 59);
    }
}
