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

/// e^{x²} erfc x for x ≥ 0, relative error below 6e-7: t P(t) with t = 1/(1 + 0.4 x), fitted over all of 0..∞ in t.
#[inline(always)]
pub fn scaled_erfc(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.4 * x);
    let p = 0.168_643_86 + t * (-0.182_615_35 + t * 0.050_187_29);
    let p = 0.168_578_18 + t * (0.141_277_34 + t * (-0.005_255_413 + t * p));
    t * (0.225_675_87 + t * (0.225_669_77 + t * (0.207_838_58 + t * p)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_and_scaled_error_function() {
        for i in 0..=40_000 {
            let x = -86.0 + 174.0 * i as f32 / 40_000.0;
            let exact = f64::from(x).exp();
            assert!((f64::from(exp(x)) / exact - 1.0).abs() < 3e-7, "exp {x}: {} {exact}", exp(x));
            let x = 10f64.powf(-4.0 + 5.4 * f64::from(i) / 40_000.0);
            let exact = (x * x).exp() * libm::erfc(x);
            assert!((f64::from(scaled_erfc(x as f32)) / exact - 1.0).abs() < 6e-7, "erfc {x}");
        }
        let far = scaled_erfc(1e6) * 1e6 * std::f32::consts::PI.sqrt();
        assert!((far - 1.0).abs() < 1e-5 && scaled_erfc(0.0) > 0.999_999, "{far}");
        assert!(exp(-1e30) < 1e-37 && exp(f32::NEG_INFINITY) < 1e-37);
    }
}
