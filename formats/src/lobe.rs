//! Lobes in four bytes: the vector a of max(a·ω, 0), the cosine of a sample's nearest surface, that some samples carry
//! beside their harmonics.
//!
//! Lowest bits first: 10 and 10 bits of the unit vector's octahedral map (Cigolle et al. 2014), the middle code is 0, so
//! that axes are exact (others within 0.004); 12 bits of its length, even in the logarithm over 2^-10..2^10 (0.2 %), 0
//! for no lobe.

use glam::{Vec2, Vec2Swizzles, Vec3};

/// Half the steps of a component of the map.
const HALF: f32 = 511.0;
/// Largest code of a length.
const MOST: f32 = 4095.0;
/// Octaves of the shortest and the longest lobe.
const OCTAVES: [f32; 2] = [-10.0, 10.0];

/// The nearest code; 0 for vectors that are not finite or shorter than half the shortest lobe.
pub fn code(a: Vec3) -> u32 {
    let length = a.length();
    if !length.is_finite() || length < 0.5 * OCTAVES[0].exp2() {
        return 0;
    }
    let n = a / (a.x.abs() + a.y.abs() + a.z.abs());
    let flat = if n.z < 0.0 { folded(n.truncate()) } else { n.truncate() };
    let step = |v: f32| (v * HALF + HALF).round().clamp(0.0, 2.0 * HALF) as u32;
    let unit = (length.log2() - OCTAVES[0]) / (OCTAVES[1] - OCTAVES[0]);
    let size = (1.0 + unit * (MOST - 1.0)).round().clamp(1.0, MOST) as u32;
    step(flat.x) | step(flat.y) << 10 | size << 20
}

/// The vector of a code.
pub fn vector(code: u32) -> Vec3 {
    let size = (code >> 20) as f32;
    if size == 0.0 {
        return Vec3::ZERO;
    }
    let part = |shift: u32| ((code >> shift & 1023) as f32 - HALF) / HALF;
    let flat = Vec2::new(part(0), part(10));
    let z = 1.0 - flat.x.abs() - flat.y.abs();
    let n = if z < 0.0 { folded(flat) } else { flat }.extend(z).normalize_or(Vec3::Z);
    n * (OCTAVES[0] + (size - 1.0) / (MOST - 1.0) * (OCTAVES[1] - OCTAVES[0])).exp2()
}

/// The lower half of the octahedron, turned outwards, and back.
fn folded(v: Vec2) -> Vec2 {
    (Vec2::ONE - v.abs().yx()) * Vec2::new(1f32.copysign(v.x), 1f32.copysign(v.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directions::even_directions;

    #[test]
    fn vectors_survive() {
        for (i, d) in even_directions(2000, 9).into_iter().enumerate() {
            let a = d.as_vec3() * 2f32.powf(-9.5 + 19.0 * (i as f32 / 2000.0));
            let read = vector(code(a));
            // Half a step of the map is 1/1022 in two components on |x|+|y|+|z| = 1 and twice that in the third, √6/1022
            // together, and unit vectors are up to √3 longer; half a step of the length is 2^(10/4094).
            assert!((read.normalize() - a.normalize()).length() < 4.2e-3, "{a} {read}");
            assert!((read.length() / a.length() - 1.0).abs() < 1.8e-3, "{a} {read}");
            assert_eq!(code(read), code(a), "a stored lobe is stored as it is");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for a in [axis, -axis] {
                assert!((vector(code(a)).normalize() - a).length() < 1e-6, "axes are exact");
            }
        }
    }

    #[test]
    fn any_code_is_finite_and_odd_vectors_are_none() {
        for i in 0..200_000u64 {
            assert!(vector(crate::directions::hash(7, i) as u32).is_finite());
        }
        for a in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(1e-9)] {
            assert_eq!(code(a), 0);
        }
        assert_eq!(vector(0), Vec3::ZERO);
    }
}
