//! From how many lights on the splats are faster than the marcher at equal error.
//!
//! The time of a frame is modelled as fixed + per light × lights, from the measured numbers of lights. The marcher's
//! cost at the splats' error comes by interpolating between its two nearest numbers of steps, linearly in ln(error).

/// Milliseconds of a frame: fixed + per light × lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Without lights.
    pub fixed: f64,
    /// Of each light.
    pub per_light: f64,
}

impl Cost {
    /// The least squares of relative errors over (lights, milliseconds), neither part negative; `None` for fewer than
    /// two numbers of lights.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let usable: Vec<(f64, f64)> = points.iter().copied().filter(|p| p.1 > 0.0).collect();
        let different = usable.iter().any(|p| p.0 != usable[0].0);
        if !different {
            return None;
        }
        // Σ ((a + b n)/t - 1)² with x = 1/t, y = n/t.
        let (mut xx, mut xy, mut yy, mut x, mut y) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (n, t) in &usable {
            let (p, q) = (1.0 / t, n / t);
            xx += p * p;
            xy += p * q;
            yy += q * q;
            x += p;
            y += q;
        }
        let determinant = xx * yy - xy * xy;
        let (a, b) = ((x * yy - y * xy) / determinant, (y * xx - x * xy) / determinant);
        let (fixed, per_light) = match (a >= 0.0, b >= 0.0) {
            (true, true) => (a, b),
            (false, _) => (0.0, y / yy),
            (true, false) => (x / xx, 0.0),
        };
        Some(Self { fixed, per_light })
    }

    /// Milliseconds with `lights` lights.
    pub fn at(&self, lights: f64) -> f64 {
        self.fixed + self.per_light * lights
    }
}

/// A rival's cost at one setting, and its error there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rival {
    /// Steps.
    pub steps: usize,
    /// Relative error.
    pub error: f64,
    /// Time.
    pub cost: Cost,
}

/// Who is faster, and from when on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The splats, from one light on.
    Always,
    /// The splats, from this number of lights on.
    From(f64),
    /// The splats, up to this number of lights.
    Until(f64),
    /// The marcher, for any number.
    Never,
    /// The marcher does not get below the splats' error with the steps that were measured.
    OutOfReach,
}

/// Compares splats of one error and cost with a marcher at the same error. Also returns the marcher's cost that was
/// compared with, and its steps (fractional between measured ones). Where even the fewest steps have less error
/// than the splats these steps are compared: the marcher is then better than asked for. `None` without a marcher.
pub fn crossover(error: f64, splats: Cost, marcher: &[Rival]) -> Option<(Verdict, Option<(f64, Cost)>)> {
    let mut steps: Vec<&Rival> = marcher.iter().filter(|r| r.error > 0.0).collect();
    steps.sort_unstable_by_key(|r| r.steps);
    // More steps only count when they helped.
    let mut useful: Vec<&Rival> = Vec::new();
    for r in steps {
        if useful.last().is_none_or(|last| r.error < last.error) {
            useful.push(r);
        }
    }
    let (first, last) = (*useful.first()?, *useful.last()?);
    if error < last.error {
        return Some((Verdict::OutOfReach, None));
    }
    let (at, cost) = if error >= first.error {
        (first.steps as f64, first.cost)
    } else {
        let next = useful.partition_point(|r| r.error > error);
        let (a, b) = (useful[next - 1], useful[next]);
        let part = (a.error / error).ln() / (a.error / b.error).ln();
        let mix = |x: f64, y: f64| x + (y - x) * part;
        let cost = Cost {
            fixed: mix(a.cost.fixed, b.cost.fixed),
            per_light: mix(a.cost.per_light, b.cost.per_light),
        };
        (mix(a.steps as f64, b.steps as f64), cost)
    };
    // Splats are faster where n · slope > rise.
    let (slope, rise) = (cost.per_light - splats.per_light, splats.fixed - cost.fixed);
    let verdict = match (slope > 0.0, rise < slope) {
        (true, true) => Verdict::Always,
        (true, false) => Verdict::From(rise / slope),
        (false, true) if slope < 0.0 => Verdict::Until(rise / slope),
        (false, true) => Verdict::Always,
        (false, false) => Verdict::Never,
    };
    Some((verdict, Some((at, cost))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(fixed: f64, per_light: f64) -> Cost {
        Cost { fixed, per_light }
    }

    #[test]
    fn exact_lines_are_found_and_parts_stay_positive() {
        let c = Cost::fit(&[(1.0, 12.0), (8.0, 26.0), (64.0, 138.0)]).unwrap();
        assert!((c.fixed - 10.0).abs() < 1e-9 && (c.per_light - 2.0).abs() < 1e-9);
        // Falling times: no negative price of a light. Steeper than proportional: no negative start.
        assert_eq!(Cost::fit(&[(1.0, 10.0), (8.0, 5.0)]).unwrap().per_light, 0.0);
        assert_eq!(Cost::fit(&[(1.0, 1.0), (8.0, 100.0)]).unwrap().fixed, 0.0);
        assert_eq!(Cost::fit(&[(8.0, 1.0), (8.0, 2.0)]), None);
        assert_eq!(Cost::fit(&[]), None);
    }

    #[test]
    fn verdicts_by_hand() {
        let marcher = [
            Rival { steps: 2, error: 0.08, cost: cost(5.0, 2.0) },
            Rival { steps: 8, error: 0.02, cost: cost(5.0, 8.0) },
            // No better than 8 steps: of no use.
            Rival { steps: 16, error: 0.03, cost: cost(5.0, 16.0) },
        ];
        // At 0.04, half way in ln(error): 5 steps, 5 ms and 5 ms a light. 35 + n = 5 + 5 n at n = 7.5.
        let (verdict, at) = crossover(0.04, cost(35.0, 1.0), &marcher).unwrap();
        let (steps, marched) = at.unwrap();
        assert!((steps - 5.0).abs() < 1e-9 && (marched.per_light - 5.0).abs() < 1e-9);
        let Verdict::From(n) = verdict else { panic!("{verdict:?}") };
        assert!((n - 7.5).abs() < 1e-9);
        assert!((cost(35.0, 1.0).at(n) - marched.at(n)).abs() < 1e-9);
        let verdict = |error: f64, c: Cost| crossover(error, c, &marcher).unwrap().0;
        assert_eq!(verdict(0.04, cost(6.0, 1.0)), Verdict::Always);
        assert_eq!(verdict(0.04, cost(6.0, 9.0)), Verdict::Never);
        assert_eq!(verdict(0.04, cost(1.0, 6.0)), Verdict::Until(4.0));
        assert_eq!(verdict(0.01, cost(6.0, 1.0)), Verdict::OutOfReach);
        // Coarser than the coarsest: compared with that.
        assert_eq!(crossover(0.5, cost(6.0, 1.0), &marcher).unwrap().1.unwrap().0, 2.0);
        assert_eq!(crossover(0.5, cost(6.0, 1.0), &[]), None);
    }
}
