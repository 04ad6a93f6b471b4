//! Density fields ρ(x) and their integrals along rays.

use super::{Grid, Noise, Shapes};
use glam::DVec3;

/// A dimensionless density field.
#[derive(Debug)]
pub enum Density {
    /// The same everywhere.
    Uniform(f64),
    /// A scalar grid, trilinear between voxel centres.
    Grid(Grid),
    /// Parallel layers.
    Layers(Layers),
    /// Fractal value noise.
    Noise(Noise),
    /// Solids over a base density.
    Shapes(Shapes),
}

/// Layers across an axis: every `period` is cut into equal parts, one for each density.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Unit vector across the layers.
    pub axis: DVec3,
    /// Thickness of one sequence, mesh units.
    pub period: f64,
    /// ρ of the parts.
    pub densities: Vec<f64>,
}

impl Layers {
    fn value(&self, x: DVec3) -> f64 {
        let phase = (x.dot(self.axis) / self.period).rem_euclid(1.0);
        let n = self.densities.len();
        self.densities[((phase * n as f64) as usize).min(n - 1)]
    }

    /// ∫ρ ds from 0 to `s` along the axis, exact.
    fn antiderivative(&self, s: f64) -> f64 {
        let n = self.densities.len();
        let part = self.period / n as f64;
        let whole: f64 = self.densities.iter().sum::<f64>() * part;
        let periods = (s / self.period).floor();
        let mut rest = s - periods * self.period;
        let mut sum = periods * whole;
        for rho in &self.densities {
            let piece = rest.min(part);
            sum += rho * piece;
            rest -= piece;
            if rest <= 0.0 {
                break;
            }
        }
        sum
    }

    fn integral(&self, origin: DVec3, direction: DVec3, start: f64, end: f64) -> f64 {
        let slope = direction.dot(self.axis);
        let s = origin.dot(self.axis);
        if (slope * (end - start)).abs() < 1e-9 * self.period {
            return self.value(origin + direction * (0.5 * (start + end))) * (end - start);
        }
        (self.antiderivative(s + slope * end) - self.antiderivative(s + slope * start)) / slope
    }
}

impl Density {
    /// ρ and the scattering part of it at `x`.
    pub fn value(&self, x: DVec3) -> (f64, f64) {
        let same = |rho| (rho, rho);
        match self {
            Self::Uniform(rho) => same(*rho),
            Self::Grid(grid) => same(grid.value(x)),
            Self::Layers(layers) => same(layers.value(x)),
            Self::Noise(noise) => same(noise.value(x)),
            Self::Shapes(shapes) => shapes.value(x),
        }
    }

    /// ∫ρ dt along a ray: exact for uniform, layered and single-column fields and for shapes with flat density; by
    /// Gauss-Legendre quadrature on steps no longer than the field's finest feature otherwise.
    pub fn integral(&self, origin: DVec3, direction: DVec3, start: f64, end: f64) -> f64 {
        match self {
            Self::Uniform(rho) => rho * (end - start),
            Self::Layers(layers) => layers.integral(origin, direction, start, end),
            Self::Grid(grid) => grid.integral(origin, direction, start, end),
            Self::Noise(noise) => march(origin, direction, start, end, noise.feature(), |x| noise.value(x)),
            Self::Shapes(shapes) => shapes.integral(origin, direction, start, end),
        }
    }

    /// What ρ is nowhere below.
    pub fn least(&self) -> f64 {
        match self {
            Self::Uniform(rho) => *rho,
            Self::Grid(grid) => f64::from(grid.values().iter().copied().fold(f32::INFINITY, f32::min)),
            Self::Layers(layers) => layers.densities.iter().copied().fold(f64::INFINITY, f64::min),
            Self::Noise(noise) => noise.range[0].min(noise.range[1]),
            Self::Shapes(shapes) => shapes.shapes.iter().map(|s| s.density).fold(shapes.base, f64::min),
        }
    }

    /// Length over which ρ may change noticeably, mesh units; infinite for a uniform field.
    pub fn feature(&self) -> f64 {
        match self {
            Self::Uniform(_) => f64::INFINITY,
            Self::Grid(grid) => grid.feature(),
            Self::Layers(layers) => layers.period / layers.densities.len() as f64,
            Self::Noise(noise) => noise.feature(),
            Self::Shapes(shapes) => shapes.feature(),
        }
    }
}

/// Two-point Gauss-Legendre rule on steps of at most `step`, at least two and at most 4096 of them.
pub(super) fn march(
    origin: DVec3,
    direction: DVec3,
    start: f64,
    end: f64,
    step: f64,
    value: impl Fn(DVec3) -> f64,
) -> f64 {
    let steps = (((end - start).abs() / step).ceil()).clamp(2.0, 4096.0);
    let h = (end - start) / steps;
    const OFFSET: f64 = 0.288_675_134_594_812_9; // 1/(2√3)
    let mut sum = 0.0;
    for i in 0..steps as usize {
        let middle = start + (i as f64 + 0.5) * h;
        sum += value(origin + direction * (middle - OFFSET * h))
            + value(origin + direction * (middle + OFFSET * h));
    }
    0.5 * sum * h
}

#[cfg(test)]
mod tests {
    use super::super::{Shape, Solid};
    use super::*;

    #[test]
    fn nothing_lies_below_the_least() {
        let hole =
            Shape { solid: Solid::Sphere { center: DVec3::ZERO, radius: 0.5 }, density: 0.3, absorb: false };
        let values = (0..64).map(|i| 0.5 + (i * 37 % 64) as f32).collect();
        for density in [
            Density::Uniform(0.7),
            Density::Grid(Grid::new([4; 3], DVec3::NEG_ONE, DVec3::ONE, values).unwrap()),
            Density::Layers(Layers { axis: DVec3::Y, period: 0.3, densities: vec![2.0, 0.4, 1.0] }),
            Density::Noise(Noise { seed: 3, frequency: 4.0, octaves: 3, range: [0.2, 1.5] }),
            Density::Shapes(Shapes { base: 1.0, shapes: vec![hole] }),
        ] {
            let at = |i: i32| {
                DVec3::new(f64::from(i % 11), f64::from(i / 11 % 11), f64::from(i / 121)) / 5.0 - 1.0
            };
            let lowest = (0..1331).map(|i| density.value(at(i)).0).fold(f64::INFINITY, f64::min);
            let least = density.least();
            assert!(least > 0.0 && lowest >= least && lowest < 4.0 * least, "{density:?}: {lowest} {least}");
        }
    }

    #[test]
    fn layers_integrate_exactly() {
        let layers = Layers { axis: DVec3::new(0.6, 0.8, 0.0), period: 0.25, densities: vec![1.0, 0.2, 3.0] };
        let density = Density::Layers(layers.clone());
        let origin = DVec3::new(-0.31, 0.2, 0.7);
        for direction in [DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.48, -0.6, 0.64), DVec3::new(-0.8, 0.6, 0.0)]
        {
            let exact = density.integral(origin, direction, 0.1, 1.7);
            let n = 400_000;
            let h = 1.6 / n as f64;
            let sum: f64 =
                (0..n).map(|i| layers.value(origin + direction * (0.1 + (i as f64 + 0.5) * h))).sum();
            // At most 16 steps of the density fall into some cell of the sum: each costs up to h · 2.8 / 2.
            assert!((exact - sum * h).abs() < 16.0 * 1.4 * h, "{direction}: {exact} {}", sum * h);
        }
    }
}
