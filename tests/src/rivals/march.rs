//! Marching: a few steps along each camera ray, the light of each from somewhere else.
//!
//!   L = Ω Σ_steps A_step Σ_l p(cos_l) E_l(x) ψ(x, ω_l),   A_step = ∫_step e^{-τ} κ σ/ρ dt
//!
//! Steps are spaced exponentially ([`super::track`]): each emits the same towards the eye. The point that stands for
//! a step divides its emission in a ratio that differs from sub-pixel ray to sub-pixel ray (stratified), which beats the
//! middle for all rays. Fitted to the player's rules: the phase function, the clamp of a light's distance and the
//! lights themselves are the frame's.

use super::object::Object;
use super::rays::{CameraRay, draw};
use super::track::{Mark, Track};
use diaphane_formats::picture::Picture;
use diaphane_runtime::frame::Frame;
use glam::Vec3;

/// Where the light of a step comes from.
pub trait Light: Sync {
    /// What is looked up once for a place.
    type Memory: Default;
    /// Prepares a place (relative to the object's centre) for any number of lights.
    fn enter(&self, place: Vec3, memory: &mut Self::Memory);
    /// ψ β from the place that was entered, along the unit vector `towards`, up to `distance`; per channel, 0..1.
    fn arriving(&self, place: Vec3, towards: Vec3, distance: f32, memory: &mut Self::Memory) -> Vec3;
}

/// A march through one object.
pub struct March<'a, L> {
    /// Through what.
    pub object: &'a Object<'a>,
    /// Steps of each ray, at least 1.
    pub steps: usize,
    /// Where light comes from.
    pub light: &'a L,
}

impl<L: Light> March<'_, L> {
    /// Draws a frame.
    pub fn draw(&self, frame: &Frame) -> Picture {
        let open = |_| (Track::default(), L::Memory::default());
        draw(self.object, frame, open, |ray, (track, memory)| self.radiance(frame, ray, track, memory))
    }

    fn radiance(
        &self,
        frame: &Frame,
        ray: &CameraRay<'_>,
        track: &mut Track,
        memory: &mut L::Memory,
    ) -> Vec3 {
        let kappa = self.object.medium.extinction().as_vec3();
        let grey = self.object.medium.reference_extinction() as f32;
        track.follow(self.object, ray, grey);
        if track.is_dark() {
            return Vec3::ZERO;
        }
        let ratio = stratum(ray.place);
        let mut sum = Vec3::ZERO;
        let mut from = track.mark(0.0, grey, 0);
        for step in 0..self.steps {
            let u = |x: f32| (step as f32 + x) / self.steps as f32;
            let at: Mark = track.mark(u(ratio), grey, Track::cell(from));
            let to =
                if step + 1 == self.steps { track.end() } else { track.mark(u(1.0), grey, Track::cell(at)) };
            let place = ray.origin + ray.direction * at.t;
            sum += track.emission(from, to, kappa) * self.incoming(frame, place, ray.direction, memory);
            from = to;
        }
        sum * self.object.medium.albedo().as_vec3()
    }

    /// Σ p E ψ over the lights.
    fn incoming(&self, frame: &Frame, place: Vec3, view: Vec3, memory: &mut L::Memory) -> Vec3 {
        self.light.enter(place, memory);
        let mut sum = Vec3::ZERO;
        for light in &frame.lights {
            let (to, distance, irradiance) = light.at(place, frame.least_distance);
            if irradiance != Vec3::ZERO {
                // The camera lies along -view, light travels along -to.
                let phase = self.object.medium.phase().value(f64::from(to.dot(view))) as f32;
                sum += irradiance * phase * self.light.arriving(place, to, distance, memory);
            }
        }
        sum
    }
}

/// In which ratio a sub-pixel ray's points divide their steps: strata in an order that scatters neighbours.
fn stratum([k, count]: [usize; 2]) -> f32 {
    // A stride near the golden section that shares no factor with the count visits every stratum once.
    let coprime = |s: &usize| (2..=*s).all(|d| !s.is_multiple_of(d) || !count.is_multiple_of(d));
    let stride = ((count as f32 * 0.618) as usize..=count).find(|s| *s > 0 && coprime(s)).unwrap_or(1);
    ((k * stride % count) as f32 + 0.5) / count as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stratum_is_used_once() {
        for count in 1..40 {
            let mut seen: Vec<f32> = (0..count).map(|k| stratum([k, count])).collect();
            seen.sort_unstable_by(f32::total_cmp);
            for (i, s) in seen.iter().enumerate() {
                assert!((s - (i as f32 + 0.5) / count as f32).abs() < 1e-6, "{count}: {seen:?}");
            }
        }
    }
}
