//! Exact depths spread over frames, for programs that draw one after the other.

use super::schedule::{Schedule, Settings, Wish};
use super::{DepthTracer, ExactDepths, ExactReport};
use crate::Result;
use crate::fold::reach;
use crate::frame::Frame;
use crate::gpu::GpuDevice;
use crate::player::LightMode;
use diaphane_formats::asset::{Asset, Info};

/// A tracer, and the schedule that it works by.
pub struct Spread {
    tracer: DepthTracer,
    schedule: Schedule,
    info: Info,
}

impl Spread {
    /// For an asset; builds what the first light would have to wait for.
    ///
    /// # Errors
    /// An asset whose mesh or medium makes no sense.
    pub fn new(asset: &Asset, settings: Settings) -> Result<Self> {
        let tracer = DepthTracer::new(asset)?;
        tracer.prepare();
        Ok(Self::with(tracer, settings))
    }

    /// By a tracer that is there.
    pub fn with(tracer: DepthTracer, settings: Settings) -> Self {
        let info = tracer.info().clone();
        Self { tracer, schedule: Schedule::new(settings), info }
    }

    /// Bytes of the depths that are kept.
    pub fn kept_bytes(&self) -> u64 {
        self.schedule.kept_bytes()
    }

    /// Builds what the first light would have to wait for.
    pub fn prepare(&self) {
        self.tracer.prepare();
    }

    /// Traces on the CPU from now on.
    pub fn use_cpu(&mut self) {
        self.tracer.use_cpu();
    }

    /// Sets the bytes that complete depths may take from now on.
    pub fn set_memory(&mut self, bytes: u64) {
        self.schedule.set_memory(bytes);
    }

    /// Takes extinction and albedo from an edited asset's parameters.
    pub fn set_material(&mut self, info: &Info) {
        if info.extinction != self.info.extinction {
            self.schedule.change_material();
            self.tracer.set_material(info);
        }
        self.info = info.clone();
    }

    /// Sets the milliseconds of the frames to come.
    pub fn set_milliseconds(&mut self, milliseconds: f64) {
        self.schedule.set_milliseconds(milliseconds);
    }

    /// Call it once for each frame that is drawn. [`LightMode::Baked`] wants exact depths for no light, [`LightMode::Exact`] for
    /// all of the scene's as soon as they stand still, [`LightMode::Auto`] for those that are marked, those that have come to
    /// rest, and at once for those inside the bounding box. Lights that reach nothing, and directional ones among so many that
    /// they are folded, are not traced unless they are marked.
    pub fn advance(&mut self, frame: &Frame, mode: LightMode) -> ExactDepths {
        let reach = reach(frame, &self.info);
        let mut wishes = vec![Wish::Baked; frame.lights.len()];
        for (i, wish) in wishes.iter_mut().enumerate().take(frame.scene_lights) {
            let light = &frame.lights[i];
            *wish = match mode {
                LightMode::Baked => Wish::Baked,
                _ if light.exact || mode == LightMode::Exact => Wish::Marked(reach.most(i)),
                _ if reach.is_lit(i) && !reach.folds(light) => Wish::AtRest(reach.most(i)),
                _ => Wish::Baked,
            };
        }
        if mode != LightMode::Baked {
            frame.lights_inside(&self.info).into_iter().for_each(|i| wishes[i] = Wish::AtOnce);
        }
        let exact = self.schedule.advance(&frame.lights, &wishes, &mut (&self.tracer, frame.least_distance));
        self.schedule.set_on_gpu(self.tracer.is_on_gpu());
        exact
    }

    /// Whether the next frames will differ from the last one although nothing moves.
    pub fn is_busy(&self) -> bool {
        self.schedule.is_busy()
    }

    /// Traces on a GPU from now on, see [`DepthTracer::use_gpu`].
    pub fn use_gpu(&mut self, device: &GpuDevice) -> bool {
        self.tracer.use_gpu(device)
    }

    /// What the last frame was like.
    pub fn report(&self) -> &ExactReport {
        self.schedule.report()
    }
}
