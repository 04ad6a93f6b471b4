use super::*;

#[test]
fn form_without_branches_agrees_with_the_general_one() {
    // Error relative to the whole kernel's weight √π/a with the attenuation at its centre's side of the piece.
    for (i, a) in [(0, 0.02f32), (1, 1.0), (2, 30.0), (3, 5e4)] {
        for j in 0..4000u64 {
            let unit = |n| crate::directions::hash(i, 8 * j + n) as f32 / 2f32.powi(64);
            let kappa = DENSE * a * unit(0) * unit(4);
            let d2 = CUT_OFF / (a * a) * unit(1);
            let (start, piece, tc) = (2.0 / a, 5.0 * unit(2) / a, (1.0 + 6.0 * unit(3)) / a);
            let Some((from, to)) = kernel::clip(a, d2, tc, start, start + piece) else {
                continue;
            };
            let before = kappa * (from - start);
            let exact = kernel::integral(a, d2, tc, kappa, from, to) * (-before).exp();
            let (got, mean) = attenuated_integral(a, d2, from - tc, to - from, kappa, before);
            assert!((got - exact).abs() <= 6e-6 / a, "a {a} κ {kappa}: {got} {exact} {}", (got - exact) * a);
            // The mean matters as far as the kernel has weight.
            let whole = kernel::integral(a, d2, tc, kappa, from, to);
            let general = kernel::mean_offset(a, d2, tc, kappa, from, to, whole);
            if a * whole > 0.05 {
                assert!((mean - general).abs() * a < 1e-3, "a {a} κ {kappa}: {mean} {general}");
            }
        }
    }
}

#[test]
fn padding_has_no_weight() {
    let mut hits = Hits::default();
    let along = Along::Uniform(Vec3::ONE);
    assert_eq!(hits.piece_radiance(0.0, 2.0, &along), PieceSum::default());
    hits.push(Hit {
        tc: 1.0,
        d2: 0.1,
        a: 2.0,
        weight: 0.5,
        source: Vec3::new(1.0, 2.0, 3.0),
        rise: [0.0; 3],
        slope: [0.0; 3],
    });
    let sum = hits.piece_radiance(0.0, 2.0, &along);
    assert_eq!(sum.splats, 1);
    let exact = Vec3::new(1.0, 2.0, 3.0) * (1.0 - (-2.0f32).exp());
    assert!((sum.radiance - exact).length() < 1e-6 * exact.length());
}

use proptest::prelude::*;

/// e^{-before} ∫ e^{-κ(t-from)} (e^{-a²(d²+t²)} - e^{-C}) dt over `s..s + length` in f64, t counted from the
/// centre's closest approach: Gauss-Legendre panels that resolve both factors, 45 mean free paths deep.
fn quadrature([a, d2, s, length, kappa, before]: [f64; 6]) -> f64 {
    const RULE: [(f64, f64); 4] = [
        (0.183_434_642_495_650, 0.362_683_783_378_362),
        (0.525_532_409_916_329, 0.313_706_645_877_887),
        (0.796_666_477_413_627, 0.222_381_034_453_374),
        (0.960_289_856_497_536, 0.101_228_536_290_376),
    ];
    let seen = if kappa > 0.0 { length.min(45.0 / kappa) } else { length };
    let panels = (seen * (a + kappa)).ceil().max(1.0);
    let half = 0.5 * seen / panels;
    let value = |at: f64| {
        let (t, cut) = (s + at, f64::from(CUT_OFF_VALUE));
        (-kappa * at).exp() * ((-a * a * (d2 + t * t)).exp() - cut).max(0.0)
    };
    let panel = |p: usize| {
        let middle = (2 * p + 1) as f64 * half;
        RULE.iter().map(|(x, w)| w * (value(middle + half * x) + value(middle - half * x))).sum::<f64>()
    };
    (0..panels as usize).map(panel).sum::<f64>() * half * (-before).exp()
}

/// Both closed forms against f64 at one set of arguments in units of the kernel, its sharpness `a` apart.
///
/// The bound, in units of √π/2a e^{-before}: the three terms, at most 1, 1 and 2, each carry the error function's
/// 6e-7 (2e-6 in the general form), the exponential's 3e-7 and the rounding x·2^-23 of exponents x, which e^{-x}
/// keeps below 2^-24 each; with the cut-off's 3e-6 · 0.0067 · 4.5: below 4.5e-6 (9e-6). `before` rounds as well.
fn check_weight(a: f64, [d, from, to, depth, before]: [f64; 5]) -> Result<(), TestCaseError> {
    let radius = f64::from(CUT_OFF).sqrt();
    let reach = radius * (1.0 - d * d).max(0.0).sqrt();
    let (low, high) = (from.min(to) * reach, from.max(to) * reach);
    let one = [a, (d * radius / a).powi(2), low / a, (high - low) / a, depth * a, before].map(|v| v as f32);
    let exact = quadrature(one.map(f64::from));
    let [a, d2, s, length, kappa, before] = one;
    let unit = 0.886_23 / f64::from(a) * (-f64::from(before)).exp();
    let rounding = 1.0 + 0.2 * f64::from(before);
    // 1e-38 stands for all smaller exponentials, and below it numbers lie 2^-149 apart.
    let dark = 4e-38 / f64::from(a) + 4.0 * 2f64.powi(-149);
    if length == 0.0 {
        // A lane that the clipping leaves without weight.
        return Ok(());
    }
    if kappa <= DENSE * a {
        let (w, mean) = attenuated_integral(a, d2, s, length, kappa, before);
        prop_assert!(
            w >= 0.0 && w.is_finite() && mean >= s && mean <= s + length,
            "{:?}: {} {}",
            one,
            w,
            mean
        );
        let off = (f64::from(w) - exact).abs();
        prop_assert!(off <= 4.5e-6 * unit * rounding + dark, "{:?}: {} {}: {}", one, w, exact, off / unit);
    }
    let (w, mean) = dense_integral(a, d2, s, length, kappa, before);
    prop_assert!(w >= 0.0 && w.is_finite() && mean >= s && mean <= s + length, "{:?}: {} {}", one, w, mean);
    let off = (f64::from(w) - exact).abs();
    prop_assert!(off <= 9e-6 * unit * rounding + dark, "{:?}: {} {}: {}", one, w, exact, off / unit);
    Ok(())
}

#[test]
fn weights_at_the_ends_of_their_range() {
    for a in [1e-6, 1.0, 1e6, 1e9] {
        for d in [0.0, 1e-4, 0.5, 0.999_9, 1.0] {
            for (from, to) in
                [(-1.0, 1.0), (-1.0, -0.999), (0.0, 1e-6), (0.0, 1.0), (0.999, 1.0), (-1e-3, 1e-3)]
            {
                for depth in [0.0, 1e-6, 1e-3, 1.0, 2.0, 2.001, 40.0, 1e3, 1e6] {
                    for before in [0.0, 1e-3, 1.0, 20.0, 80.0, 1e4] {
                        check_weight(a, [d, from, to, depth, before]).unwrap();
                    }
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6000, failure_persistence: None, ..ProptestConfig::default() })]
    /// Sharpness over 15 decades, κ/a over 12, every part of the support, any depth in front.
    #[test]
    fn weights_match_quadrature(
        log_a in -6.0f64..9.0, d in 0.0f64..1.0, from in -1.0f64..1.0, to in -1.0f64..1.0,
        log_depth in -6.0f64..6.0, before in 0.0f64..90.0,
    ) {
        check_weight(10f64.powf(log_a), [d, from, to, 10f64.powf(log_depth), before])?;
        check_weight(10f64.powf(log_a), [d, from, to, 10f64.powf(log_depth), 0.0])?;
    }
}
