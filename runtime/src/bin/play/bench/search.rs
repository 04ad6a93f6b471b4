//! The fewest steps with which an error is small enough, and times of cells that were not measured yet.

/// The least n in 1..=most for which `error_at` is not above `target`, by doubling and bisection, with its error; `None` where
/// there is none, or where the search reaches an n that is too expensive (`None`).
pub fn fewest<E>(
    target: f64,
    most: u32,
    mut error_at: impl FnMut(u32) -> Result<Option<f64>, E>,
) -> Result<Option<(u32, f64)>, E> {
    let mut high = 1;
    let mut found = loop {
        match error_at(high)? {
            Some(error) if error <= target => break (high, error),
            Some(_) if high < most => high = (2 * high).min(most),
            _ => return Ok(None),
        }
    };
    let mut low = high / 2;
    while found.0 - low > 1 {
        let middle = low + (found.0 - low) / 2;
        match error_at(middle)? {
            Some(error) if error <= target => found = (middle, error),
            _ => low = middle,
        }
    }
    Ok(Some(found))
}

/// Milliseconds with so many lights, by the last of the (lights, milliseconds) that were measured: along the line through the
/// last two, or in proportion to one. 0 without any.
pub fn extrapolated(measured: &[(usize, f64)], lights: usize) -> f64 {
    let times = |n: usize, m: usize| n as f64 / m.max(1) as f64;
    match measured {
        [] => 0.0,
        [(n, ms)] => ms * times(lights, *n),
        [.., (n0, ms0), (n1, ms1)] => {
            let slope = ((ms1 - ms0) / (*n1 as f64 - *n0 as f64)).max(0.0);
            ms1 + slope * (lights as f64 - *n1 as f64)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fewest_are_found() {
        for wanted in 1..=40u32 {
            let found = fewest::<()>(1.0 / f64::from(wanted), 64, |n| Ok(Some(1.0 / f64::from(n)))).unwrap();
            assert_eq!(found, Some((wanted, 1.0 / f64::from(wanted))));
        }
        assert_eq!(fewest::<()>(0.01, 64, |n| Ok(Some(1.0 / f64::from(n)))), Ok(None));
        assert_eq!(fewest::<()>(0.1, 64, |n| Ok((n < 8).then_some(1.0 / f64::from(n)))), Ok(None));
        assert_eq!(fewest(0.1, 64, |_| Err(3)), Err(3));
    }

    #[test]
    fn times_follow_the_lights() {
        assert_eq!(extrapolated(&[], 7), 0.0);
        assert_eq!(extrapolated(&[(2, 3.0)], 8), 12.0);
        assert_eq!(extrapolated(&[(1, 90.0), (2, 10.0), (4, 14.0)], 8), 22.0);
        assert_eq!(extrapolated(&[(2, 10.0), (4, 9.0)], 8), 9.0);
    }
}
