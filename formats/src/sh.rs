//! Real spherical harmonics without the Condon-Shortley phase, orthonormal on the sphere.
//!
//! Y_l^m = √2 P̃_l^m(z) Re/Im (x+iy)^|m|, with P̃ the normalised associated Legendre function divided by sin^m θ:
//! P̃_0^0 = √(1/4π), P̃_m^m = √((2m+1)/2m) P̃_{m-1}^{m-1}, P̃_l^m = a_lm (z P̃_{l-1}^m - b_lm P̃_{l-2}^m),
//! a = √((4l²-1)/(l²-m²)), b = √(((l-1)²-m²)/(4(l-1)²-1)).  (Sloan 2008, "Stupid Spherical Harmonics Tricks"; the
//! recurrences in thesis appendix A.1.)  "Order K" counts bands: l = 0..K-1, K² coefficients, index l(l+1)+m.
//! Checked by: orthonormality to K = 14 and the addition theorem.

/// Highest number of bands supported.
pub const MAX_ORDER: usize = 14;

/// Number of coefficients of `order` bands.
pub const fn coefficient_count(order: usize) -> usize {
    order * order
}

/// The recurrence constants a_lm, b_lm and the diagonal P̃_m^m, computed once.
struct Constants {
    diagonal: [f64; MAX_ORDER],
    a: [[f64; MAX_ORDER]; MAX_ORDER],
    b: [[f64; MAX_ORDER]; MAX_ORDER],
}

static CONSTANTS: std::sync::LazyLock<Constants> = std::sync::LazyLock::new(|| {
    let mut c = Constants {
        diagonal: [0.0; MAX_ORDER],
        a: [[0.0; MAX_ORDER]; MAX_ORDER],
        b: [[0.0; MAX_ORDER]; MAX_ORDER],
    };
    c.diagonal[0] = (0.25 / std::f64::consts::PI).sqrt();
    for m in 1..MAX_ORDER {
        let m2 = 2.0 * m as f64;
        c.diagonal[m] = c.diagonal[m - 1] * ((m2 + 1.0) / m2).sqrt();
    }
    for m in 0..MAX_ORDER {
        for l in m + 1..MAX_ORDER {
            let (lf, mf) = (l as f64, m as f64);
            let before = (lf - 1.0) * (lf - 1.0);
            c.a[l][m] = ((4.0 * lf * lf - 1.0) / (lf * lf - mf * mf)).sqrt();
            c.b[l][m] = ((before - mf * mf) / (4.0 * before - 1.0)).max(0.0).sqrt();
        }
    }
    c
});

/// Writes the `order`² basis values for the unit vector `(x, y, z)` to `out`.
///
/// # Panics
/// Never for `order` ≤ [`MAX_ORDER`] and `out` of at least `order`² values.
pub fn evaluate(order: usize, direction: [f64; 3], out: &mut [f64]) {
    let [x, y, z] = direction;
    let c = &*CONSTANTS;
    let (mut cos_m, mut sin_m) = (1.0, 0.0); // Re and Im of (x+iy)^m
    for m in 0..order {
        let scale = if m == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
        let (mut before, mut current) = (0.0, c.diagonal[m]);
        for l in m..order {
            if l > m {
                let next = c.a[l][m] * (z * current - c.b[l][m] * before);
                before = current;
                current = next;
            }
            let centre = l * (l + 1);
            out[centre + m] = scale * current * cos_m;
            if m > 0 {
                out[centre - m] = scale * current * sin_m;
            }
        }
        (cos_m, sin_m) = (x * cos_m - y * sin_m, x * sin_m + y * cos_m);
    }
}

/// The same constants in single precision.
static NARROW: std::sync::LazyLock<Vec<[f32; 2]>> = std::sync::LazyLock::new(shader_table);

/// The basis in single precision, as the player uses it.
///
/// # Panics
/// As [`evaluate`].
pub fn evaluate_f32(order: usize, direction: [f32; 3], out: &mut [f32]) {
    let [x, y, z] = direction;
    let table = &*NARROW;
    let (mut cos_m, mut sin_m) = (1.0f32, 0.0f32);
    for m in 0..order {
        let scale = if m == 0 { 1.0 } else { std::f32::consts::SQRT_2 };
        let (even, odd) = (scale * cos_m, scale * sin_m);
        let (mut before, mut current) = (0.0, table[m * MAX_ORDER + m][0]);
        for l in m..order {
            if l > m {
                let [a, b] = table[l * MAX_ORDER + m];
                (before, current) = (current, a * (z * current - b * before));
            }
            let centre = l * (l + 1);
            out[centre + m] = even * current;
            if m > 0 {
                out[centre - m] = odd * current;
            }
        }
        (cos_m, sin_m) = (x * cos_m - y * sin_m, x * sin_m + y * cos_m);
    }
}

/// The recurrence constants as a flat table for shaders: `[diagonal, a, b]`, each `order`-major over
/// `MAX_ORDER × MAX_ORDER` (diagonal on l = m of the first plane).
pub fn shader_table() -> Vec<[f32; 2]> {
    let c = &*CONSTANTS;
    let mut table = vec![[0.0f32; 2]; MAX_ORDER * MAX_ORDER];
    for l in 0..MAX_ORDER {
        for m in 0..=l {
            let (a, b) = if l == m { (c.diagonal[m], 0.0) } else { (c.a[l][m], c.b[l][m]) };
            table[l * MAX_ORDER + m] = [a as f32, b as f32];
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gauss-Legendre nodes and weights by Newton's method on P_n.
    fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
        (0..n)
            .map(|i| {
                let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
                let mut derivative = 0.0;
                for _ in 0..100 {
                    let (mut p0, mut p1) = (1.0, x);
                    for k in 2..=n {
                        let kf = k as f64;
                        (p0, p1) = (p1, ((2.0 * kf - 1.0) * x * p1 - (kf - 1.0) * p0) / kf);
                    }
                    derivative = n as f64 * (x * p1 - p0) / (x * x - 1.0);
                    x -= p1 / derivative;
                }
                (x, 2.0 / ((1.0 - x * x) * derivative * derivative))
            })
            .collect()
    }

    #[test]
    fn orthonormal_to_the_last_band() {
        // A product of two basis functions has degree ≤ 26: 14 Gauss nodes in z and 32 even angles are exact.
        let n = coefficient_count(MAX_ORDER);
        let mut gram = vec![0.0; n * n];
        let mut y = vec![0.0; n];
        for (z, weight) in gauss_legendre(14) {
            for k in 0..32 {
                let angle = std::f64::consts::TAU * k as f64 / 32.0;
                let r = (1.0 - z * z).sqrt();
                evaluate(MAX_ORDER, [r * angle.cos(), r * angle.sin(), z], &mut y);
                for i in 0..n {
                    for j in 0..n {
                        gram[i * n + j] += weight * std::f64::consts::TAU / 32.0 * y[i] * y[j];
                    }
                }
            }
        }
        for i in 0..n {
            for j in 0..n {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((gram[i * n + j] - expected).abs() < 1e-10, "{i} {j}: {}", gram[i * n + j]);
            }
        }
    }

    #[test]
    fn addition_theorem() {
        // Σ_m Y_lm(a) Y_lm(b) = (2l+1)/4π P_l(a·b); recurrence of P_l as the independent side.
        let a = [0.36, 0.48, 0.8];
        let b = [-0.6, 0.0, 0.8];
        let cosine: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
        let (mut ya, mut yb) = ([0.0; 100], [0.0; 100]);
        evaluate(10, a, &mut ya);
        evaluate(10, b, &mut yb);
        let (mut before, mut legendre) = (0.0, 1.0);
        for l in 0..10 {
            let sum: f64 = (l * l..(l + 1) * (l + 1)).map(|i| ya[i] * yb[i]).sum();
            let expected = (2 * l + 1) as f64 / (4.0 * std::f64::consts::PI) * legendre;
            assert!((sum - expected).abs() < 1e-12, "band {l}");
            let lf = l as f64;
            (before, legendre) =
                (legendre, ((2.0 * lf + 1.0) * cosine * legendre - lf * before) / (lf + 1.0));
        }
    }

    #[test]
    fn first_bands_by_hand() {
        let mut y = [0.0; 4];
        evaluate(2, [0.0, 0.6, 0.8], &mut y);
        let c = (3.0 / (4.0 * std::f64::consts::PI)).sqrt();
        assert!((y[0] - 0.282_094_791_773_878).abs() < 1e-14);
        assert!((y[1] - c * 0.6).abs() < 1e-14 && (y[2] - c * 0.8).abs() < 1e-14 && y[3].abs() < 1e-14);
    }

    use proptest::prelude::*;

    /// Largest |Y_l| of a band, √((2l+1)/4π): the addition theorem at one direction.
    fn scale(l: usize) -> f64 {
        ((2 * l + 1) as f64 / (4.0 * std::f64::consts::PI)).sqrt()
    }

    /// Y_l^m of a unit vector in the plane y = 0 and its turns, without recurrence over l: the explicit sum of the
    /// associated Legendre function (Abramowitz and Stegun 8.6.18 and 22.3.8), every factorial in f64.
    fn explicit(l: usize, m: usize, direction: [f64; 3]) -> (f64, f64) {
        let [x, y, z] = direction;
        let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
        // P_l^m / sin^m = 2^-l Σ_k (-1)^k (2l-2k)! / (k! (l-k)! (l-2k-m)!) z^{l-2k-m}
        let mut sum = 0.0;
        for k in 0..=(l - m) / 2 {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            let below = factorial(k) * factorial(l - k) * factorial(l - 2 * k - m);
            sum += sign * factorial(2 * l - 2 * k) / below * z.powi((l - 2 * k - m) as i32);
        }
        let norm = (2 * l + 1) as f64 / (4.0 * std::f64::consts::PI) * factorial(l - m) / factorial(l + m);
        let value = sum * 0.5f64.powi(l as i32) * norm.sqrt() * if m == 0 { 1.0 } else { 2f64.sqrt() };
        let (radius, angle) = (x.hypot(y).powi(m as i32), m as f64 * y.atan2(x));
        (value * radius * angle.cos(), value * radius * angle.sin())
    }

    /// Both precisions at a direction. Bounds in ulps of the band's scale: each step of the recurrence over l rounds
    /// three times and passes on what it has with a factor below 2 on the scale, each power of x + iy three times more:
    /// 3(l+1) roundings, which all 14 bands keep below 64 ulps. The explicit sum cancels to 1e-9 of its terms at l = 13.
    fn check_direction(direction: [f64; 3]) -> Result<(), TestCaseError> {
        let near = direction.map(|v| v as f32);
        let exact = near.map(f64::from);
        let (mut wide, mut narrow) = ([0.0; 196], [0.0f32; 196]);
        evaluate(MAX_ORDER, exact, &mut wide);
        evaluate_f32(MAX_ORDER, near, &mut narrow);
        for order in 1..=MAX_ORDER {
            // Fewer bands are the first of more, to the bit.
            let mut fewer = [0.0f32; 196];
            evaluate_f32(order, near, &mut fewer);
            prop_assert_eq!(&fewer[..order * order], &narrow[..order * order]);
            prop_assert!(fewer[order * order..].iter().all(|v| *v == 0.0));
        }
        for l in 0..MAX_ORDER {
            let ulp = scale(l) * f64::from(f32::EPSILON);
            for m in 0..=l {
                let centre = l * (l + 1);
                let (even, odd) = explicit(l, m, exact);
                prop_assert!((wide[centre + m] - even).abs() < 1e-7 * scale(l), "{} {}", l, m);
                prop_assert!(m == 0 || (wide[centre - m] - odd).abs() < 1e-7 * scale(l), "{} {}", l, m);
                for k in [centre + m, centre - m] {
                    let off = (f64::from(narrow[k]) - wide[k]).abs() / ulp;
                    prop_assert!(off <= 3.0 * (l + 1) as f64, "band {} {}: {} ulps at {:?}", l, m, off, near);
                }
            }
        }
        Ok(())
    }

    #[test]
    fn single_precision_at_axes_and_beside_them() {
        let signs = [-1.0, -1e-20, -1e-7, -0.0, 0.0, 1e-7, 1e-20, 1.0, 1e-3, -1e-3];
        for x in signs {
            for y in signs {
                for z in signs {
                    let length = f64::sqrt(x * x + y * y + z * z);
                    if length > 0.5 {
                        check_direction([x / length, y / length, z / length]).unwrap();
                    }
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn single_precision_in_ulps(z in -1.0f64..=1.0, angle in 0.0f64..std::f64::consts::TAU) {
            let r = (1.0 - z * z).max(0.0).sqrt();
            check_direction([r * angle.cos(), r * angle.sin(), z])?;
        }
    }
}
