//! Directions that cover the sphere evenly, sub-pixel positions, and seeds.
//!
//! Directions: spherical Fibonacci lattice (Swinbank and Purser 2006; Marques et al. 2013) on the upper half
//! sphere plus its mirror image, turned by a seeded random rotation. Mirrored pairs let one projection of the mesh
//! serve ω and -ω.

use glam::{DQuat, DVec3};

/// `count` even directions as pairs (ω, -ω, ω', -ω', ...); an odd count leaves the last one without a partner.
/// Each stands for a solid angle of 4π / count.
pub fn even_directions(count: usize, seed: u64) -> Vec<DVec3> {
    let rotation = random_rotation(seed);
    let half = count.div_ceil(2);
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let mut directions = Vec::with_capacity(count + 1);
    for i in 0..half {
        let z = (i as f64 + 0.5) / half as f64;
        let radius = (1.0 - z * z).sqrt();
        let (sin, cos) = (golden * i as f64).sin_cos();
        let direction = (rotation * DVec3::new(radius * cos, radius * sin, z)).normalize();
        directions.push(direction);
        directions.push(-direction);
    }
    directions.truncate(count);
    directions
}

/// A uniformly distributed rotation (Shoemake 1992) drawn from `seed`.
pub fn random_rotation(seed: u64) -> DQuat {
    let unit = |stream: u64| hash(seed, stream) as f64 / 2f64.powi(64);
    let (u, v, w) = (unit(1), unit(2) * std::f64::consts::TAU, unit(3) * std::f64::consts::TAU);
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    DQuat::from_xyzw(a * v.sin(), a * v.cos(), b * w.sin(), b * w.cos()).normalize()
}

/// Mixes a seed and an index into 64 well-spread bits (the finaliser of SplitMix64, Steele et al. 2014), so that
/// every item owns its random numbers whatever thread works on it.
pub fn hash(seed: u64, index: u64) -> u64 {
    let mut x = seed ^ index.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// Positions of `count` rays inside a pixel, each component in (0, 1): a regular grid when `count` is a square,
/// otherwise a Hammersley set.
pub fn subpixel_offsets(count: usize) -> Vec<[f32; 2]> {
    let side = (count as f64).sqrt().round() as usize;
    if side * side == count {
        let cell = |i: usize| (i as f32 + 0.5) / side as f32;
        return (0..count).map(|i| [cell(i % side), cell(i / side)]).collect();
    }
    let radical_inverse = |i: usize| (i as u32).reverse_bits() as f64 / 2f64.powi(32);
    let shift = 0.5 / count as f64;
    (0..count)
        .map(|i| [((i as f64 + 0.5) / count as f64) as f32, (radical_inverse(i) + shift) as f32])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_and_balanced() {
        for count in [1usize, 2, 3, 32, 255, 256] {
            let set = even_directions(count, 7);
            assert_eq!(set.len(), count);
            assert!(set.iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
            if count % 2 == 0 {
                let sum: DVec3 = set.iter().copied().sum();
                assert!(sum.length() < 1e-9, "pairs cancel");
            }
        }
    }

    #[test]
    fn directions_integrate_quadratics() {
        // The mean of x² over the sphere is 1/3.
        let set = even_directions(256, 3);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let mean: f64 = set.iter().map(|d| d.dot(axis).powi(2)).sum::<f64>() / 256.0;
            assert!((mean - 1.0 / 3.0).abs() < 2e-3, "{mean}");
        }
    }

    #[test]
    fn subpixels_stay_inside_and_centre() {
        for count in 1..40 {
            let set = subpixel_offsets(count);
            assert_eq!(set.len(), count);
            assert!(set.iter().flatten().all(|&x| x > 0.0 && x < 1.0));
            let mean = set.iter().map(|o| o[0]).sum::<f32>() / count as f32;
            assert!((mean - 0.5).abs() < 1e-5);
        }
    }
}
