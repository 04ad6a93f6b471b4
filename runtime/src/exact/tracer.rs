//! Rays from the samples to lights, and how the baked transmittance differs from theirs.

use super::report::{LightError, Squares};
use super::schedule::{Place, Portion, Work, place};
use super::{Depths, ExactDepths, ExactReport, Known};
use crate::Result;
use crate::cpu::lighting::Lighting;
use crate::frame::{Frame, FrameLight, frame_light};
use crate::gpu::{GpuDepths, GpuDevice};
use diaphane_formats::asset::{Asset, Info, Samples};
use diaphane_formats::medium::Medium;
use diaphane_formats::mesh::Mesh;
use diaphane_formats::scene::Light;
use diaphane_formats::visibility::{Accel, depth_along};
use glam::{DVec3, Vec3};
use half::f16;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// Every so manieth sample tells the error where a light is traced at once.
const CHECKED: usize = 16;

/// Samples with which a GPU is checked.
const CHECK: usize = 512;

/// Samples of a task.
const TASK: usize = 64;

/// What rays run through; all levels and objects of an asset share it.
struct Geometry {
    mesh: Mesh,
    medium: Medium,
    accel: OnceLock<Accel>,
    /// Whether the density is the same everywhere.
    even: bool,
}

/// Where rays begin; all objects of a level share it.
struct Level {
    samples: Samples,
    places: Vec<Vec3>,
}

/// Traces depths from an asset's samples, and remembers those of lights that stay where they are.
pub struct DepthTracer {
    geometry: Arc<Geometry>,
    level: Arc<Level>,
    /// As it is played.
    info: Info,
    /// Baked light, to compare with; objects of the same material share it.
    lighting: Arc<OnceLock<Lighting>>,
    /// Who traces in place of the CPU.
    gpu: Option<Traces>,
    traced: Vec<Traced>,
    report: ExactReport,
}

/// A GPU that traces until it fails.
struct Traces {
    depths: GpuDepths,
    failed: AtomicBool,
}

/// A light of the call before.
struct Traced {
    place: Place,
    depths: Arc<Depths>,
    error: f32,
}

impl DepthTracer {
    /// A tracer for an asset. Cheap: the hierarchy is built when first needed.
    ///
    /// # Errors
    /// An asset whose mesh or medium makes no sense.
    pub fn new(asset: &Asset) -> Result<Self> {
        let (mesh, medium, even) = (asset.mesh()?, asset.medium()?, asset.density.is_none());
        let geometry = Geometry { mesh, medium, accel: OnceLock::new(), even };
        Ok(Self::on(Arc::new(geometry), asset))
    }

    fn on(geometry: Arc<Geometry>, asset: &Asset) -> Self {
        let places = (0..asset.samples.len()).map(|i| asset.samples.centroid(i)).collect();
        Self {
            geometry,
            level: Arc::new(Level { samples: asset.samples.clone(), places }),
            info: asset.info.clone(),
            lighting: Arc::default(),
            gpu: None,
            traced: Vec::new(),
            report: ExactReport::default(),
        }
    }

    /// A tracer for another level of the same asset.
    pub fn for_level(&self, level: &Asset) -> Self {
        Self::on(Arc::clone(&self.geometry), level)
    }

    /// A tracer for another object of the same asset, level and material.
    pub fn another(&self) -> Self {
        Self {
            geometry: Arc::clone(&self.geometry),
            level: Arc::clone(&self.level),
            info: self.info.clone(),
            lighting: Arc::clone(&self.lighting),
            gpu: None,
            traced: Vec::new(),
            report: ExactReport::default(),
        }
    }

    /// Takes extinction from an edited asset's parameters: it decides how baked and exact transmittance differ. Depths stay as
    /// they are.
    pub fn set_material(&mut self, info: &Info) {
        self.info = info.clone();
        match Arc::get_mut(&mut self.lighting) {
            Some(own) => {
                if let Some(lighting) = own.get_mut() {
                    lighting.set_material(info);
                }
            }
            // Others keep theirs.
            None => self.lighting = Arc::default(),
        }
    }

    /// Traces on a GPU from now on where it can (the density is even and no shells overlap) and finds what the CPU finds for some
    /// samples and lights. Says whether it does.
    pub fn use_gpu(&mut self, device: &GpuDevice) -> bool {
        self.gpu = None;
        if !self.geometry.even {
            return false;
        }
        let Some(depths) = GpuDepths::new(device, &self.geometry.mesh, &self.info, &self.level.places) else {
            return false;
        };
        self.gpu = Some(Traces { depths, failed: AtomicBool::new(false) });
        if !self.agrees() {
            log::warn!("the GPU finds other depths than the CPU, which traces them");
            self.gpu = None;
        }
        self.is_on_gpu()
    }

    /// Traces on the CPU from now on.
    pub fn use_cpu(&mut self) {
        self.gpu = None;
    }

    /// Whether a GPU traces.
    pub fn is_on_gpu(&self) -> bool {
        self.gpu.as_ref().is_some_and(|g| !g.failed.load(Ordering::Relaxed))
    }

    /// Whether the GPU finds the depths of some samples as the CPU does: all but those that run along faces.
    fn agrees(&self) -> bool {
        let reach = Vec3::from(self.info.bounds[1]).abs().max(Vec3::from(self.info.bounds[0]).abs());
        let most = 1e-4 * self.info.diagonal();
        let far = Light::Directional { direction: DVec3::new(0.36, -0.8, 0.48), irradiance: DVec3::ONE };
        let place = reach.as_dvec3() * DVec3::new(1.5, 2.0, -1.7);
        let near = Light::Point { position: place, intensity: DVec3::ONE };
        let range = 0..self.level.places.len().min(CHECK);
        [far, near].iter().all(|light| {
            let light = frame_light(light, DVec3::ZERO);
            let gpu = self.depths(&light, 0.0, range.clone());
            let cpu = self.depths_on_cpu(&light, 0.0, range.clone());
            let same =
                |(a, b): &(&[f32; 2], &[f32; 2])| (a[0] - b[0]).abs() <= most && (a[1] - b[1]).abs() <= 1e-3;
            let count = gpu.iter().zip(&cpu).filter(same).count();
            self.is_on_gpu() && (range.len() - count) * 50 <= range.len()
        })
    }

    /// Builds what the first light would have to wait for.
    pub fn prepare(&self) {
        self.accel();
        self.lighting();
    }

    /// Depths towards the lights of `frame` named by `wanted` (indices; those out of range are ignored). Lights that
    /// were traced in the call before are not traced again.
    pub fn trace(&mut self, frame: &Frame, wanted: &[usize]) -> ExactDepths {
        let started = Instant::now();
        let mut lights = vec![None; frame.lights.len()];
        let mut kept: Vec<Traced> = Vec::with_capacity(wanted.len());
        let mut report = ExactReport::default();
        for &index in wanted.iter().filter(|&&i| i < frame.lights.len()) {
            let light = &frame.lights[index];
            let place = place(light);
            let known = kept.iter().chain(&self.traced).find(|t| t.place == place);
            let (depths, error) = known.map(|t| (Arc::clone(&t.depths), t.error)).unwrap_or_else(|| {
                let depths = self.depths(light, frame.least_distance, 0..self.level.places.len());
                report.rays += depths.len() as u64;
                let error = self.error(light, frame.least_distance, &depths);
                (Arc::new(Depths::new(depths)), error)
            });
            report.errors.push(LightError { light: index, relative: error });
            lights[index] = Some(Known::Exact(Arc::clone(&depths)));
            kept.push(Traced { place, depths, error });
        }
        report.milliseconds = started.elapsed().as_secs_f64() * 1e3;
        report.exact = lights.iter().flatten().count();
        report.baked = lights.len() - report.exact;
        report.bytes = (report.exact * self.level.places.len() * size_of::<[f32; 2]>()) as u64;
        report.on_gpu = self.is_on_gpu();
        report.rays_per_second = report.rays as f64 * 1e3 / report.milliseconds.max(1e-3);
        self.report = report;
        self.traced = kept;
        ExactDepths::new(lights)
    }

    /// Parameters of the asset, extinction and albedo as they are played.
    pub fn info(&self) -> &Info {
        &self.info
    }

    /// What the last call of [`Self::trace`] did.
    pub fn report(&self) -> &ExactReport {
        &self.report
    }

    /// Forgets what was traced, so that the next call does all the work again.
    pub fn forget(&mut self) {
        self.traced.clear();
    }

    fn accel(&self) -> &Accel {
        self.geometry.accel.get_or_init(|| Accel::new(&self.geometry.mesh))
    }

    fn lighting(&self) -> &Lighting {
        self.lighting.get_or_init(|| Lighting::new(&self.info, &self.level.samples))
    }

    fn depths(&self, light: &FrameLight, least: f32, range: Range<usize>) -> Vec<[f32; 2]> {
        let gpu = self.gpu.as_ref().filter(|_| self.is_on_gpu());
        match gpu.map(|gpu| gpu.depths.trace(light, range.clone())) {
            Some(Ok(mut found)) => {
                for (i, depth) in range.zip(&mut found).filter(|(_, depth)| !(depth[0] >= 0.0)) {
                    *depth = self.depths_on_cpu(light, least, i..i + 1)[0];
                }
                return found;
            }
            Some(Err(error)) => {
                log::warn!("the GPU traces no more depths ({error}); the CPU does");
                gpu.iter().for_each(|g| g.failed.store(true, Ordering::Relaxed));
            }
            None => {}
        }
        self.depths_on_cpu(light, least, range)
    }

    fn depths_on_cpu(&self, light: &FrameLight, least: f32, range: Range<usize>) -> Vec<[f32; 2]> {
        let accel = self.accel();
        let trace = |scratch: &mut Vec<_>, x: &Vec3| {
            let (to, distance, _) = light.at(*x, least);
            let (to, limit) = (to.as_dvec3().normalize_or_zero(), f64::from(distance));
            if to == DVec3::ZERO {
                return [0.0, 1.0];
            }
            let depth = depth_along(accel, &self.geometry.medium, x.as_dvec3(), to, limit, scratch);
            [depth.density_length as f32, depth.boundary as f32]
        };
        self.level.places[range].par_iter().with_min_len(TASK).map_init(Vec::new, trace).collect()
    }

    /// d of sample `i` for its exact depth, and what it adds to the error's sums.
    fn difference(&self, light: &FrameLight, least: f32, i: usize, depth: [f32; 2]) -> (Vec3, Squares) {
        let lighting = self.lighting();
        let (to, _, irradiance) = light.at(self.level.places[i], least);
        let exact = lighting.through(depth);
        let d = exact - lighting.arriving_from(i, to);
        let weight = f64::from(self.level.samples.weight[i].max(0.0));
        let square = |v: Vec3| weight * (irradiance.as_dvec3() * v.as_dvec3()).length_squared();
        (d, Squares { difference: square(d), exact: square(exact) })
    }

    /// Error of the baked depths, from a part of the samples.
    fn error(&self, light: &FrameLight, least: f32, depths: &[[f32; 2]]) -> f32 {
        let of = |k: usize| self.difference(light, least, k * CHECKED, depths[k * CHECKED]).1;
        let squares: Vec<Squares> =
            (0..depths.len().div_ceil(CHECKED)).into_par_iter().with_min_len(TASK).map(of).collect();
        squares.into_iter().fold(Squares::default(), Squares::plus).relative()
    }
}

impl Work for (&DepthTracer, f32) {
    fn samples(&self) -> usize {
        self.0.level.places.len()
    }

    fn run(&mut self, light: &FrameLight, range: Range<usize>) -> (Portion, f64) {
        let started = Instant::now();
        let depths = self.0.depths(light, self.1, range.clone());
        let (corrections, squares) = self.compare(light, range, &depths);
        (Portion { depths, corrections, squares }, started.elapsed().as_secs_f64() * 1e3)
    }

    fn compare(
        &mut self,
        light: &FrameLight,
        range: Range<usize>,
        depths: &[[f32; 2]],
    ) -> (Vec<[f16; 4]>, Squares) {
        let (tracer, least) = *self;
        let of = |(i, depth): (usize, &[f32; 2])| {
            let (d, squares) = tracer.difference(light, least, i, *depth);
            ([d.x, d.y, d.z, 0.0].map(f16::from_f32), squares)
        };
        let each: Vec<([f16; 4], Squares)> =
            range.into_par_iter().zip(depths).with_min_len(TASK).map(of).collect();
        // One after the other, so that the sum does not depend on the number of threads.
        let squares = each.iter().fold(Squares::default(), |sum, (_, s)| sum.plus(*s));
        (each.into_iter().map(|(d, _)| d).collect(), squares)
    }
}
