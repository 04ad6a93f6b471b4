//! From how many lights on the splats are faster than another method at equal error.

use serde::Serialize;

/// Who is faster, and from when on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "verdict", content = "lights")]
pub enum Verdict {
    /// The splats, from so many lights on.
    From(f64),
    /// The other method, up to the largest number that was measured.
    NotUpTo(usize),
    /// The other method does not reach the splats' error.
    OutOfReach,
    /// Nothing was measured within the limit of time.
    Unmeasured,
}

impl Verdict {
    /// From (lights, the other's time over the splats'), in rising order; between two of them along a line in the logarithms.
    pub fn of(ratios: &[(usize, f64)]) -> Self {
        let Some(last) = ratios.iter().rposition(|(_, r)| *r < 1.0) else {
            return ratios.first().map_or(Self::Unmeasured, |(lights, _)| Self::From(*lights as f64));
        };
        let (n0, r0) = ratios[last];
        match ratios.get(last + 1) {
            None => Self::NotUpTo(n0),
            Some((n1, r1)) => {
                let share = -r0.ln() / (r1.ln() - r0.ln());
                Self::From((n0 as f64).powf(1.0 - share) * (*n1 as f64).powf(share))
            }
        }
    }

    /// In words.
    pub fn text(self) -> String {
        match self {
            // Exact at measured numbers, whatever the logarithms round.
            Self::From(n) => match (n - 1e-6).ceil() as usize {
                0 | 1 => "splats are faster from 1 light on".to_owned(),
                n => format!("splats are faster from {n} lights on"),
            },
            Self::NotUpTo(n) => format!("splats are slower up to {n} lights, the most that were measured"),
            Self::Unmeasured => "nothing could be measured within --limit".to_owned(),
            Self::OutOfReach => "does not reach the error of the splats".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_lie_between_what_was_measured() {
        let cases = [
            (&[(1, 2.0), (4, 8.0)][..], "faster from 1 light on"),
            (&[(1, 0.5), (4, 2.0)], "faster from 2 lights on"),
            (&[(1, 0.5), (4, 1.0)], "faster from 4 lights on"),
            (&[(1, 1.1), (2, 0.9), (4, 1.2), (8, 2.0)], "faster from 3 lights on"),
            (&[(1, 0.1), (64, 0.9)], "slower up to 64 lights"),
            (&[], "nothing could be measured"),
        ];
        for (ratios, says) in cases {
            let text = Verdict::of(ratios).text();
            assert!(text.contains(says), "{ratios:?}: {text}");
        }
    }
}
