//! Exact light for a march: a shadow ray through the mesh's hierarchy to every light, nothing stored.

use super::march::Light;
use super::object::Object;
use diaphane_formats::visibility::{Accel, Crossing, depth_along};
use glam::{DVec3, Vec3};

/// Shadow rays through an object.
pub struct Shadows<'a> {
    object: &'a Object<'a>,
    accel: Accel,
}

impl<'a> Shadows<'a> {
    /// Builds the hierarchy in world space, where the medium is.
    pub fn new(object: &'a Object<'a>) -> Self {
        Self { object, accel: Accel::new(object.mesh) }
    }
}

impl Light for Shadows<'_> {
    type Memory = Vec<Crossing>;

    fn enter(&self, _: Vec3, _: &mut Self::Memory) {}

    fn arriving(&self, place: Vec3, towards: Vec3, distance: f32, memory: &mut Self::Memory) -> Vec3 {
        let towards = towards.as_dvec3().normalize_or(DVec3::Y);
        let medium = self.object.medium;
        let origin = self.object.world(place);
        let depth = depth_along(&self.accel, medium, origin, towards, f64::from(distance), memory);
        (-medium.extinction() * depth.density_length).exp().as_vec3() * depth.boundary as f32
    }
}
