//! Many directional lights at the cost of one: which lights are evaluated one by one, which go into one vector of
//! spherical harmonics, and which reach nothing.
//!
//! Light from far away arrives at a sample as ∫ψβ(ω) E(ω) p dω. Where the transmittance ψβ is itself expanded,
//! ψβ = Σ_k t_k Y_k ([`linear`]), this is Σ_k t_k F_k with F_k = Σ_l E_l p Y_k(ω_l) over the lights ([`ambient`]), whatever
//! their number. What the baked coefficients represent is not linear in them, so t is a copy made when a frame first
//! asks for it; its error is reported. An environment always goes that way, a scene's own directional lights where there
//! are more than [`MOST_SINGLE`].

pub mod ambient;
pub mod linear;

pub use ambient::Ambient;
pub use linear::Linear;

use crate::exact::ExactDepths;
use crate::frame::{Frame, FrameLight, LightKind};
use diaphane_formats::asset::Info;
use glam::Vec3;
use serde::Serialize;

/// Directional lights that are evaluated one by one at most.
pub const MOST_SINGLE: usize = 32;

/// Light that may be left out, as a part of all light at the object.
const NEGLIGIBLE: f32 = 1e-6;

/// Largest deviation of the direction towards the camera, over (1 - |g|)², for which a phase function is folded.
const MOST_PARALLAX: f32 = 0.25;

/// What becomes of a frame's lights: indices into [`Frame::lights`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// Evaluated at every sample.
    pub single: Vec<usize>,
    /// Part of the ambient vector.
    pub folded: Vec<usize>,
    /// Too dim, too far or turned away.
    pub dark: usize,
}

/// What the samples' values depend on beside the material: where nothing of it changes they are not computed again.
#[derive(Clone, Debug, PartialEq)]
pub struct LightingKey {
    lights: Vec<FrameLight>,
    scene_lights: usize,
    exact: Vec<bool>,
    least_distance: f32,
    /// Where the camera makes a difference.
    origin: Option<Vec3>,
}

impl LightingKey {
    /// Of a frame of an asset.
    pub fn new(frame: &Frame, info: &Info, exact: Option<&ExactDepths>) -> Self {
        let is_exact = |i: usize| exact.and_then(|e| e.light(i)).is_some();
        Self {
            lights: frame.lights.clone(),
            scene_lights: frame.scene_lights,
            exact: (0..frame.lights.len()).map(is_exact).collect(),
            least_distance: frame.least_distance,
            origin: (info.phase.mean_cosine() != 0.0).then_some(frame.view.origin),
        }
    }
}

/// Numbers of a [`Plan`], for reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LightCounts {
    /// Lights evaluated at every sample.
    pub single: usize,
    /// Lights in one vector.
    pub folded: usize,
    /// Lights that reach nothing, left out.
    pub dark: usize,
    /// Error of the transmittance that folded lights see, root mean square over samples and directions; 0 where none is
    /// folded.
    pub fold_error: f32,
}

impl Plan {
    /// For a frame of an asset, some of whose lights have exact depths.
    pub fn new(frame: &Frame, info: &Info, exact: Option<&ExactDepths>) -> Self {
        let is_exact = |i: usize| exact.and_then(|e| e.light(i)).is_some();
        let far = |i: &usize| frame.lights[*i].kind == LightKind::Directional && !is_exact(*i);
        let (lit, dark) = reaching(frame, 0.5 * info.diagonal());
        let candidates = lit.iter().copied().filter(far);
        let folded: Vec<usize> = if !may_fold(frame, info) {
            Vec::new()
        } else if lit.iter().filter(|i| **i < frame.scene_lights && far(i)).count() > MOST_SINGLE {
            candidates.collect()
        } else {
            candidates.filter(|i| *i >= frame.scene_lights).collect()
        };
        let single = lit.into_iter().filter(|i| folded.binary_search(i).is_err()).collect();
        Self { single, folded, dark }
    }

    /// What is reported, with the error of what is folded.
    pub fn counts(&self, fold_error: f32) -> LightCounts {
        let fold_error = if self.folded.is_empty() { 0.0 } else { fold_error };
        LightCounts { single: self.single.len(), folded: self.folded.len(), dark: self.dark, fold_error }
    }
}

/// Whether the direction towards the camera is nearly the same all over the object, as far as the phase function minds.
fn may_fold(frame: &Frame, info: &Info) -> bool {
    let g = info.phase.mean_cosine().abs() as f32;
    let parallax = 0.5 * info.diagonal() / frame.view.origin.length();
    g == 0.0 || parallax <= MOST_PARALLAX * (1.0 - g).powi(2)
}

/// The lights that matter, in order, and the number of others: all those whose irradiance on a sphere of `radius` around
/// the object adds up to no more than [`NEGLIGIBLE`] of what all others bring at least.
fn reaching(frame: &Frame, radius: f32) -> (Vec<usize>, usize) {
    let bounds: Vec<(f32, f32)> =
        frame.lights.iter().map(|l| irradiance(l, radius, frame.least_distance)).collect();
    let total: f32 = bounds.iter().map(|(least, _)| least).sum();
    let mut order: Vec<usize> = (0..bounds.len()).collect();
    order.sort_by(|a, b| bounds[*a].1.total_cmp(&bounds[*b].1));
    let mut sum = 0.0;
    let dark = order
        .iter()
        .take_while(|i| {
            sum += bounds[**i].1;
            sum <= NEGLIGIBLE * total
        })
        .count();
    let mut lit = order.split_off(dark);
    lit.sort_unstable();
    (lit, dark)
}

/// Least and greatest irradiance of a light on a sphere of `radius` around the origin, the largest channel's.
fn irradiance(light: &FrameLight, radius: f32, least_distance: f32) -> (f32, f32) {
    let colour = light.colour.abs().max_element();
    if light.kind == LightKind::Directional {
        return (colour, colour);
    }
    let distance = light.position.length();
    let over = |d: f32| colour / d.max(least_distance).powi(2);
    let (least, greatest) = (over(distance + radius), over(distance - radius));
    if light.kind == LightKind::Spot {
        return (0.0, if cone_misses(light, distance, radius) { 0.0 } else { greatest });
    }
    (least, greatest)
}

/// Whether a spot's cone passes the sphere by.
fn cone_misses(light: &FrameLight, distance: f32, radius: f32) -> bool {
    if distance <= radius {
        return false;
    }
    let to_centre = -light.position / distance;
    let off_axis = to_centre.dot(light.direction).clamp(-1.0, 1.0).acos();
    let sphere = (radius / distance).asin();
    off_axis - sphere > light.cos_outer.clamp(-1.0, 1.0).acos() + 1e-3
}

/// Deviation of the direction towards the camera at `place` from that at the origin.
pub(crate) fn parallax(origin: Vec3, place: Vec3) -> Vec3 {
    (origin - place).normalize_or_zero() - origin.normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(kind: LightKind, position: Vec3, colour: f32) -> FrameLight {
        FrameLight {
            kind,
            position,
            direction: -position.normalize_or(Vec3::Y),
            colour: Vec3::splat(colour),
            cos_inner: 0.99,
            cos_outer: 0.98,
            most_cosine: 1.0,
        }
    }

    #[test]
    fn bounds_hold_on_the_sphere() {
        for (kind, colour) in [(LightKind::Point, 3.0), (LightKind::Spot, 2.0), (LightKind::Directional, 1.0)]
        {
            for distance in [0.5, 1.5, 20.0] {
                let light = light(kind, Vec3::new(0.3, -0.2, 1.0).normalize() * distance, colour);
                let (least, greatest) = irradiance(&light, 1.0, 1e-3);
                for d in diaphane_formats::directions::even_directions(200, 1) {
                    let (_, _, here) = light.at(d.as_vec3(), 1e-3);
                    assert!(here.x >= least * 0.999 && here.x <= greatest * 1.001, "{kind:?} {distance}");
                }
            }
        }
    }

    #[test]
    fn a_spot_that_looks_away_misses() {
        let mut spot = light(LightKind::Spot, Vec3::X * 5.0, 1.0);
        assert!(!cone_misses(&spot, 5.0, 1.0));
        spot.direction = Vec3::Y;
        assert!(cone_misses(&spot, 5.0, 1.0));
        assert!(!cone_misses(&spot, 0.5, 1.0));
    }
}
