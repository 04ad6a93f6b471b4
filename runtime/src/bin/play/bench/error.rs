//! The relative error of pictures against their truth: √(Σ (I - R)² / Σ R²) over the pixels that both cover fully, all views
//! together. The same as `rel_rmse` of the validation where there is one view.

use diaphane_formats::picture::Picture;

/// Sums over pictures.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pooled {
    difference: f64,
    power: f64,
}

impl Pooled {
    /// Of some pictures and their truths.
    pub fn of<'a>(pictures: impl Iterator<Item = (&'a Picture, &'a Picture)>) -> f64 {
        let mut sum = Self::default();
        pictures.for_each(|(picture, truth)| sum.add(picture, truth));
        sum.relative()
    }

    fn add(&mut self, picture: &Picture, truth: &Picture) {
        let covered = |p: &Picture, i: usize| p.coverage.as_ref().is_none_or(|c| c[i] > 0.999);
        for (i, (a, b)) in picture.pixels.iter().zip(&truth.pixels).enumerate() {
            if covered(picture, i) && covered(truth, i) {
                for (a, b) in a.iter().zip(b) {
                    self.difference += (f64::from(*a) - f64::from(*b)).powi(2);
                    self.power += f64::from(*b).powi(2);
                }
            }
        }
    }

    /// 0 where nothing is lit, and rightly so.
    fn relative(self) -> f64 {
        if self.difference == 0.0 { 0.0 } else { (self.difference / self.power).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_pooled_and_borders_left_out() {
        let picture = |values: [f32; 3], coverage: [f32; 3]| Picture {
            width: 3,
            height: 1,
            pixels: values.map(|v| [v; 3]).to_vec(),
            coverage: Some(coverage.to_vec()),
        };
        let truth = picture([3.0, 4.0, 9.0], [1.0, 1.0, 0.5]);
        let a = picture([3.0, 5.0, 0.0], [1.0; 3]);
        let b = picture([2.0, 4.0, 0.0], [1.0, 1.0, 1.0]);
        // Differences 1 and 1; powers 25 and 25.
        assert!((Pooled::of([(&a, &truth), (&b, &truth)].into_iter()) - 0.2).abs() < 1e-12);
        let black = picture([0.0; 3], [1.0; 3]);
        assert_eq!(Pooled::of([(&black, &black)].into_iter()), 0.0);
    }
}
