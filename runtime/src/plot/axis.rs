//! Logarithmic axes: a range that holds all values, ticks at 1, 2, 5 of every decade, labels in the value's unit.

/// What an axis counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Milliseconds.
    Milliseconds,
    /// Seconds.
    Seconds,
    /// Bytes.
    Bytes,
    /// A fraction, shown in percent.
    Percent,
    /// Things.
    Count,
}

impl Unit {
    /// A value with its unit, short.
    pub fn label(self, value: f64) -> String {
        match self {
            Self::Milliseconds if value >= 1e3 => format!("{} s", plain(value / 1e3)),
            Self::Milliseconds => format!("{} ms", plain(value)),
            Self::Seconds => format!("{} s", plain(value)),
            Self::Bytes if value >= 1e6 => format!("{} MB", plain(value / 1e6)),
            Self::Bytes if value >= 1e3 => format!("{} kB", plain(value / 1e3)),
            Self::Bytes => format!("{} B", plain(value)),
            Self::Percent => format!("{} %", plain(100.0 * value)),
            Self::Count if value >= 1e6 => format!("{} M", plain(value / 1e6)),
            Self::Count if value >= 1e3 => format!("{} k", plain(value / 1e3)),
            Self::Count => plain(value),
        }
    }
}

/// A number with three digits at most and no trailing zeros.
fn plain(value: f64) -> String {
    let digits = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A logarithmic axis from `low` to `high`, on pixels `from` to `to`.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// An axis that holds all values above 0, with a margin; one decade around 1 where there are none.
    pub fn new(values: impl Iterator<Item = f64>, [from, to]: [f64; 2]) -> Self {
        let (low, high) = values
            .filter(|v| *v > 0.0 && v.is_finite())
            .fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (0.3, 3.0) };
        // At least half a decade, so that ticks exist.
        let margin = (0.08 * (high / low).log10()).max(0.25 - 0.5 * (high / low).log10()).max(0.04);
        let factor = 10f64.powf(margin);
        Self { low: low / factor, high: high * factor, from, to }
    }

    /// Where a value above 0 lies, pixels.
    pub fn at(&self, value: f64) -> f64 {
        self.from + (self.to - self.from) * (value / self.low).log10() / (self.high / self.low).log10()
    }

    /// Values to draw lines at, and whether to label them: fewer labels where there are many decades.
    pub fn ticks(&self) -> Vec<(f64, bool)> {
        let decades = (self.high / self.low).log10();
        let labelled: &[u32] = match decades {
            d if d < 1.6 => &[1, 2, 5],
            d if d < 2.6 => &[1, 3],
            _ => &[1],
        };
        let drawn: &[u32] = if decades < 1.6 { &[1, 2, 5] } else { &[1, 2, 3, 4, 5, 6, 7, 8, 9] };
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let mut ticks = Vec::new();
        for decade in first..=last {
            for m in drawn {
                let value = f64::from(*m) * 10f64.powi(decade);
                if value >= self.low && value <= self.high {
                    ticks.push((value, labelled.contains(m)));
                }
            }
        }
        ticks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_short() {
        let all = [
            Unit::Percent.label(0.05),
            Unit::Percent.label(0.002),
            Unit::Milliseconds.label(20.0),
            Unit::Milliseconds.label(2e4),
            Unit::Bytes.label(5e5),
            Unit::Bytes.label(1e6),
            Unit::Seconds.label(0.5),
        ];
        assert_eq!(all, ["5 %", "0.2 %", "20 ms", "20 s", "500 kB", "1 MB", "0.5 s"]);
    }

    #[test]
    fn an_axis_holds_its_values_and_has_ticks() {
        for values in [vec![0.01, 0.4], vec![7.0], vec![1e3, 1e9], vec![]] {
            let axis = Axis::new(values.iter().copied(), [10.0, 110.0]);
            for v in &values {
                assert!(axis.at(*v) > 10.0 && axis.at(*v) < 110.0, "{values:?}");
            }
            let labelled = axis.ticks().iter().filter(|t| t.1).count();
            assert!((1..=9).contains(&labelled), "{values:?}: {:?}", axis.ticks());
        }
        // Equal ratios are equal lengths.
        let axis = Axis::new([1.0, 100.0].into_iter(), [0.0, 300.0]);
        assert!((axis.at(10.0) - 150.0).abs() < 1e-9);
    }
}
