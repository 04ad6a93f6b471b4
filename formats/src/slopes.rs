//! How sources vary between samples: log-linear slopes from neighbours.
//!
//! Light fades exponentially, so ln v is nearly linear over a kernel where v is not. For each channel
//! h_i = ∇ ln v at sample i is the weighted least-squares gradient over its nearest neighbours,
//!
//!   h_i = M⁻¹ Σ_j w_j d_j ln(v_j / v_i),   M = Σ_j w_j d_j d_jᵀ + ridge,   d_j = c_j - c_i,
//!
//! with c the centroids at which the values hold. The vectors M⁻¹ w_j d_j depend on the samples alone and are kept
//! ([`Stencil`]); a frame only sums. |h| is limited to six times the extinction: light at grazing angles fades faster
//! than e^{-κ depth}. A [`Source`] then stands for v(x) = value · e^{h·(x-b)} around its kernel's centre b, which is
//! always positive. Where samples are sparse |h| is limited to two per disk radius as well.
//!
//! What a sample stores is its mean over the inside part of a ball around b. The mean of an exponential is greater
//! than its value at the centroid, by about e^{h·C·h/2} with C the covariance of the points; for a ball of radius R cut by a
//! plane through its centre C = R²/5 - o oᵀ exactly, o = b - c. Both corrections are one exponent:
//!
//!   value = v̄ · exp(h·o - ½ s max(0, R²|h|²/5 - (h·o)²))
//!
//! with s = 1 for such means and 0 for values that were found at the centroid itself.
//!
//! A sample stores the mean of ψ at the reference extinction only; a channel with r = κ/κ̄ takes (mean ψ)^r for the
//! mean of ψ^r. With σ² the variance of ln ψ over the cell at κ̄ and c the centroid, to second order
//!
//!   ln mean(ψ^r) = r ln ψ(c) + ½ r²σ²,   r ln mean(ψ) = r ln ψ(c) + ½ rσ²
//!
//! so what exceeds r ln ψ(c) in v̄ is ½ rσ². The channel's own slope is r times that of κ̄ and R²|h|²/5 - (h·o)² is
//! r²σ²: s = 1/r ([`means_share`]). Below r = 1 the excess is small and the slopes of ψ drown in those of the phase
//! function and the distance to the light, which 1/r would amplify: s stays 1 there, which measured better.

use crate::asset::Samples;
use glam::{Mat3, Vec3};
use rayon::prelude::*;

/// Neighbours of a sample in the estimate of its slope.
pub const NEIGHBOURS: usize = 14;
/// Slopes are limited to this multiple of the largest extinction.
pub const LIMIT: f32 = 6.0;
/// Slopes are limited to this per disk radius: steeper ones come from noise between neighbours, which they would amplify
/// (600 samples with four bands in a ball: error 0.36 without this limit, 0.08 with it).
pub const STEEPEST: f32 = 2.0;
/// Radius of the ball that a sample's values are the mean of, in disk radii.
pub const CELL_RADIUS: f32 = 0.65;
/// |ln| of the ratio between neighbours is limited to this, so that darkness has a finite slope.
pub const MOST_RATIO: f32 = 6.0;
/// |exponent| of a source's variation over its kernel is limited to this.
pub const MOST_EXPONENT: f32 = 4.0;

/// s of means that are stored at the reference extinction, for channels with `ratio` = κ/κ̄; see the module's head.
pub fn means_share(ratio: Vec3) -> Vec3 {
    ratio.max(Vec3::ONE).recip()
}

/// What a sample scatters towards the camera, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Source {
    /// v at the kernel's centre.
    pub value: Vec3,
    /// ∇ ln v of each channel, 1 / mesh unit.
    pub slope: [Vec3; 3],
}

impl Source {
    /// The same value everywhere.
    pub fn flat(value: Vec3) -> Self {
        Self { value, slope: [Vec3::ZERO; 3] }
    }
}

/// One neighbour's part in a gradient: the vector that its ln(v_j / v_i) is multiplied with, and its index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spoke {
    /// M⁻¹ w_j d_j, 1 / mesh unit.
    pub gradient: Vec3,
    /// j.
    pub neighbour: u32,
}

/// Gradient stencils of all samples.
pub struct Stencil {
    /// [`NEIGHBOURS`] for each sample; unused ones name the sample itself and have no gradient.
    pub spokes: Vec<[Spoke; NEIGHBOURS]>,
    /// Where the values hold.
    pub centroid: Vec<Vec3>,
    /// Kernel centre minus centroid.
    pub to_centre: Vec<Vec3>,
    /// Variance R²/5 of a whole cell along any axis.
    pub variance: Vec<f32>,
    /// Largest slope of each sample, 1 / mesh unit.
    pub limit: Vec<f32>,
}

impl Stencil {
    /// Stencils of an asset's samples. `extinction` gives the largest channel's κt at a point.
    pub fn new(samples: &Samples, extinction: impl Fn(Vec3) -> f32 + Sync) -> Self {
        let n = samples.len();
        let centroid: Vec<Vec3> = (0..n).map(|i| samples.centroid(i)).collect();
        let grid = Buckets::new(&centroid);
        let spokes = (0..n)
            .into_par_iter()
            .map_init(Vec::new, |found, i| {
                grid.nearest(&centroid, i, found);
                spokes(&centroid, i, found)
            })
            .collect();
        Self {
            spokes,
            limit: limits(samples, &centroid, extinction),
            to_centre: (0..n).map(|i| samples.position(i) - centroid[i]).collect(),
            variance: samples.position_radius.iter().map(|p| (CELL_RADIUS * p[3]).powi(2) / 5.0).collect(),
            centroid,
        }
    }

    /// Limits the slopes for another extinction of the largest channel; `samples` are those of [`Self::new`].
    pub fn set_extinction(&mut self, samples: &Samples, extinction: impl Fn(Vec3) -> f32 + Sync) {
        self.limit = limits(samples, &self.centroid, extinction);
    }

    /// Sources from the values at the centroids; `means` is s of the module's head, per channel.
    pub fn sources(&self, values: &[Vec3], means: Vec3) -> Vec<Source> {
        (0..values.len()).into_par_iter().with_min_len(256).map(|i| self.source(values, means, i)).collect()
    }

    fn source(&self, values: &[Vec3], means: Vec3, i: usize) -> Source {
        let own = values[i];
        let mut source = Source::flat(own);
        for c in 0..3 {
            if own[c] <= 0.0 {
                continue;
            }
            let mut h = Vec3::ZERO;
            for spoke in &self.spokes[i] {
                let ratio = values[spoke.neighbour as usize][c] / own[c];
                let log = if ratio > 0.0 { ratio.ln().clamp(-MOST_RATIO, MOST_RATIO) } else { -MOST_RATIO };
                h += spoke.gradient * log;
            }
            let length = h.length();
            if length > self.limit[i] {
                h *= self.limit[i] / length;
            }
            source.slope[c] = h;
            let to_centre = h.dot(self.to_centre[i]);
            let spread = (self.variance[i] * h.length_squared() - to_centre * to_centre).max(0.0);
            source.value[c] *=
                (to_centre - 0.5 * means[c] * spread).clamp(-MOST_EXPONENT, MOST_EXPONENT).exp();
        }
        source
    }
}

fn limits(samples: &Samples, centroid: &[Vec3], extinction: impl Fn(Vec3) -> f32 + Sync) -> Vec<f32> {
    let steepest = |i: usize| STEEPEST / samples.position_radius[i][3];
    let limit = |i: usize| (LIMIT * extinction(centroid[i])).min(steepest(i)).min(1e30);
    (0..centroid.len()).into_par_iter().map(limit).collect()
}

fn spokes(centroid: &[Vec3], i: usize, found: &[(f32, u32)]) -> [Spoke; NEIGHBOURS] {
    let mut out = [Spoke { gradient: Vec3::ZERO, neighbour: i as u32 }; NEIGHBOURS];
    let Some((reach, _)) = found.last().filter(|(d2, _)| *d2 > 0.0) else { return out };
    // In units of the reach, so that the matrix is well scaled whatever the mesh's size.
    let scale = 1.0 / reach.sqrt();
    let offset = |j: u32| (centroid[j as usize] - centroid[i]) * scale;
    let weight = |d: Vec3| (-2.0 * d.length_squared()).exp();
    let mut m = Mat3::ZERO;
    for (_, j) in found {
        let d = offset(*j);
        m += Mat3::from_cols(d * d.x, d * d.y, d * d.z) * weight(d);
    }
    let trace = m.x_axis.x + m.y_axis.y + m.z_axis.z;
    m += Mat3::from_diagonal(Vec3::splat(1e-3 * trace + 1e-12));
    let inverse = m.inverse();
    for (spoke, (_, j)) in out.iter_mut().zip(found) {
        let d = offset(*j);
        let gradient = inverse * d * (weight(d) * scale);
        if gradient.is_finite() {
            *spoke = Spoke { gradient, neighbour: *j };
        }
    }
    out
}

/// Points in the cells of a grid, about two in each.
struct Buckets {
    low: Vec3,
    inverse: f32,
    size: [i32; 3],
    start: Vec<u32>,
    order: Vec<u32>,
}

impl Buckets {
    fn new(points: &[Vec3]) -> Self {
        let first = points.first().copied().unwrap_or_default();
        let (low, high) = points.iter().fold((first, first), |(a, b), p| (a.min(*p), b.max(*p)));
        let extent = (high - low).max(Vec3::splat((high - low).max_element() * 1e-3)).max(Vec3::splat(1e-30));
        let cells = (points.len() as f64 / 2.0).max(1.0);
        // In f64: the volume around a single point is below the smallest f32.
        let volume = extent.as_dvec3().element_product();
        let cell = ((volume / cells).cbrt() as f32).max(extent.max_element() / 500.0);
        let inverse = 1.0 / cell;
        let size = (extent * inverse).to_array().map(|e| e as i32 + 1);
        let mut buckets = Self { low, inverse, size, start: Vec::new(), order: vec![0; points.len()] };
        let index: Vec<usize> = points.iter().map(|p| buckets.index(buckets.cell(*p))).collect();
        let mut start = vec![0u32; size.iter().map(|n| *n as usize).product::<usize>() + 1];
        for i in &index {
            start[i + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        for (p, i) in index.into_iter().enumerate() {
            buckets.order[next[i] as usize] = p as u32;
            next[i] += 1;
        }
        buckets.start = start;
        buckets
    }

    fn cell(&self, p: Vec3) -> [i32; 3] {
        let s = (p - self.low) * self.inverse;
        [0, 1, 2].map(|k| (s[k] as i32).clamp(0, self.size[k] - 1))
    }

    fn index(&self, c: [i32; 3]) -> usize {
        ((c[2] * self.size[1] + c[1]) * self.size[0] + c[0]) as usize
    }

    /// The nearest other points, nearest first, ties by index: in growing boxes of cells until the box is sure to
    /// hold them.
    fn nearest(&self, points: &[Vec3], i: usize, found: &mut Vec<(f32, u32)>) {
        let home = self.cell(points[i]);
        let widest = self.size.iter().copied().max().unwrap_or(1);
        let mut reach = 1;
        loop {
            found.clear();
            let range = |k: usize| (home[k] - reach).max(0)..=(home[k] + reach).min(self.size[k] - 1);
            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        let cell = self.index([x, y, z]);
                        for &j in &self.order[self.start[cell] as usize..self.start[cell + 1] as usize] {
                            if j as usize != i {
                                found.push((points[j as usize].distance_squared(points[i]), j));
                            }
                        }
                    }
                }
            }
            found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            found.truncate(NEIGHBOURS);
            let sure = reach as f32 / self.inverse;
            let enough = found.len() == NEIGHBOURS && found[NEIGHBOURS - 1].0 <= sure * sure;
            if enough || reach >= widest {
                return;
            }
            reach = (2 * reach).min(widest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(count: usize) -> Samples {
        let unit = |i: usize, k: u64| crate::directions::hash(i as u64, k) as f32 / 2f32.powi(64);
        Samples {
            position_radius: (0..count).map(|i| [unit(i, 1), unit(i, 2), unit(i, 3), 0.1]).collect(),
            offset: vec![[0; 4]; count],
            ..Samples::default()
        }
    }

    #[test]
    fn exponentials_are_exact() {
        let samples = samples(800);
        let stencil = Stencil::new(&samples, |_| 10.0);
        let slope = [Vec3::new(2.0, -1.0, 0.5), Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO];
        let values: Vec<Vec3> =
            (0..samples.len()).map(|i| Vec3::from(slope.map(|s| s.dot(samples.position(i)).exp()))).collect();
        for source in stencil.sources(&values, Vec3::ZERO) {
            for (got, exact) in source.slope.iter().zip(slope) {
                // The ridge shortens slopes by a few parts in a thousand.
                assert!((*got - exact).length() < 0.03 * exact.length() + 1e-4, "{source:?}");
            }
        }
    }

    #[test]
    fn any_number_of_samples() {
        for count in [0, 1, 2, 5, 30] {
            let stencil = Stencil::new(&samples(count), |_| 1.0);
            let sources = stencil.sources(&vec![Vec3::new(1.0, 0.0, -1.0); count], Vec3::ONE);
            assert_eq!(sources.len(), count);
            assert!(Buckets::new(&stencil.centroid).start.len() <= 500 + 8 * count);
            assert!(sources.iter().all(|s| s.value.is_finite() && s.slope.iter().all(|h| h.is_finite())));
        }
    }

    #[test]
    fn coincident_samples_have_no_slope() {
        let mut samples = samples(20);
        samples.position_radius.fill([0.5, 0.5, 0.5, 0.1]);
        let stencil = Stencil::new(&samples, |_| 1.0);
        let values: Vec<Vec3> = (0..20).map(|i| Vec3::splat(i as f32)).collect();
        assert!(stencil.sources(&values, Vec3::ZERO).iter().flat_map(|s| s.slope).all(|h| h == Vec3::ZERO));
    }
}
