//! The baked asset (`*.dph`): what a bake produces and a player needs, in one file that refers to no other.
//!
//! All positions are relative to [`Info::centre`] (the mesh's bounding box centre, kept in f64), so that f32 suffices
//! wherever the object stands.

mod certificate;
mod codec;
mod container;
mod info;
mod levels;
mod places;
mod read;
mod write;

pub(crate) use container::MAGIC;

pub use certificate::{Certificate, CertifiedError};
pub use info::{Info, Provenance};
pub use levels::{Level, MAX_LEVELS};
pub use places::Places;
pub use read::{parse, parse_level, read, read_level, section_sizes};
pub use write::{encode, write};

use crate::harmonics::Harmonics;
use crate::medium::{Density, Grid, Medium};
use crate::mesh::Mesh;
use crate::{Error, Result};
use glam::{DVec3, Vec3};
use half::f16;

/// Version of the file format that this build writes and reads.
pub const FORMAT_VERSION: u32 = 4;

/// Set in a sample's stored number of bands where it has a lobe.
const HAS_LOBE: u8 = 0x80;

/// A baked object.
#[derive(Clone, Debug, PartialEq)]
pub struct Asset {
    /// Parameters, medium and provenance.
    pub info: Info,
    /// The samples: those of the coarsest level first, then what each finer one adds.
    pub samples: Samples,
    /// The coarser levels of detail, the finest of them first; may be none.
    pub levels: Vec<Level>,
    /// Boundary mesh: vertex positions relative to the centre.
    pub mesh_positions: Vec<[f32; 3]>,
    /// Boundary mesh: triangles.
    pub mesh_triangles: Vec<[u32; 3]>,
    /// The density field, absent for a homogeneous medium.
    pub density: Option<DensityGrid>,
}

/// Samples as parallel arrays of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Position relative to the centre (stored as [`Places`] do), and Poisson-disk radius (an f16), mesh units.
    pub position_radius: Vec<[f32; 4]>,
    /// Where the values hold: (centroid - position) · 127 / radius, and a zero.
    pub offset: Vec<[i8; 4]>,
    /// Partition-of-unity weight of the kernel, ≥ 0; an f16.
    pub weight: Vec<f32>,
    /// Spherical harmonics of the encoded optical depth, each sample with its own order.
    pub depth: Harmonics,
    /// Vector a of the lobe max(a·ω, 0) that is added to them (as [`crate::lobe`] stores it), 0 for samples without;
    /// empty unless the encoding has lobes.
    pub lobe: Vec<Vec3>,
    /// Spherical harmonics of the boundary's Fresnel transmittance product, all of
    /// [`Info::boundary_order`]; empty when index matched.
    pub boundary: Harmonics,
}

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.position_radius.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.position_radius.is_empty()
    }

    /// Position of sample `i` relative to the centre.
    pub fn position(&self, i: usize) -> Vec3 {
        let [x, y, z, _] = self.position_radius[i];
        Vec3::new(x, y, z)
    }

    /// Centroid of the neighbourhood that sample `i` stands for, relative to the centre.
    pub fn centroid(&self, i: usize) -> Vec3 {
        let [x, y, z, _] = self.offset[i];
        let radius = self.position_radius[i][3];
        self.position(i) + Vec3::new(f32::from(x), f32::from(y), f32::from(z)) * (radius / 127.0)
    }
}

/// ρ and its scattering part at voxel centres, trilinear between them, clamped outside.
#[derive(Clone, Debug, PartialEq)]
pub struct DensityGrid {
    /// Voxels along x, y, z.
    pub size: [u32; 3],
    /// Lower corner of the whole grid, relative to the centre.
    pub min: [f32; 3],
    /// Upper corner.
    pub max: [f32; 3],
    /// [ρ, scattering part of ρ] in [z][y][x] order.
    pub values: Vec<[f16; 2]>,
}

impl DensityGrid {
    /// Trilinear [ρ, scattering ρ] at a point relative to the centre, as the player's shader evaluates it.
    pub fn value(&self, p: Vec3) -> [f32; 2] {
        let (min, max) = (Vec3::from(self.min), Vec3::from(self.max));
        let unit = (p - min) / (max - min);
        let mut cell = [(0usize, 0usize, 0.0f32); 3];
        for (k, c) in cell.iter_mut().enumerate() {
            let n = self.size[k] as usize;
            let s = (unit[k] * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
            let i = s as usize;
            *c = (i, (i + 1).min(n - 1), s - i as f32);
        }
        let [(x0, x1, fx), (y0, y1, fy), (z0, z1, fz)] = cell;
        let at = |i: usize, j: usize, k: usize| {
            let [a, b] = self.values[(k * self.size[1] as usize + j) * self.size[0] as usize + i];
            [a.to_f32(), b.to_f32()]
        };
        let lerp = |a: [f32; 2], b: [f32; 2], f: f32| [a[0] + (b[0] - a[0]) * f, a[1] + (b[1] - a[1]) * f];
        let plane = |z: usize| {
            lerp(lerp(at(x0, y0, z), at(x1, y0, z), fx), lerp(at(x0, y1, z), at(x1, y1, z), fx), fy)
        };
        lerp(plane(z0), plane(z1), fz)
    }
}

impl Asset {
    /// Checks that all parts fit together.
    ///
    /// # Errors
    /// The first inconsistency, in plain words.
    pub fn validate(&self) -> Result<()> {
        self.info.validate()?;
        let n = self.samples.len();
        let fail = |what: &str| Err(Error::invalid(format!("the asset's {what} do not fit together")));
        let s = &self.samples;
        if self.info.samples as usize != n || s.weight.len() != n || s.offset.len() != n {
            return fail("sample sections");
        }
        s.depth.validate(n, self.info.order as usize, "depth coefficients")?;
        if s.lobe.len() != if self.info.encoding.has_lobe() { n } else { 0 } {
            return fail("lobes");
        }
        let boundary = if self.info.ior == 1.0 { 0 } else { n };
        s.boundary.validate(boundary, self.info.boundary_order as usize, "boundary coefficients")?;
        if s.boundary.order.iter().any(|k| u32::from(*k) != self.info.boundary_order) {
            return fail("boundary orders");
        }
        let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
        if !s.position_radius.iter().all(|p| finite(p) && p[3] > 0.0)
            || !s.weight.iter().all(|w| w.is_finite() && *w >= 0.0)
            || !s.lobe.iter().all(|v| v.is_finite())
        {
            return fail("sample values");
        }
        levels::validate(&self.levels, n)?;
        self.mesh()?;
        if let Some(grid) = &self.density {
            let count = grid.size.iter().try_fold(1usize, |a, &n| a.checked_mul(n as usize));
            let bounds_fit =
                (0..3).all(|i| grid.min[i] < grid.max[i] && (grid.max[i] - grid.min[i]).is_finite());
            let values_fit = grid.values.iter().flatten().all(|v| v.is_finite() && v.to_f32() >= 0.0);
            if count != Some(grid.values.len()) || grid.values.is_empty() || !bounds_fit || !values_fit {
                return fail("density grid values");
            }
        }
        Ok(())
    }

    /// The boundary mesh relative to the centre, in f64.
    pub fn mesh(&self) -> Result<Mesh> {
        let positions = self.mesh_positions.iter().map(|p| Vec3::from(*p).as_dvec3()).collect();
        Mesh::from_trusted(positions, self.mesh_triangles.clone())
    }

    /// The medium relative to the centre, with the density as the asset carries it.
    pub fn medium(&self) -> Result<Medium> {
        let density = match &self.density {
            None => Density::Uniform(self.info.uniform_density),
            Some(g) => Density::Grid(Grid::new(
                g.size.map(|n| n as usize),
                Vec3::from(g.min).as_dvec3(),
                Vec3::from(g.max).as_dvec3(),
                g.values.iter().map(|v| v[0].to_f32()).collect(),
            )?),
        };
        let i = &self.info;
        Medium::new(DVec3::from(i.extinction), DVec3::from(i.albedo), i.phase, i.ior, density)
    }
}
