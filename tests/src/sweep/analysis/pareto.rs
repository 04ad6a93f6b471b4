//! Pareto fronts of two quantities that should both be small.

/// For every point (cost, error) whether no other is at least as good in both and better in one. Points that are not
/// finite are never on the front; equal points are all on it.
pub fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let good = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    points.iter().map(|p| good(p) && !points.iter().any(|q| good(q) && beats(q, p))).collect()
}

#[cfg(test)]
mod tests {
    use super::front;

    #[test]
    fn a_set_by_hand() {
        // Dominated: (2, 5) by (1, 4); (3, 2) by (3, 1); NaN by nature. (1, 4) appears twice and stays twice.
        let points = [
            (1.0, 4.0),
            (2.0, 5.0),
            (2.0, 3.0),
            (3.0, 2.0),
            (3.0, 1.0),
            (1.0, 4.0),
            (f64::NAN, 0.0),
            (9.0, 0.5),
        ];
        assert_eq!(front(&points), [true, false, true, false, true, true, false, true]);
        assert!(front(&[]).is_empty());
    }
}
