//! The most radiance that can leave an object towards a camera.
//!
//! With single scattering L = ∫ e^{-τ_view} κs Σ_l p E_l ψ dt. Transmittances are at most 1, and
//! ∫ e^{-τ_view} κt dt over a ray's inside pieces is 1 - e^{-τ} ≤ 1, hence
//!
//!   L ≤ Ω Σ_l p_max E_l,max,    p_max = (1 + |g|) / (4π (1 - |g|)²)
//!
//! with E_l,max a light's irradiance at the nearest point of the bounding box, its distance clamped as the player
//! clamps it. A boundary that refracts takes more away. For the same radiance R from everywhere ∫ p dω = 1 gives the
//! sharper L ≤ Ω R: the furnace.

use super::stage::FURNACE;
use diaphane_formats::asset::Info;
use diaphane_formats::scene::{Light, Scene};
use diaphane_runtime::frame::LEAST_DISTANCE;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Share by which single precision may exceed a bound: some hundred roundings.
pub const ROUNDING: f64 = 2e-5;

/// Share by which the furnace's radiance changes on its way through a picture of 64 × 32 pixels and ten bands of
/// harmonics (the quadrature's error, which a test of the frame measures as well).
pub const PROJECTION: f64 = 1e-3;

/// Share by which the sum over an environment's directions may exceed the integral where the phase function is not
/// isotropic, see [`diaphane_runtime::frame::ENVIRONMENT_MEAN_COSINE`].
pub const DIRECTIONS: f64 = 0.033;

/// The bound for every channel of a scene of an asset, rounding included.
pub fn most_radiance(scene: &Scene, info: &Info) -> DVec3 {
    let g = info.phase.mean_cosine().abs();
    let albedo = DVec3::from(info.albedo);
    if scene.environment.is_some() {
        let directions = if g == 0.0 { 0.0 } else { DIRECTIONS };
        return albedo * FURNACE * (1.0 + directions + PROJECTION + ROUNDING);
    }
    let most_phase = (1.0 + g) / (4.0 * PI * (1.0 - g).powi(2));
    let irradiance: DVec3 = scene.lights.iter().map(|light| most_irradiance(light, info)).sum();
    albedo * irradiance * (most_phase * (1.0 + ROUNDING))
}

/// Greatest irradiance of a light in the bounding box.
pub fn most_irradiance(light: &Light, info: &Info) -> DVec3 {
    let (position, intensity) = match *light {
        Light::Directional { irradiance, .. } => return irradiance,
        Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
            (position, intensity)
        }
    };
    let [low, high] = info.bounds.map(|b| Vec3::from(b).as_dvec3());
    let local = position - DVec3::from(info.centre);
    let distance = local.distance(local.clamp(low, high));
    intensity / distance.max(LEAST_DISTANCE * f64::from(info.diagonal())).powi(2)
}
