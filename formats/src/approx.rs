//! Exponential and error function without branches, for loops that the compiler turns into vector instructions.

/// e^x for x ≤ 88, relative error below 2e-7; 1e-38 stands for all smaller values. The power of two is split off by
/// adding 1.5·2^23, which leaves the nearest integer in the lowest bits; a polynomial of degree 6 does the rest.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    const ROUND: f32 = 12_582_912.0;
    let x = if x > -87.0 { x } else { -87.0 };
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    // ln 2 in two parts: the first has few bits, so that its product is exact.
    let f = (x - n * 0.693_359_4) + n * 2.121_944_4e-4;
    let p = 0.5 + f * (1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f * (1.0 / 720.0))));
    let power = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
    (1.0 + f * (1.0 + f * p)) * power
}

/// erf x, absolute error below 5e-7: x P(x²)/Q(x²), fitted by reweighted least squares over |x| ≤ 3.95, where
/// 1 - erf falls below half a unit in the last place.
#[inline(always)]
pub fn erf(x: f32) -> f32 {
    let x = if x > -3.95 { x } else { -3.95 };
    let x = if x < 3.95 { x } else { 3.95 };
    let s = x * x;
    let p = 3.917_343e-3 + s * (2.876_014_2e-4 + s * 2.011_740_3e-6);
    let p = std::f32::consts::FRAC_2_SQRT_PI + s * (0.194_036_25 + s * (0.053_207_136 + s * p));
    let q = 1.527_075_1e-2 + s * (1.198_207_5e-3 + s * 3.783_973e-5);
    let q = 1.0 + s * (0.505_291_64 + s * (0.115_590_99 + s * q));
    x * p / q
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_and_error_function() {
        for i in 0..=40_000 {
            let x = -86.0 + 174.0 * i as f32 / 40_000.0;
            let exact = f64::from(x).exp();
            assert!((f64::from(exp(x)) / exact - 1.0).abs() < 3e-7, "exp {x}: {} {exact}", exp(x));
            let x = -6.0 + 12.0 * i as f32 / 40_000.0;
            assert!((f64::from(erf(x)) - libm::erf(f64::from(x))).abs() < 5e-7, "erf {x}");
        }
        assert!(exp(-1e30) < 1e-37 && exp(f32::NEG_INFINITY) < 1e-37);
    }
}
