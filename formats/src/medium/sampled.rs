//! A density field sampled on voxels, and its running integral along a direction.
//!
//! Fields without a closed-form integral would be marched again for every ray. Instead, for each direction ω, one
//! sweep over the voxels gives P(x) = ∫ρ along ω up to x everywhere: slices across the axis that ω follows most, each
//! sheared so that rays along ω run straight through, are added up one after the other. A depth is then a difference
//! of two look-ups. Cost O(voxels) a direction; error of the order of one voxel times the density's step.

use super::Medium;
use glam::DVec3;
use rayon::prelude::*;

/// ρ and its scattering part, averaged over cubic voxels.
pub struct SampledDensity {
    size: [usize; 3],
    min: DVec3,
    voxel: f64,
    /// [ρ, scattering part] in [z][y][x] order.
    values: Vec<[f32; 2]>,
}

impl SampledDensity {
    /// Samples a field over a box with `side` voxels along the longest edge, averaging over as many points in each
    /// voxel as the field's finest feature asks for.
    pub fn new(medium: &Medium, low: DVec3, high: DVec3, side: usize) -> Self {
        let voxel = (high - low).max_element() / side as f64;
        let size = ((high - low) / voxel).ceil().max(DVec3::ONE).to_array().map(|n| n as usize);
        let smooth = matches!(medium.density_field(), super::Density::Noise(_));
        let wanted = if smooth { (voxel / medium.density_field().feature()).ceil() } else { 3.0 };
        let points = wanted.clamp(1.0, 3.0) as usize;
        let [nx, ny, nz] = size;
        let values = (0..nx * ny * nz)
            .into_par_iter()
            .map(|v| {
                let corner = DVec3::new((v % nx) as f64, (v / nx % ny) as f64, (v / (nx * ny)) as f64);
                let mut sum = (0.0, 0.0);
                for s in 0..points.pow(3) {
                    let part = [s % points, s / points % points, s / (points * points)];
                    let offset = DVec3::from(part.map(|p| (p as f64 + 0.5) / points as f64));
                    let (rho, scattering) = medium.density_and_scattering(low + (corner + offset) * voxel);
                    sum = (sum.0 + rho, sum.1 + scattering);
                }
                let count = points.pow(3) as f64;
                [(sum.0 / count) as f32, (sum.1 / count) as f32]
            })
            .collect();
        Self { size, min: low, voxel, values }
    }

    /// Voxels along x, y, z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Corners of the sampled box.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let size = DVec3::from(self.size.map(|n| n as f64));
        (self.min, self.min + size * self.voxel)
    }

    /// [ρ, scattering part of ρ] in [z][y][x] order.
    pub fn values(&self) -> &[[f32; 2]] {
        &self.values
    }

    /// P for one direction (unit vector).
    pub fn running(&self, direction: DVec3) -> RunningIntegral {
        let along =
            (0..3).fold(0, |best, k| if direction[k].abs() > direction[best].abs() { k } else { best });
        let (b, c) = ((along + 1) % 3, (along + 2) % 3);
        let slope = [direction[b] / direction[along], direction[c] / direction[along]];
        let n = self.size[along];
        // Sheared coordinates in voxels: q = x_b - slope · x_along, both counted from the box's corner.
        let lowest = slope.map(|s| (-s * n as f64).min(0.0).floor());
        let highest = [0, 1].map(|k| self.size[[b, c][k]] as f64 + (-slope[k] * n as f64).max(0.0).ceil());
        let across = [0, 1].map(|k| (highest[k] - lowest[k]) as usize + 1);
        let plane = across[0] * across[1];
        let mut sums = vec![0.0f32; plane * (n + 1)];
        let step = (self.voxel / direction[along].abs()) as f32;
        let stride = [1, self.size[0], self.size[0] * self.size[1]];
        for k in 0..n {
            let (before, after) = sums.split_at_mut(plane * (k + 1));
            let before = &before[plane * k..];
            // Where the sheared column at q passes the middle of this slice, relative to the voxel centres.
            let shift = [0, 1].map(|s| lowest[s] + slope[s] * (k as f64 + 0.5) - 0.5);
            let base = k * stride[along];
            for v in 0..across[1] {
                let (v0, v1, fv) = neighbours(v as f64 + shift[1], self.size[c]);
                let (row0, row1) = (base + v0 * stride[c], base + v1 * stride[c]);
                for u in 0..across[0] {
                    let (u0, u1, fu) = neighbours(u as f64 + shift[0], self.size[b]);
                    let at = |row: usize, u: usize| self.values[row + u * stride[b]][0];
                    let first = at(row0, u0) + (at(row0, u1) - at(row0, u0)) * fu;
                    let second = at(row1, u0) + (at(row1, u1) - at(row1, u0)) * fu;
                    let i = v * across[0] + u;
                    after[i] = before[i] + step * (first + (second - first) * fv);
                }
            }
        }
        RunningIntegral {
            axes: [along, b, c],
            slope,
            lowest,
            across,
            slices: n,
            sign: direction[along].signum(),
            min: self.min,
            inverse: 1.0 / self.voxel,
            sums,
        }
    }
}

/// The two voxels around `x` (in units of voxel centres, clamped) and the fraction between them.
fn neighbours(x: f64, count: usize) -> (usize, usize, f32) {
    let x = x.clamp(0.0, (count - 1) as f64);
    let i = x as usize;
    (i, (i + 1).min(count - 1), (x - i as f64) as f32)
}

/// P(x) = ∫ρ along one direction from the box's border to x, up to a constant on each ray.
pub struct RunningIntegral {
    axes: [usize; 3],
    slope: [f64; 2],
    lowest: [f64; 2],
    across: [usize; 2],
    slices: usize,
    sign: f64,
    min: DVec3,
    inverse: f64,
    sums: Vec<f32>,
}

impl RunningIntegral {
    /// P at `x`; only differences between points on one line along the direction have a meaning.
    pub fn at(&self, x: DVec3) -> f64 {
        let p = (x - self.min) * self.inverse;
        let [along, b, c] = self.axes;
        let s = p[along].clamp(0.0, self.slices as f64);
        let q = [
            p[b] - self.slope[0] * p[along] - self.lowest[0],
            p[c] - self.slope[1] * p[along] - self.lowest[1],
        ];
        let (u0, u1, fu) = neighbours(q[0], self.across[0]);
        let (v0, v1, fv) = neighbours(q[1], self.across[1]);
        let k = (s as usize).min(self.slices - 1);
        let fs = (s - k as f64) as f32;
        let plane = self.across[0] * self.across[1];
        let at = |k: usize| {
            let sums = &self.sums[k * plane..(k + 1) * plane];
            let row = |v: usize| {
                let (a, b) = (sums[v * self.across[0] + u0], sums[v * self.across[0] + u1]);
                a + (b - a) * fu
            };
            row(v0) + (row(v1) - row(v0)) * fv
        };
        let low = at(k);
        self.sign * f64::from(low + (at(k + 1) - low) * fs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::medium::{Density, Noise};
    use crate::phase::Phase;

    #[test]
    fn differences_match_marching() {
        let noise = Noise { seed: 4, frequency: 1.0, octaves: 2, range: [0.3, 1.5] };
        let medium =
            Medium::new(DVec3::ONE, DVec3::ZERO, Phase::Isotropic, 1.0, Density::Noise(noise)).unwrap();
        let sampled =
            SampledDensity::new(&medium, DVec3::new(-1.0, -0.6, -0.8), DVec3::new(1.0, 0.7, 0.9), 96);
        for direction in crate::directions::even_directions(32, 5) {
            let running = sampled.running(direction);
            let origin = DVec3::new(0.1, -0.05, 0.02);
            let exact = medium.density_length(origin, direction, 0.0, 0.5);
            let got = running.at(origin + direction * 0.5) - running.at(origin);
            assert!((got - exact).abs() < 2e-3 * exact, "{direction}: {got} {exact}");
        }
    }
}
