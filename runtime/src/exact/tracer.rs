//! Exact optical depths from the samples to chosen lights: rays through the mesh instead of spherical harmonics.
//!
//! For point and spot lights the depth ends at the light, so that lights inside the object are right; the baked
//! depth runs to infinity.

use crate::Result;
use crate::frame::{Frame, FrameLight, LightKind};
use diaphane_formats::asset::Asset;
use diaphane_formats::medium::Medium;
use diaphane_formats::mesh::Mesh;
use diaphane_formats::visibility::{Accel, depth_along};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// [density length m (mesh units), Fresnel transmittance of the boundary (0..1)] of every sample towards some of a
/// frame's lights.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExactDepths {
    lights: Vec<Option<Arc<Vec<[f32; 2]>>>>,
}

impl ExactDepths {
    /// The depths of all samples towards light `index` of the frame; `None` where the baked ones serve.
    pub fn light(&self, index: usize) -> Option<&[[f32; 2]]> {
        self.lights.get(index)?.as_deref().map(Vec::as_slice)
    }

    /// Whether no light has exact depths.
    pub fn is_empty(&self) -> bool {
        self.lights.iter().all(Option::is_none)
    }
}

/// Traces depths from an asset's samples, and remembers those of lights that stay where they are.
pub struct DepthTracer {
    mesh: Mesh,
    medium: Medium,
    places: Vec<Vec3>,
    accel: OnceLock<Accel>,
    traced: Vec<(Place, Arc<Vec<[f32; 2]>>)>,
}

/// What a light's depths depend on.
type Place = (LightKind, Vec3);

fn place(light: &FrameLight) -> Place {
    match light.kind {
        LightKind::Directional => (LightKind::Directional, light.direction),
        LightKind::Point | LightKind::Spot => (LightKind::Point, light.position),
    }
}

impl DepthTracer {
    /// A tracer for an asset. Cheap: the hierarchy is built when first needed.
    ///
    /// # Errors
    /// An asset whose mesh or medium makes no sense.
    pub fn new(asset: &Asset) -> Result<Self> {
        Ok(Self {
            mesh: asset.mesh()?,
            medium: asset.medium()?,
            places: (0..asset.samples.len()).map(|i| asset.samples.centroid(i)).collect(),
            accel: OnceLock::new(),
            traced: Vec::new(),
        })
    }

    /// Depths towards the lights of `frame` named by `wanted` (indices; those out of range are ignored). Lights that
    /// were traced in the call before are not traced again.
    pub fn trace(&mut self, frame: &Frame, wanted: &[usize]) -> ExactDepths {
        let mut depths = ExactDepths { lights: vec![None; frame.lights.len()] };
        let mut kept = Vec::with_capacity(wanted.len());
        for &index in wanted.iter().filter(|&&i| i < frame.lights.len()) {
            let light = &frame.lights[index];
            let key = place(light);
            let known = self.traced.iter().find(|(k, _)| *k == key).map(|(_, t)| Arc::clone(t));
            let table = known.unwrap_or_else(|| Arc::new(self.light(light, frame.least_distance)));
            kept.push((key, Arc::clone(&table)));
            depths.lights[index] = Some(table);
        }
        self.traced = kept;
        depths
    }

    /// Forgets what was traced, so that the next call does all the work again.
    pub fn forget(&mut self) {
        self.traced.clear();
    }

    fn light(&self, light: &FrameLight, least: f32) -> Vec<[f32; 2]> {
        let accel = self.accel.get_or_init(|| Accel::new(&self.mesh));
        let trace = |scratch: &mut Vec<_>, x: &Vec3| {
            let (to, distance, _) = light.at(*x, least);
            let (to, limit) = (to.as_dvec3().normalize_or_zero(), f64::from(distance));
            if to == DVec3::ZERO {
                return [0.0, 1.0];
            }
            let depth = depth_along(accel, &self.medium, x.as_dvec3(), to, limit, scratch);
            [depth.density_length as f32, depth.boundary as f32]
        };
        self.places.par_iter().with_min_len(64).map_init(Vec::new, trace).collect()
    }
}
