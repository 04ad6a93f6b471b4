//! Randomised points in the unit cube: an embedded lattice in van der Corput order (Hickernell et al. 2000), so that
//! every 2ᵏ first points form a lattice, shifted at random and folded by the tent map (Hickernell 2002), which gives
//! smooth integrands that are not periodic an error of second order. The shift depends on pixel and replicate alone,
//! never on threads.

use diaphane_formats::directions::hash;

/// Coordinates of a point: two over the pixel, one along the ray, two for the environment.
pub const DIMENSIONS: usize = 5;

/// An odd generator for each coordinate (any odd number makes each projection onto one axis equally spaced). Chosen
/// bit by bit so that the lattices of 4 to 65,536 points each have a small worst-case error in the first three
/// coordinates (criterion P2), then in all five.
const GENERATOR: [u32; DIMENSIONS] = [29_853, 58_157, 1, 57_989, 60_699];

/// One randomly shifted copy of the lattice.
#[derive(Clone, Copy)]
pub struct Sequence {
    shift: [u32; DIMENSIONS],
}

impl Sequence {
    /// The copy that belongs to `item`, whatever is evaluated before or beside it.
    pub fn new(seed: u64, item: u64) -> Self {
        let own = hash(seed, item);
        Self { shift: std::array::from_fn(|k| (hash(own, k as u64) >> 32) as u32) }
    }

    /// Point `index`, each coordinate strictly within 0..1.
    pub fn point(&self, index: u32) -> [f64; DIMENSIONS] {
        let order = index.reverse_bits();
        std::array::from_fn(|k| {
            let x = order.wrapping_mul(GENERATOR[k]).wrapping_add(self.shift[k]);
            let x = (f64::from(x) + 0.5) / 2f64.powi(32);
            1.0 - (2.0 * x - 1.0).abs()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_and_even() {
        let s = Sequence::new(3, 9);
        for n in [4u32, 16, 64] {
            for k in 0..DIMENSIONS {
                let mut values: Vec<f64> = (0..n).map(|i| s.point(i)[k]).collect();
                assert!(values.iter().all(|x| *x > 0.0 && *x < 1.0));
                values.sort_by(f64::total_cmp);
                // Unfolded, the points are 1/n apart; the fold lays two such rows over each other.
                assert!(values.windows(3).all(|w| w[2] - w[0] <= 2.0 / f64::from(n) + 1e-6));
            }
        }
    }

    #[test]
    fn replicates_average_to_the_integral() {
        // ∫ x² y e^z over the cube = 1/3 · 1/2 · (e - 1).
        let exact = (std::f64::consts::E - 1.0) / 6.0;
        let f = |p: [f64; DIMENSIONS]| p[0] * p[0] * p[1] * p[2].exp();
        let mean = |replicate: u64| {
            let s = Sequence::new(1, replicate);
            (0..256).map(|i| f(s.point(i))).sum::<f64>() / 256.0
        };
        let all = (0..32).map(mean).sum::<f64>() / 32.0;
        assert!((all / exact - 1.0).abs() < 1e-3, "{all} {exact}");
    }
}
