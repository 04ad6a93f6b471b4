//! Fractal value noise: octaves of trilinearly blended (smoothstep) lattice values, each at twice the frequency and
//! half the amplitude of the one before (Perlin 1985, in its value-noise form), mapped to a range.

use crate::directions::hash;
use glam::DVec3;

/// Parameters of the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Chooses the pattern.
    pub seed: u64,
    /// Lattice cells per mesh unit of the first octave.
    pub frequency: f64,
    /// Number of octaves, 1..16.
    pub octaves: u32,
    /// Smallest and largest ρ.
    pub range: [f64; 2],
}

impl Noise {
    /// ρ at `x`.
    pub fn value(&self, x: DVec3) -> f64 {
        let (mut sum, mut norm, mut amplitude, mut frequency) = (0.0, 0.0, 1.0, self.frequency);
        for octave in 0..self.octaves {
            sum += amplitude * self.lattice(x * frequency, octave);
            norm += amplitude;
            amplitude *= 0.5;
            frequency *= 2.0;
        }
        self.range[0] + (self.range[1] - self.range[0]) * sum / norm
    }

    /// Half a cell of the finest octave.
    pub fn feature(&self) -> f64 {
        0.5 / (self.frequency * 2f64.powi(self.octaves as i32 - 1))
    }

    fn lattice(&self, p: DVec3, octave: u32) -> f64 {
        let cell = p.floor();
        let f = p - cell;
        let s = f * f * (3.0 - 2.0 * f);
        let [i, j, k] = cell.to_array().map(|c| c as i64);
        let corner = |di: i64, dj: i64, dk: i64| {
            // The lattice ends where its cells are no longer told apart; the last ones have no neighbours.
            let mix = hash(self.seed ^ u64::from(octave) << 56, i.saturating_add(di) as u64);
            let mix = hash(hash(mix, j.saturating_add(dj) as u64), k.saturating_add(dk) as u64);
            (mix >> 11) as f64 / (1u64 << 53) as f64
        };
        let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |dj: i64, dk: i64| lerp(corner(0, dj, dk), corner(1, dj, dk), s.x);
        lerp(lerp(row(0, 0), row(1, 0), s.y), lerp(row(0, 1), row(1, 1), s.y), s.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stays_in_range_and_is_continuous() {
        let noise = Noise { seed: 1, frequency: 3.0, octaves: 4, range: [0.2, 1.8] };
        let mut last = noise.value(DVec3::new(0.0, 0.3, -0.2));
        for i in 1..4000 {
            let v = noise.value(DVec3::new(1e-3 * f64::from(i), 0.3, -0.2));
            assert!((0.2..=1.8).contains(&v));
            assert!((v - last).abs() < 0.05, "jump at {i}");
            last = v;
        }
    }
}
