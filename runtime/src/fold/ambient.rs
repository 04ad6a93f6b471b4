//! The lights' side of folding: one vector for all of them.

use super::parallax;
use crate::frame::FrameLight;
use diaphane_formats::phase::henyey_greenstein_f32;
use diaphane_formats::sh;
use glam::Vec3;

/// F of [`super`], red, green and blue. A phase function that is not isotropic adds three vectors, the change of F along
/// each axis as the direction towards the camera deviates from that at the object's centre.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ambient {
    /// Bands² entries of F, then those of its three changes if there are any.
    pub values: Vec<[f32; 4]>,
    /// Number of coefficients.
    pub count: usize,
}

impl Ambient {
    /// Folds `lights`, all directional, for a phase function of mean cosine `g` and a camera at `origin`.
    pub fn new<'a>(lights: impl Iterator<Item = &'a FrameLight>, g: f32, origin: Vec3, bands: usize) -> Self {
        let count = bands * bands;
        let vectors = if g == 0.0 { 1 } else { 4 };
        let mut sums = vec![[0.0f64; 3]; vectors * count];
        let mut basis = vec![0.0; count];
        let towards_camera = origin.normalize_or_zero();
        for light in lights {
            let to = -light.direction;
            sh::evaluate(bands, to.as_dvec3().to_array(), &mut basis);
            let own = g.clamp(-light.most_cosine, light.most_cosine);
            let (phase, slope) = henyey_greenstein(own, -to, towards_camera);
            for v in 0..vectors {
                let factor = if v == 0 { phase } else { -slope * to[v - 1] };
                let colour = (light.colour * factor).as_dvec3().to_array();
                for (sum, y) in sums[v * count..(v + 1) * count].iter_mut().zip(&basis) {
                    (0..3).for_each(|c| sum[c] += colour[c] * y);
                }
            }
        }
        let values = sums.iter().map(|s| [s[0] as f32, s[1] as f32, s[2] as f32, 0.0]).collect();
        Self { values, count }
    }

    /// F at `place` for a camera at `origin`, coefficient `k`.
    pub fn at(&self, deviation: Vec3, k: usize) -> Vec3 {
        let vector = |v: usize| {
            let [r, g, b, _] = self.values[v * self.count + k];
            Vec3::new(r, g, b)
        };
        if self.values.len() == self.count {
            return vector(0);
        }
        vector(0) + vector(1) * deviation.x + vector(2) * deviation.y + vector(3) * deviation.z
    }

    /// How the direction towards the camera deviates at `place`; nothing where that makes no difference.
    pub fn deviation(&self, origin: Vec3, place: Vec3) -> Vec3 {
        if self.values.len() == self.count { Vec3::ZERO } else { parallax(origin, place) }
    }
}

/// Henyey-Greenstein's function and its derivative by the cosine, 1/sr.
fn henyey_greenstein(g: f32, travels: Vec3, towards: Vec3) -> (f32, f32) {
    let (value, base) = henyey_greenstein_f32(g, travels, towards);
    (value, 3.0 * g * value / base)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivative_is_that_of_the_function() {
        for g in [-0.5, 0.3, 0.8] {
            for cosine in [-0.9, 0.1, 0.7] {
                let at = |cosine: f32| {
                    let travels = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                    henyey_greenstein(g, travels, Vec3::Z)
                };
                let (_, slope) = at(cosine);
                let h = 1e-3;
                let (up, down) = (at(cosine + h).0, at(cosine - h).0);
                assert!((slope - (up - down) / (2.0 * h)).abs() < 2e-2 * slope.abs(), "{g} {cosine}");
            }
        }
        let (isotropic, slope) = henyey_greenstein(0.0, Vec3::X, Vec3::Y);
        assert!((isotropic - 0.25 * std::f32::consts::FRAC_1_PI).abs() < 1e-8 && slope == 0.0);
    }
}
