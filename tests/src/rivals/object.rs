//! One object as every rival sees it: the medium and mesh as given, and the asset's frame of reference.

use diaphane_bake::params::DENSITY_VOXELS;
use diaphane_formats::Result;
use diaphane_formats::asset::{Asset, DensityGrid};
use diaphane_formats::medium::{Medium, SampledDensity};
use diaphane_formats::mesh::Mesh;
use diaphane_formats::visibility::Accel;
use diaphane_runtime::cpu::splat::RayMedium;
use glam::{DVec3, Vec3};

/// Mesh and medium in world space, and what is derived from them once. Points and rays of rivals are relative to
/// [`Object::centre`], like those of the player.
pub struct Object<'a> {
    /// Boundary, world space.
    pub mesh: &'a Mesh,
    /// What fills it, world space.
    pub medium: &'a Medium,
    /// Hierarchy over the mesh relative to the centre.
    pub accel: Accel,
    /// The density on voxels where its integral has no closed form.
    pub sampled: Option<SampledDensity>,
    /// World position of the origin of rays.
    pub centre: DVec3,
    density: Option<DensityGrid>,
    extinction: Vec3,
}

impl<'a> Object<'a> {
    /// The object that `asset` was baked from.
    ///
    /// # Errors
    /// An asset whose mesh makes no sense.
    pub fn new(mesh: &'a Mesh, medium: &'a Medium, asset: &Asset) -> Result<Self> {
        let (low, high) = mesh.bounds();
        let sampled =
            (!medium.has_closed_form()).then(|| SampledDensity::new(medium, low, high, DENSITY_VOXELS));
        Ok(Self {
            mesh,
            medium,
            accel: Accel::new(&asset.mesh()?),
            sampled,
            centre: DVec3::from(asset.info.centre),
            density: asset.density.clone(),
            extinction: (medium.extinction() * medium.uniform_density()).as_vec3(),
        })
    }

    /// How the medium attenuates along camera rays: as the player sees it.
    pub fn ray_medium(&self) -> RayMedium<'_> {
        RayMedium { extinction: self.extinction, density: self.density.as_ref() }
    }

    /// World position of a point relative to the centre.
    pub fn world(&self, p: Vec3) -> DVec3 {
        p.as_dvec3() + self.centre
    }

    /// κ/κ̄ per channel: exponents that turn ψ at the reference extinction into ψ of a channel. Ones in a vacuum.
    pub fn channel_ratio(&self) -> Vec3 {
        let reference = self.medium.reference_extinction();
        if reference > 0.0 { (self.medium.extinction() / reference).as_vec3() } else { Vec3::ONE }
    }
}
