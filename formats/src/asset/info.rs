//! The asset's small metadata.

use super::Certificate;
use crate::encoding::Encoding;
use crate::medium::{Density, Medium};
use crate::mesh::MeshReport;
use crate::phase::Phase;
use crate::sh::MAX_ORDER;
use crate::{Error, Result};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Where an asset comes from: enough to bake it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name and version of the program.
    pub program: String,
    /// File name of the mesh, without its folder.
    pub mesh_name: String,
    /// BLAKE3 of the mesh (positions and triangles after repair).
    pub mesh_hash: [u8; 32],
    /// File name of the material, without its folder.
    pub material_name: String,
    /// Seed of all random choices.
    pub seed: u64,
    /// Directions in which the optical depth was computed.
    pub directions: u32,
    /// What was found and mended in the mesh.
    pub mesh_report: MeshReport,
}

/// Parameters that give the arrays their meaning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// Where it comes from.
    pub provenance: Provenance,
    /// World position of the origin of all other positions.
    pub centre: [f64; 3],
    /// Bounding box of the mesh relative to the centre.
    pub bounds: [[f32; 3]; 2],
    /// κt at density 1, per channel, 1 / mesh unit.
    pub extinction: [f64; 3],
    /// Ω per channel.
    pub albedo: [f64; 3],
    /// Phase function.
    pub phase: Phase,
    /// Index of refraction.
    pub ior: f64,
    /// ρ of a homogeneous medium, 1 otherwise.
    pub uniform_density: f64,
    /// Number of samples.
    pub samples: u64,
    /// Candidates that were dropped because almost no light reaches them.
    pub discarded: u64,
    /// Most bands of a sample's spherical harmonics.
    pub order: u32,
    /// Error of the transmittance (root mean square over directions) at which a sample gets no more bands.
    pub light_error: f64,
    /// Bands of the boundary's spherical harmonics; 0 when index matched.
    pub boundary_order: u32,
    /// What the coefficients mean.
    pub encoding: Encoding,
    /// κ̄: optical depths are encoded for this extinction.
    pub reference_extinction: f64,
    /// Full width at half maximum of a kernel in disk radii.
    pub width_factor: f32,
    /// How far the asset is from the truth; `None` if the bake did not measure it.
    pub certificate: Option<Certificate>,
}

impl Info {
    /// Length of the bounding box's diagonal.
    pub fn diagonal(&self) -> f32 {
        Vec3::from(self.bounds[1]).distance(Vec3::from(self.bounds[0]))
    }

    /// κ/κ̄ per channel: what stored optical depths are multiplied with. 0 where κ̄ is 0.
    pub fn ratio(&self) -> Vec3 {
        let reference = self.reference_extinction;
        if reference > 0.0 { (DVec3::from(self.extinction) / reference).as_vec3() } else { Vec3::ZERO }
    }

    pub(super) fn validate(&self) -> Result<()> {
        let fail = |what: &str| Err(Error::invalid(format!("the asset's {what} is out of range")));
        if !(1..=MAX_ORDER as u32).contains(&self.order) {
            return fail("spherical-harmonics order");
        }
        if (self.ior != 1.0) != (1..=MAX_ORDER as u32).contains(&self.boundary_order) {
            return fail("boundary's spherical-harmonics order");
        }
        if !(self.light_error >= 0.0) {
            return fail("light error");
        }
        if !(self.width_factor > 0.0 && self.width_factor.is_finite()) {
            return fail("width factor");
        }
        if !(self.reference_extinction >= 0.0 && self.reference_extinction.is_finite()) {
            return fail("reference extinction");
        }
        if !(self.uniform_density >= 0.0 && self.uniform_density.is_finite()) {
            return fail("density");
        }
        if self.centre.iter().any(|c| !c.is_finite()) {
            return fail("centre");
        }
        if let Encoding::Reciprocal { epsilon } | Encoding::Lobe { epsilon } = self.encoding
            && !(epsilon > 0.0 && epsilon.is_finite())
        {
            return fail("encoding");
        }
        if !self.ratio().is_finite() {
            return fail("extinction");
        }
        let [low, high] = self.bounds.map(Vec3::from);
        let diagonal = self.diagonal();
        if !(low.cmple(high).all() && diagonal.is_finite() && diagonal > 0.0) {
            return fail("bounding box");
        }
        let (extinction, albedo) = (DVec3::from(self.extinction), DVec3::from(self.albedo));
        Medium::new(extinction, albedo, self.phase, self.ior, Density::Uniform(self.uniform_density))
            .map_err(|e| Error::invalid(format!("the asset's {e}")))?;
        self.certificate.map_or(Ok(()), |c| c.validate())
    }
}
