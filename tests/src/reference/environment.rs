//! Directions towards an environment, drawn in proportion to each pixel's brightness times its solid angle.

use diaphane_formats::scene::Environment;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A latitude-longitude picture ready to be sampled. Pixels are constant over their area.
pub struct Sky {
    width: usize,
    height: usize,
    radiance: Vec<DVec3>,
    /// Running sums of the rows' weights, and of the pixels' within each row, both from 0 to 1.
    rows: Vec<f64>,
    columns: Vec<f64>,
}

/// One sampled direction.
pub struct SkySample {
    /// Unit vector towards the sky.
    pub direction: DVec3,
    /// Radiance over the probability density of the direction, per channel.
    pub irradiance: DVec3,
}

impl Sky {
    /// `None` for an environment that is black.
    pub fn new(environment: &Environment) -> Option<Self> {
        let (width, height) = (environment.picture.width, environment.picture.height);
        let pixels = &environment.picture.pixels;
        let radiance: Vec<DVec3> =
            pixels.iter().map(|p| DVec3::from_array(p.map(f64::from)) * environment.scale).collect();
        let (mut rows, mut columns) = (vec![0.0], Vec::with_capacity((width + 1) * height));
        for (j, row) in radiance.chunks(width).enumerate() {
            let mut sum = 0.0;
            columns.push(0.0);
            for value in row {
                sum += value.element_sum();
                columns.push(sum);
            }
            if sum > 0.0 {
                let start = columns.len() - width;
                columns[start..].iter_mut().for_each(|c| *c /= sum);
            }
            let edge = |j: usize| (PI * j as f64 / height as f64).cos();
            rows.push(rows[j] + sum * (edge(j) - edge(j + 1)));
        }
        let total = rows[height];
        (total > 0.0).then(|| {
            rows.iter_mut().for_each(|r| *r /= total);
            Self { width, height, radiance, rows, columns }
        })
    }

    /// The direction of two numbers within 0..1.
    pub fn sample(&self, [a, b]: [f64; 2]) -> SkySample {
        let (j, v, p_row) = pick(&self.rows, a);
        let row = &self.columns[j * (self.width + 1)..(j + 1) * (self.width + 1)];
        let (i, u, p_column) = pick(row, b);
        // Uniform over the pixel's solid angle: the height is uniform between the row's edges.
        let edge = |j: usize| (PI * j as f64 / self.height as f64).cos();
        let y = edge(j) + (edge(j + 1) - edge(j)) * v;
        let phi = TAU * ((i as f64 + u) / self.width as f64 - 0.5);
        let r = (1.0 - y * y).max(0.0).sqrt();
        let solid_angle = TAU / self.width as f64 * (edge(j) - edge(j + 1));
        SkySample {
            direction: DVec3::new(r * phi.sin(), y, -r * phi.cos()),
            irradiance: self.radiance[j * self.width + i] * (solid_angle / (p_row * p_column)),
        }
    }
}

/// The interval of the rising sums that holds `x`, the position in it (0..1) and its probability.
fn pick(sums: &[f64], x: f64) -> (usize, f64, f64) {
    let last = sums.len() - 2;
    let mut k = sums.partition_point(|s| *s <= x).saturating_sub(1).min(last);
    // Rounding may end the search on an interval of no weight.
    while sums[k + 1] <= sums[k] && k > 0 {
        k -= 1;
    }
    let p = sums[k + 1] - sums[k];
    (k, ((x - sums[k]) / p).clamp(0.0, 1.0), p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use diaphane_formats::picture::Picture;

    fn sky(paint: impl Fn(usize, usize) -> f32) -> Sky {
        let mut picture = Picture::new(16, 8);
        for j in 0..8 {
            for i in 0..16 {
                picture.pixels[j * 16 + i] = [paint(i, j); 3];
            }
        }
        Sky::new(&Environment { picture, scale: 2.0 }).unwrap()
    }

    fn mean(sky: &Sky, f: impl Fn(&SkySample) -> f64) -> f64 {
        let n = 256;
        let at = |i: usize| (i as f64 + 0.5) / n as f64;
        let all = (0..n * n).map(|k| f(&sky.sample([at(k / n), at(k % n)])));
        all.sum::<f64>() / (n * n) as f64
    }

    #[test]
    fn a_constant_sky_integrates_to_four_pi() {
        let sky = sky(|_, _| 1.0);
        assert!((mean(&sky, |s| s.irradiance.x) / (2.0 * 4.0 * PI) - 1.0).abs() < 1e-9);
        assert!(
            (mean(&sky, |s| s.irradiance.x * s.direction.z.powi(2)) / (8.0 * PI / 3.0) - 1.0).abs() < 1e-3
        );
    }

    #[test]
    fn pixels_lie_where_the_convention_says() {
        // u = 0.5 + atan2(x,-z)/2π and v = acos(y)/π: columns 11 and 12 meet at u = 0.75, which is +x; row 0 is up.
        let east = sky(|i, j| f32::from((i == 11 || i == 12) && (j == 3 || j == 4)));
        assert!(mean(&east, |s| s.direction.x) > 0.93);
        let up = sky(|_, j| f32::from(j == 0));
        assert!(mean(&up, |s| s.direction.y) > 0.93);
        let ahead = sky(|i, j| f32::from((i == 7 || i == 8) && (j == 3 || j == 4)));
        assert!(mean(&ahead, |s| -s.direction.z) > 0.93);
    }

    #[test]
    fn black_skies_are_none() {
        assert!(Sky::new(&Environment { picture: Picture::new(4, 2), scale: 1.0 }).is_none());
    }
}
