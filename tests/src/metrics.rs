//! How far a picture is from a reference, over the pixels that the mesh covers fully, all channels together.
//!
//! With I the picture and R the reference:
//!
//! | name | formula |
//! |---|---|
//! | `rel_rmse` | √(mean((I-R)²) / mean(R²)) |
//! | `psnr_db` | 10 log10(peak² / mean((I-R)²)), peak = 99.9th percentile of R |
//! | `bias` | mean(I)/mean(R) - 1 |
//! | `p99_rel` | 99th percentile of |I-R| / max(R, peak/100) |
//! | `non_finite` | NaN and infinite values of I anywhere; they count as 0 in the others |
//!
//! Percentiles interpolate linearly between order statistics (NumPy's default). Sums are in f64. Checked by the tests
//! below against values worked out by hand.

use diaphane_formats::picture::Picture;
use diaphane_formats::{Error, Result};
use serde::Serialize;

/// The figures of one comparison. Fractions, not percent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Root mean square error over the root mean square of the reference: the headline figure.
    pub rel_rmse: f64,
    /// Peak signal-to-noise ratio, dB; infinite (JSON: null) for equal pictures.
    pub psnr_db: f64,
    /// Relative difference of the means.
    pub bias: f64,
    /// 99th percentile of the relative error of single values.
    pub p99_rel: f64,
    /// NaN or infinite values in the whole picture.
    pub non_finite: usize,
    /// Number of pixels compared.
    pub pixels: usize,
}

/// Compares `image` with `reference` where `coverage` (0..1 per pixel) is 1.
///
/// # Errors
/// Sizes that differ, a reference that is not finite, no pixel that is covered fully.
pub fn compare(image: &Picture, reference: &Picture, coverage: &[f32]) -> Result<Metrics> {
    let size = |p: &Picture| format!("{} x {}", p.width, p.height);
    if (image.width, image.height) != (reference.width, reference.height) {
        return Err(Error::invalid(format!(
            "the pictures differ in size: {} and the reference's {}; render both with one scene",
            size(image),
            size(reference)
        )));
    }
    if coverage.len() != reference.pixels.len() {
        return Err(Error::invalid(format!(
            "the coverage has {} pixels but the reference is {}",
            coverage.len(),
            size(reference)
        )));
    }
    let non_finite = image.pixels.iter().flatten().filter(|v| !v.is_finite()).count();
    let (mut i, mut r) = (Vec::new(), Vec::new());
    let mut pixels = 0;
    for ((a, b), c) in image.pixels.iter().zip(&reference.pixels).zip(coverage) {
        if f64::from(*c) < 1.0 - 1e-9 {
            continue;
        }
        pixels += 1;
        i.extend(a.map(|v| if v.is_finite() { f64::from(v) } else { 0.0 }));
        r.extend(b.map(f64::from));
    }
    if r.iter().any(|v| !v.is_finite()) {
        return Err(Error::invalid(
            "the reference holds values that are not finite; it cannot be compared with",
        ));
    }
    if pixels == 0 {
        return Err(Error::invalid("no pixel is covered fully, so there is nothing to compare"));
    }
    let n = r.len() as f64;
    let mean_square_error = i.iter().zip(&r).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / n;
    let mean_square = r.iter().map(|b| b * b).sum::<f64>() / n;
    let (mean_i, mean_r) = (i.iter().sum::<f64>() / n, r.iter().sum::<f64>() / n);
    let peak = percentile(&mut r.clone(), 99.9);
    let mut relative: Vec<f64> =
        i.iter().zip(&r).map(|(a, b)| ratio((a - b).abs(), b.max(0.01 * peak))).collect();
    Ok(Metrics {
        rel_rmse: ratio(mean_square_error, mean_square).sqrt(),
        psnr_db: if mean_square_error > 0.0 {
            10.0 * (peak * peak / mean_square_error).log10()
        } else {
            f64::INFINITY
        },
        bias: ratio(mean_i - mean_r, mean_r),
        p99_rel: percentile(&mut relative, 99.0),
        non_finite,
        pixels,
    })
}

/// a / b, where an error of nothing in nothing is no error (a black picture of a scene without lights).
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// The `percent`th percentile of finite values by linear interpolation at rank percent/100 · (n - 1); 0 if empty.
pub fn percentile(values: &mut [f64], percent: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else {
        return 0.0;
    };
    let rank = percent / 100.0 * last as f64;
    let below = (rank.floor() as usize).min(last);
    let (_, low, above) = values.select_nth_unstable_by(below, f64::total_cmp);
    let low = *low;
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    low + (high - low) * (rank - below as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f32]) -> Picture {
        Picture {
            width: values.len(),
            height: 1,
            pixels: values.iter().map(|v| [*v; 3]).collect(),
            coverage: None,
        }
    }

    #[test]
    fn figures_by_hand() {
        // R = 1, 2, 3, 4 and I = R + 0.1, -0.2, 0.3, 0: mean((I-R)²) = (0.01+0.04+0.09+0)/4 = 0.035 and
        // mean(R²) = 30/4 = 7.5. Channels repeat each value three times, so the sorted R are twelve values and the
        // 99.9th percentile has rank 10.989 between two 4s.
        let reference = grey(&[1.0, 2.0, 3.0, 4.0]);
        let image = grey(&[1.1, 1.8, 3.3, 4.0]);
        let m = compare(&image, &reference, &[1.0; 4]).unwrap();
        assert!((m.rel_rmse - (0.035f64 / 7.5).sqrt()).abs() < 1e-6);
        assert!((m.psnr_db - 10.0 * (16.0f64 / 0.035).log10()).abs() < 1e-4);
        assert!((m.bias - 0.2 / 10.0).abs() < 1e-6);
        // Relative errors 0.1, 0.1, 0.1, 0: rank 10.89 lies between two values of 0.1.
        assert!((m.p99_rel - 0.1).abs() < 1e-6);
        assert_eq!((m.non_finite, m.pixels), (0, 4));
    }

    #[test]
    fn only_full_coverage_counts() {
        let m = compare(&grey(&[1.0, 9.0, 1.0]), &grey(&[1.0, 1.0, 2.0]), &[1.0, 0.99, 1.0]).unwrap();
        assert_eq!(m.pixels, 2);
        assert!((m.rel_rmse - (0.5f64 / 2.5).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn non_finite_values_count_everywhere_and_are_black() {
        let m = compare(&grey(&[f32::NAN, f32::INFINITY, 1.0]), &grey(&[0.0, 3.0, 1.0]), &[0.0, 1.0, 1.0])
            .unwrap();
        assert_eq!(m.non_finite, 6);
        assert!((m.rel_rmse - (4.5f64 / 5.0).sqrt()).abs() < 1e-12);
        assert!((m.bias - (0.5 / 2.0 - 1.0)).abs() < 1e-12);
    }

    #[test]
    fn equal_and_black_pictures() {
        let m = compare(&grey(&[1.0, 2.0]), &grey(&[1.0, 2.0]), &[1.0; 2]).unwrap();
        assert_eq!((m.rel_rmse, m.bias, m.p99_rel), (0.0, 0.0, 0.0));
        assert!(m.psnr_db.is_infinite());
        let m = compare(&grey(&[0.0]), &grey(&[0.0]), &[1.0]).unwrap();
        assert_eq!((m.rel_rmse, m.bias, m.p99_rel), (0.0, 0.0, 0.0));
        assert!(compare(&grey(&[0.5]), &grey(&[0.0]), &[1.0]).unwrap().rel_rmse.is_infinite());
    }

    #[test]
    fn misfits_are_refused() {
        let one = grey(&[1.0]);
        assert!(
            compare(&one, &grey(&[1.0, 2.0]), &[1.0; 2]).unwrap_err().to_string().contains("differ in size")
        );
        assert!(compare(&one, &one, &[]).unwrap_err().to_string().contains("coverage"));
        assert!(compare(&one, &one, &[0.5]).unwrap_err().to_string().contains("nothing to compare"));
        assert!(compare(&one, &grey(&[f32::NAN]), &[1.0]).unwrap_err().to_string().contains("not finite"));
    }

    #[test]
    fn percentiles_interpolate() {
        let mut v = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(percentile(&mut v, 0.0), 1.0);
        assert_eq!(percentile(&mut v, 100.0), 4.0);
        // Rank 1.5 of 1, 2, 3, 4.
        assert_eq!(percentile(&mut v, 50.0), 2.5);
        // Rank 0.3 of 1, 2.
        assert!((percentile(&mut [2.0, 1.0], 30.0) - 1.3).abs() < 1e-12);
        assert_eq!(percentile(&mut [], 50.0), 0.0);
    }
}
