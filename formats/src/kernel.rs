//! The samples' kernel and its closed-form integral along a ray.
//!
//! Kernel around a centre b, compact and continuous: γ(x) = max(e^{-a²|x-b|²} - e^{-C}, 0) with cut-off C = 5, so it
//! vanishes at R = √C / a. (The thesis uses the bare Gaussian cut at 1e-6, section 3.4.2; the common factor
//! 1/(1-e^{-C}) is left out because weights are always normalised.)
//!
//! Along a ray at distance d from b, with attenuation κ counted from `start`:
//!
//!   G = ∫_{start}^{end} e^{-κ(t-start)} (e^{-a²(d²+(t-tc)²)} - e^{-C}) dt
//!
//! With x(t) = a(t-tc) + κ/2a, f the attenuated Gaussian and W(x) = e^{x²} erfc(x):
//!
//!   ∫f = √π/2a · [ f(start) W(x0) - f(end) W(x1) ]           for x0 ≥ 0
//!      = √π/2a · [ f(end) W(-x1) - f(start) W(-x0) ]         for x1 ≤ 0
//!      = √π/2a · [ 2 f(peak) - f(start) W(-x0) - f(end) W(x1) ]  otherwise
//!
//! which never forms e^{κ²/4a²} and so neither overflows nor cancels; short pieces use three Gauss-Legendre points.
//! Checked against adaptive quadrature in f64 over 12 decades of a and 8 of κ/a.

use crate::approx;

/// Exponent at which the kernel is cut.
pub const CUT_OFF: f32 = 5.0;
/// e^{-CUT_OFF}.
pub const CUT_OFF_VALUE: f32 = 0.006_737_947;
/// √CUT_OFF: the kernel's radius is this over `a`.
pub const CUT_OFF_RADIUS: f32 = 2.236_068;

/// Sharpness a = 2√ln2 / (factor · radius): full width at half maximum of `factor` disk radii (thesis section 3.3.2).
pub fn sharpness(radius: f32, width_factor: f32) -> f32 {
    const TWO_ROOT_LN2: f32 = 1.665_109_2;
    TWO_ROOT_LN2 / (width_factor * radius)
}

/// The kernel at squared distance `distance2`, 0 beyond the cut-off.
#[inline(always)]
pub fn value(a: f32, distance2: f32) -> f32 {
    (approx::exp(-a * a * distance2) - CUT_OFF_VALUE).max(0.0)
}

/// W(x) = e^{x²} erfc(x) for x ≥ 0, relative error below 2e-7: the Chebyshev fit of Numerical Recipes, section 6.2.
pub fn scaled_erfc(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.5 * x);
    let p = -1.135_204 + t * (1.488_515_9 + t * (-0.822_152_2 + t * 0.170_872_77));
    let p = 0.096_784_18 + t * (-0.186_288_06 + t * (0.278_868_07 + t * p));
    let p = -1.265_512_2 + t * (1.000_023_7 + t * (0.374_091_96 + t * p));
    t * p.exp()
}

/// The part of `start..end` where the ray is inside the kernel's support; `None` where it misses.
/// `d2` is the squared distance of the ray's line from the centre, `tc` the ray parameter of the closest approach.
pub fn clip(a: f32, d2: f32, tc: f32, start: f32, end: f32) -> Option<(f32, f32)> {
    let h2 = (CUT_OFF / (a * a)) - d2;
    if h2 <= 0.0 {
        return None;
    }
    let h = h2.sqrt();
    let (from, to) = (start.max(tc - h), end.min(tc + h));
    (from < to).then_some((from, to))
}

/// G of the module's head over `start..end`, both inside the support (see [`clip`]). Never negative, never NaN for
/// finite arguments with a > 0 and κ ≥ 0.
pub fn integral(a: f32, d2: f32, tc: f32, kappa: f32, start: f32, end: f32) -> f32 {
    let length = end - start;
    let (u0, u1) = (a * (start - tc), a * (end - tc));
    let ad2 = a * a * d2;
    if a * length < 0.5 && kappa * length < 0.5 {
        return short_integral(ad2, u0, a, kappa, length);
    }
    let half = kappa / (2.0 * a);
    let (x0, x1) = (u0 + half, u1 + half);
    let decay = (-kappa * length).exp();
    let f0 = (-ad2 - u0 * u0).exp();
    let f1 = decay * (-ad2 - u1 * u1).exp();
    let sum = if x0 >= 0.0 {
        f0 * scaled_erfc(x0) - f1 * scaled_erfc(x1)
    } else if x1 <= 0.0 {
        f1 * scaled_erfc(-x1) - f0 * scaled_erfc(-x0)
    } else {
        // The attenuated Gaussian peaks at x = 0, that is at t = start - x0 / a.
        let peak = (-ad2 - half * half + kappa * x0 / a).exp();
        2.0 * peak - f0 * scaled_erfc(-x0) - f1 * scaled_erfc(x1)
    };
    const HALF_ROOT_PI: f32 = 0.886_226_95;
    let cut = CUT_OFF_VALUE * length * decay_mean(kappa * length);
    (HALF_ROOT_PI / a * sum - cut).max(0.0)
}

/// Mean of t - tc over `start..end` under the attenuated Gaussian, given G = [`integral`] of the same arguments:
///
///   -κ/2a² + [f(start) - f(end)] / (2a² ∫f),   ∫f = G + e^{-C} ∫e^{-κ(t-start)} dt,
///
/// because f' = -2a² (t - tc + κ/2a²) f. Always within the piece.
pub fn mean_offset(a: f32, d2: f32, tc: f32, kappa: f32, start: f32, end: f32, integral: f32) -> f32 {
    let length = end - start;
    let (u0, u1) = (a * (start - tc), a * (end - tc));
    let ad2 = a * a * d2;
    let ends = (-ad2 - u0 * u0).exp() - (-ad2 - u1 * u1 - kappa * length).exp();
    let whole = integral + CUT_OFF_VALUE * length * decay_mean(kappa * length);
    let mean = (0.5 / a * ends / whole.max(1e-30) - kappa / (2.0 * a)) / a;
    mean.max(start - tc).min(end - tc)
}

/// Three-point Gauss-Legendre rule for pieces much shorter than the kernel and the mean free path.
fn short_integral(ad2: f32, u0: f32, a: f32, kappa: f32, length: f32) -> f32 {
    const NODES: [f32; 3] = [0.112_701_67, 0.5, 0.887_298_35];
    const WEIGHTS: [f32; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
    let mut sum = 0.0;
    for (node, weight) in NODES.iter().zip(WEIGHTS) {
        let s = node * length;
        let u = u0 + a * s;
        sum += weight * (-kappa * s).exp() * ((-ad2 - u * u).exp() - CUT_OFF_VALUE).max(0.0);
    }
    sum * length
}

/// (1 - e^{-y}) / y, the mean of the decay over a piece of optical depth y ≥ 0; 1 at y = 0.
pub fn decay_mean(y: f32) -> f32 {
    if y < 0.02 { 1.0 - y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0))) } else { (1.0 - (-y).exp()) / y }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Composite Gauss-Legendre quadrature in f64 on pieces that resolve both the Gaussian and the decay.
    fn quadrature(a: f64, d2: f64, tc: f64, kappa: f64, start: f64, end: f64) -> f64 {
        let nodes = [
            (-0.960_289_856_497_536, 0.101_228_536_290_376),
            (-0.796_666_477_413_627, 0.222_381_034_453_374),
            (-0.525_532_409_916_329, 0.313_706_645_877_887),
            (-0.183_434_642_495_650, 0.362_683_783_378_362),
        ];
        // Beyond 60 mean free paths nothing is left in f32.
        let end = if kappa > 0.0 { end.min(start + 60.0 / kappa) } else { end };
        let pieces = (((end - start) * (a + kappa)).ceil() * 2.0).clamp(4.0, 4000.0) as usize;
        let h = (end - start) / pieces as f64;
        let f = |t: f64| {
            (-kappa * (t - start)).exp()
                * ((-a * a * (d2 + (t - tc) * (t - tc))).exp() - f64::from(CUT_OFF_VALUE)).max(0.0)
        };
        let mut sum = 0.0;
        for p in 0..pieces {
            let middle = start + (p as f64 + 0.5) * h;
            for (x, w) in nodes {
                sum += w * 0.5 * h * (f(middle + 0.5 * h * x) + f(middle - 0.5 * h * x));
            }
        }
        sum
    }

    #[test]
    fn scaled_erfc_against_f64() {
        for i in 0..2000 {
            let x = 10f64.powf(-4.0 + 5.0 * f64::from(i) / 2000.0);
            let exact = if x < 20.0 {
                (x * x).exp() * libm::erfc(x)
            } else {
                // Asymptotic series, Abramowitz and Stegun 7.1.23.
                let q = 1.0 / (2.0 * x * x);
                (1.0 - q * (1.0 - 3.0 * q * (1.0 - 5.0 * q * (1.0 - 7.0 * q))))
                    / (x * std::f64::consts::PI.sqrt())
            };
            let got = f64::from(scaled_erfc(x as f32));
            assert!((got / exact - 1.0).abs() < 2e-6, "x {x}: {got} {exact}");
        }
    }

    #[test]
    fn decay_mean_is_smooth() {
        for i in 0..1000 {
            let y = 10f64.powf(-8.0 + 12.0 * f64::from(i) / 1000.0);
            let exact = -(-y).exp_m1() / y;
            assert!((f64::from(decay_mean(y as f32)) / exact - 1.0).abs() < 4e-6, "{y}");
        }
        assert_eq!(decay_mean(0.0), 1.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]
        /// Scales from 1e-6 to 1e6: a is drawn over 12 decades, κ from 0 to 1e4 kernels, any clip.
        #[test]
        fn integral_matches_quadrature(
            log_a in -6.0f64..6.0, depth in -4.0f64..4.0, d in 0.0f64..1.0, from in -1.0f64..1.0, to in -1.0f64..1.0,
        ) {
            let a = 10f64.powf(log_a) as f32;
            let kappa = (10f64.powf(depth) * f64::from(a)) as f32;
            let radius = f64::from(CUT_OFF_RADIUS) / f64::from(a);
            let d2 = ((d * radius) * (d * radius)) as f32;
            let (low, high) = (from.min(to), from.max(to));
            let tc = (1.7 * radius) as f32;
            let start = (f64::from(tc) + low * radius) as f32;
            let end = (f64::from(tc) + high * radius) as f32;
            if let Some((s, e)) = clip(a, d2, tc, start, end) {
                let got = f64::from(integral(a, d2, tc, kappa, s, e));
                let exact = quadrature(f64::from(a), f64::from(d2), f64::from(tc), f64::from(kappa), f64::from(s), f64::from(e));
                // Relative to the unattenuated scale of the kernel over this piece: f32 positions carry 1e-7 of tc.
                let scale = (f64::from(e - s)).min(1.0 / f64::from(kappa).max(1e-30));
                prop_assert!(got.is_finite() && got >= 0.0);
                prop_assert!((got - exact).abs() <= 4e-6 * scale, "got {got} exact {exact} scale {scale}");
            }
        }

        /// The closed-form mean against quadrature of t under the bare attenuated Gaussian.
        #[test]
        fn mean_offset_matches_quadrature(depth in -3.0f64..2.0, d in 0.0f64..0.9, from in -1.0f64..1.0, to in -1.0f64..1.0) {
            let (a, tc) = (20.0f64, 0.3f64);
            let kappa = 10f64.powf(depth) * a;
            let radius = f64::from(CUT_OFF_RADIUS) / a;
            let h = radius * (1.0 - d * d).sqrt();
            let (s, e) = (tc + from.min(to) * h, tc + from.max(to) * h);
            if (e - s) * a > 0.3 {
                let d2 = (d * radius).powi(2);
                let (mut sum, mut first) = (0.0, 0.0);
                for i in 0..20_000 {
                    let t = s + (e - s) * (f64::from(i) + 0.5) / 20_000.0;
                    let f = (-kappa * (t - s) - a * a * (t - tc) * (t - tc)).exp();
                    sum += f;
                    first += f * (t - tc);
                }
                let args = [a, d2, tc, kappa, s, e].map(|v| v as f32);
                let g = integral(args[0], args[1], args[2], args[3], args[4], args[5]);
                let got = f64::from(mean_offset(args[0], args[1], args[2], args[3], args[4], args[5], g));
                prop_assert!((got - first / sum).abs() * a < 5e-3, "{got} {}", first / sum);
            }
        }

        #[test]
        fn never_nan(a in 1e-12f32..1e12, kappa in 0.0f32..1e30, tc in -1e12f32..1e12, s in -1e12f32..1e12, e in -1e12f32..1e12, d in 0.0f32..1e12) {
            if let Some((s, e)) = clip(a, d * d, tc, s.min(e), s.max(e)) {
                let got = integral(a, d * d, tc, kappa, s, e);
                prop_assert!(got.is_finite() && got >= 0.0, "{got}");
            }
        }
    }
}
