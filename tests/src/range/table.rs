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
        "{:<width$}   {:>8} {:>7} {:>8} {:>8} {:>10} {:>10} {:>8} {:>7}",
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
