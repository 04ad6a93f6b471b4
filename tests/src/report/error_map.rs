//! Where a picture is too bright (red) or too dark (blue), with a colour bar.
//!
//! A pixel shows the mean over channels of I - R over the root mean square of R on the covered pixels, so that its
//! scale is that of `rel_rmse`. The bar ends at the smallest of 1, 2, 5, 10 ... % that holds 99 % of the pixels;
//! values beyond take the end's colour.

use super::font;
use crate::metrics::percentile;
use diaphane_formats::picture::Picture;

/// An encoded picture: 3 bytes a pixel.
pub struct ErrorMap {
    /// Columns, with the bar.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// sRGB bytes.
    pub rgb: Vec<u8>,
    /// Relative error at the ends of the bar.
    pub scale: f64,
}

/// Smallest height of the map: small pictures are enlarged by whole factors.
const LEAST_HEIGHT: usize = 320;

/// Side of a dot of the labels.
const DOT: usize = 2;

const BACKGROUND: [u8; 3] = [40, 40, 40];
const INK: [u8; 3] = [230, 230, 230];

impl ErrorMap {
    /// The map of two pictures of the same size; outside the reference's coverage it is grey.
    pub fn new(image: &Picture, reference: &Picture) -> Self {
        let covered = |i: usize| match &reference.coverage {
            Some(c) => c[i] >= 1.0,
            None => reference.pixels[i].iter().any(|v| *v > 0.0),
        };
        let inside: Vec<usize> = (0..reference.pixels.len()).filter(|&i| covered(i)).collect();
        let mean = |p: [f32; 3]| p.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
        let square: f64 =
            inside.iter().flat_map(|&i| reference.pixels[i]).map(|v| f64::from(v).powi(2)).sum();
        let rms = (square / (3 * inside.len().max(1)) as f64).sqrt().max(f64::MIN_POSITIVE);
        let error = |i: usize| (mean(image.pixels[i]) - mean(reference.pixels[i])) / rms;
        let mut sizes: Vec<f64> = inside.iter().map(|&i| error(i).abs()).filter(|e| e.is_finite()).collect();
        let scale = nice_above(percentile(&mut sizes, 99.0));
        let zoom = LEAST_HEIGHT.div_ceil(reference.height).max(1);
        let label_width = 7 * (font::SIZE[0] + 1) * DOT;
        let (left, bar) = (reference.width * zoom, 16);
        let mut map = Self {
            width: left + 10 + bar + 6 + label_width,
            height: reference.height * zoom,
            rgb: Vec::new(),
            scale,
        };
        map.rgb = BACKGROUND.repeat(map.width * map.height);
        for y in 0..map.height {
            for x in 0..left {
                let i = y / zoom * reference.width + x / zoom;
                if covered(i) {
                    map.set(x, y, colour(error(i) / scale));
                }
            }
        }
        map.draw_bar(left + 10, bar);
        map
    }

    fn set(&mut self, x: usize, y: usize, rgb: [u8; 3]) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.rgb[at..at + 3].copy_from_slice(&rgb);
        }
    }

    /// The bar from + scale on top to - scale at the bottom, with five numbers in percent.
    fn draw_bar(&mut self, left: usize, width: usize) {
        let margin = font::SIZE[1] * DOT;
        let span = self.height.saturating_sub(2 * margin + 1).max(1);
        for y in 0..=span {
            let value = 1.0 - 2.0 * y as f64 / span as f64;
            for x in 0..width {
                self.set(left + x, margin + y, colour(value));
            }
        }
        for k in 0..=4 {
            let value = 1.0 - 0.5 * f64::from(k);
            let y = margin + span * k as usize / 4;
            (0..4).for_each(|x| self.set(left + width + x, y, INK));
            let top = y.saturating_sub(font::SIZE[1] * DOT / 2);
            font::dots(&label(100.0 * value * self.scale), |dx, dy| {
                for (i, j) in (0..DOT * DOT).map(|k| (k % DOT, k / DOT)) {
                    self.set(left + width + 6 + dx * DOT + i, top + dy * DOT + j, INK);
                }
            });
        }
    }
}

/// "+2.5%", "0%", "-10%".
fn label(percent: f64) -> String {
    if percent == 0.0 {
        return "0%".to_owned();
    }
    if percent.fract() == 0.0 { format!("{percent:+.0}%") } else { format!("{percent:+}%") }
}

/// The smallest of ..., 0.01, 0.02, 0.05, 0.1, ... that is not below `x`, from 0.001 to 1000.
fn nice_above(x: f64) -> f64 {
    let steps = (-3..=3).flat_map(|e| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(e)));
    steps.into_iter().find(|s| *s >= x * (1.0 - 1e-9)).unwrap_or(1000.0)
}

/// Blue through white to red for -1..1; magenta for a value that is no number.
fn colour(value: f64) -> [u8; 3] {
    if value.is_nan() {
        return [255, 0, 255];
    }
    const STOPS: [[f64; 3]; 5] = [
        [8.0, 48.0, 130.0],
        [80.0, 150.0, 215.0],
        [248.0, 248.0, 248.0],
        [235.0, 120.0, 80.0],
        [130.0, 8.0, 24.0],
    ];
    let at = (value.clamp(-1.0, 1.0) + 1.0) * 2.0;
    let k = (at as usize).min(3);
    std::array::from_fn(|c| (STOPS[k][c] + (STOPS[k + 1][c] - STOPS[k][c]) * (at - k as f64)).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_and_labels() {
        assert_eq!(nice_above(0.013), 0.02);
        assert_eq!(nice_above(0.05), 0.05);
        assert_eq!(nice_above(0.0), 0.001);
        assert_eq!(nice_above(1e9), 1000.0);
        assert_eq!([label(5.0), label(-2.5), label(0.0)], ["+5%", "-2.5%", "0%"]);
    }

    #[test]
    fn bright_is_red_and_dark_is_blue() {
        let mut reference = Picture::new(3, 1);
        reference.pixels.fill([1.0; 3]);
        reference.coverage = Some(vec![1.0; 3]);
        let mut image = reference.clone();
        image.pixels[0] = [2.0; 3];
        image.pixels[2] = [0.0; 3];
        let map = ErrorMap::new(&image, &reference);
        let at = |x: usize| &map.rgb[3 * x..3 * x + 3];
        let zoom = LEAST_HEIGHT;
        assert!(at(zoom / 2)[0] > at(zoom / 2)[2]);
        assert_eq!(at(zoom * 3 / 2), [248; 3]);
        assert!(at(zoom * 5 / 2)[0] < at(zoom * 5 / 2)[2]);
        assert_eq!(map.rgb.len(), 3 * map.width * map.height);
        assert_eq!(map.scale, 1.0);
    }
}
