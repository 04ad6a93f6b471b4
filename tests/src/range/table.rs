//! The table as text for people and as CSV for programs.

use crate::metrics::Metrics;
use std::fmt::Write;

/// One measured row.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The row's name.
    pub name: String,
    /// Whether its error counts.
    pub judged: bool,
    /// How far the picture is from the reference.
    pub metrics: Metrics,
    /// Mean number of kernels that a ray through the object meets.
    pub splats_per_ray: f64,
    /// Estimated relative error of the reference.
    pub reference_noise: f64,
    /// Seconds of the bake; rows with the same body share one.
    pub bake_seconds: f64,
    /// Stored samples.
    pub samples: u64,
    /// Size of the asset.
    pub asset_bytes: usize,
}

impl Line {
    /// Whether the row passes: it must be finite, and where it is judged its error must not be above `max_error`.
    pub fn passes(&self, max_error: Option<f64>) -> bool {
        let good = max_error.is_none_or(|e| !self.judged || self.metrics.rel_rmse <= e);
        good && self.metrics.non_finite == 0
    }

    /// Whether the reference is too noisy for the error that it is to measure.
    pub fn is_noisy(&self) -> bool {
        self.reference_noise > 0.2 * self.metrics.rel_rmse
    }
}

/// The table with a heading. A star marks rows that are not judged, `~` those with [`Line::is_noisy`].
pub fn text(lines: &[Line]) -> String {
    let width = lines.iter().map(|l| l.name.len()).max().unwrap_or(0).max(4);
    let mut out = format!(
        "{:<width$}    {:>8} {:>7} {:>8} {:>8} {:>10} {:>10} {:>8} {:>7}",
        "row", "rel_rmse", "psnr_db", "bias", "p99_rel", "non_finite", "splats/ray", "noise", "bake_s"
    );
    for l in lines {
        let m = &l.metrics;
        // Writing to a String cannot fail.
        let _ = write!(
            out,
            "\n{:<width$} {}{} {:>8.4} {:>7.2} {:>+8.4} {:>8.3} {:>10} {:>10.1} {:>8.4} {:>7.1}",
            l.name,
            if l.judged { ' ' } else { '*' },
            if l.is_noisy() { '~' } else { ' ' },
            m.rel_rmse,
            m.psnr_db,
            m.bias,
            m.p99_rel,
            m.non_finite,
            l.splats_per_ray,
            l.reference_noise,
            l.bake_seconds
        );
    }
    out
}

/// The table as CSV, one heading line.
pub fn csv(lines: &[Line]) -> String {
    let mut out =
        "name,rel_rmse,psnr_db,bias,p99_rel,non_finite,splats_per_ray,reference_noise,bake_seconds,\
                   samples,asset_bytes,judged\n"
            .to_owned();
    for l in lines {
        let m = &l.metrics;
        let _ = writeln!(
            out,
            "{},{:.6},{:.3},{:.6},{:.5},{},{:.2},{:.6},{:.2},{},{},{}",
            l.name,
            m.rel_rmse,
            m.psnr_db,
            m.bias,
            m.p99_rel,
            m.non_finite,
            l.splats_per_ray,
            l.reference_noise,
            l.bake_seconds,
            l.samples,
            l.asset_bytes,
            l.judged
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(name: &str, judged: bool, rel_rmse: f64, non_finite: usize) -> Line {
        let metrics = Metrics { rel_rmse, psnr_db: 30.0, bias: 0.01, p99_rel: 0.1, non_finite, pixels: 10 };
        Line {
            name: name.to_owned(),
            judged,
            metrics,
            splats_per_ray: 50.0,
            reference_noise: 0.01,
            bake_seconds: 1.0,
            samples: 100,
            asset_bytes: 1000,
        }
    }

    #[test]
    fn only_judged_errors_and_values_that_are_not_finite_fail() {
        assert!(line("a", true, 0.1, 0).passes(Some(0.1)));
        assert!(!line("a", true, 0.1, 0).passes(Some(0.09)));
        assert!(line("a", false, 0.1, 0).passes(Some(0.09)));
        assert!(!line("a", true, f64::NAN, 0).passes(Some(1.0)));
        assert!(line("a", true, 5.0, 0).passes(None));
        assert!(!line("a", false, 0.1, 1).passes(None));
    }

    #[test]
    fn columns_stand_under_their_names() {
        let lines = [line("a-long-name", false, 0.04, 0), line("b", true, 80.5, 0)];
        let text = text(&lines);
        let ends: Vec<usize> = text.lines().map(|l| l.len()).collect();
        assert_eq!(ends, [ends[0]; 3]);
        let at = text.find("rel_rmse").unwrap() + "rel_rmse".len();
        let rows: Vec<&str> = text.lines().skip(1).collect();
        assert!(rows[0][..at].ends_with(" *~   0.0400") && rows[1][..at].ends_with("    80.5000"), "{text}");
        assert_eq!(csv(&lines).lines().count(), 3);
    }
}
