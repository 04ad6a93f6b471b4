//! What is looked at, from where and under which light.

use super::orbit::Orbit;
use anyhow::Result;
use diaphane_formats::asset::Asset;
use diaphane_formats::scene::Scene;
use diaphane_runtime::edit::Edit;
use diaphane_runtime::exact::{DepthTracer, ExactDepths};
use diaphane_runtime::frame::{Frame, FrameLight};
use diaphane_runtime::player::LightMode;

/// Rays of each pixel that a picture at rest gets.
pub const RAYS: u32 = 16;

/// An asset, its scene, and what the user made of it.
pub struct Session {
    pub asset: Asset,
    /// Lights and surface; camera and size come from elsewhere.
    pub scene: Scene,
    pub mode: LightMode,
    /// The material, relative to the baked one.
    pub edit: Edit,
    pub orbit: Orbit,
    pub first_orbit: Orbit,
    /// Lights that stand for the environment, projected once.
    environment: Vec<FrameLight>,
    tracer: DepthTracer,
}

impl Session {
    /// Starts with a scene.
    ///
    /// # Errors
    /// A scene, asset or edit that makes no sense.
    pub fn new(asset: Asset, scene: Scene, mode: LightMode, edit: Edit) -> Result<Self> {
        edit.validate()?;
        let all = Frame::new(&scene, &asset.info)?;
        let orbit = Orbit::new(&scene.camera, f64::from(asset.info.diagonal()));
        Ok(Self {
            environment: all.lights[all.scene_lights..].to_vec(),
            tracer: DepthTracer::new(&asset)?,
            first_orbit: orbit,
            asset,
            scene,
            mode,
            edit,
            orbit,
        })
    }

    /// The frame for a picture at `place` (left, top, width, height in pixels), with a pixel for `divisor` × `divisor`
    /// of the window's.
    ///
    /// # Errors
    /// A camera that makes no rays.
    pub fn frame(&mut self, [_, _, width, height]: [f32; 4], divisor: u32) -> Result<Frame> {
        let scene = &mut self.scene;
        scene.camera = self.orbit.camera();
        scene.image.width = (width as u32).div_ceil(divisor).max(1);
        scene.image.height = (height as u32).div_ceil(divisor).max(1);
        scene.image.samples_per_pixel = RAYS;
        let sky = scene.environment.take();
        let frame = Frame::new(scene, &self.asset.info);
        scene.environment = sky;
        let mut frame = frame?;
        frame.lights.extend_from_slice(&self.environment);
        Ok(frame)
    }

    /// Exact depths of the lights that the mode wants them for.
    pub fn trace(&mut self, frame: &Frame) -> Option<ExactDepths> {
        let wanted = match self.mode {
            LightMode::Baked => Vec::new(),
            LightMode::Exact => (0..frame.scene_lights).collect(),
            LightMode::Auto => frame.lights_inside(&self.asset.info),
        };
        (!wanted.is_empty()).then(|| self.tracer.trace(frame, &wanted))
    }
}
