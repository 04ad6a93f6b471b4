//! Real roots of small polynomials: between neighbouring roots of its derivative a polynomial is monotone, so each
//! change of sign holds exactly one root, found by bisection. Roots of even order may be missed: a ray that only
//! touches a surface does not cross it.

/// Appends the real roots of Σ c[k] tᵏ (degree up to 4, leading coefficient not 0) in rising order.
pub fn roots(c: &[f64], out: &mut Vec<f64>) {
    let mut found = [0.0; 4];
    let n = isolate(c, &mut found);
    out.extend(&found[..n]);
}

fn isolate(c: &[f64], out: &mut [f64; 4]) -> usize {
    let degree = c.len() - 1;
    if degree == 1 {
        out[0] = -c[0] / c[1];
        return usize::from(out[0].is_finite());
    }
    let mut derivative = [0.0; 4];
    for k in 1..=degree {
        derivative[k - 1] = k as f64 * c[k];
    }
    let mut turning = [0.0; 4];
    let turns = isolate(&derivative[..degree], &mut turning);
    // Cauchy's bound on the size of any root.
    let bound = 1.0 + c[..degree].iter().fold(0.0, |m: f64, v| m.max(v.abs())) / c[degree].abs();
    let value = |t: f64| c.iter().rev().fold(0.0, |sum, v| sum * t + v);
    let mut n = 0;
    let mut low = -bound;
    for high in turning[..turns].iter().copied().chain([bound]) {
        let sign = value(low) < 0.0;
        if sign != (value(high) < 0.0) && n < 4 {
            out[n] = bisect(low, high, |t| (value(t) < 0.0) == sign);
            n += 1;
        }
        low = high;
    }
    n
}

fn bisect(mut low: f64, mut high: f64, stays: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if stays(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::roots;

    #[test]
    fn known_roots() {
        // (t-1)(t-2)(t+3)(t-0.5) = t⁴ - 0.5 t³ - 7 t² + 9.5 t - 3
        let mut out = Vec::new();
        roots(&[-3.0, 9.5, -7.0, -0.5, 1.0], &mut out);
        for (got, want) in out.iter().zip([-3.0, 0.5, 1.0, 2.0]) {
            assert!((got - want).abs() < 1e-9, "{out:?}");
        }
        assert_eq!(out.len(), 4);
        out.clear();
        roots(&[1.0, 0.0, 1.0], &mut out);
        assert!(out.is_empty());
        roots(&[-2.0, 0.0, 1.0], &mut out);
        assert!((out[1] - 2f64.sqrt()).abs() < 1e-12);
    }
}
