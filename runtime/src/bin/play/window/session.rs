//! What is looked at, from where and under which light.

use super::orbit::Orbit;
use anyhow::Result;
use diaphane_formats::asset::{Asset, Info};
use diaphane_formats::scene::{Camera, Scene};
use diaphane_runtime::edit::Edit;
use diaphane_runtime::exact::{ExactDepths, ExactReport, Settings, Spread};
use diaphane_runtime::frame::{Frame, FrameLight};
use diaphane_runtime::player::LightMode;

/// Rays of each pixel that a picture at rest gets.
pub const RAYS: u32 = 16;

/// Part of a frame's time that exact depths may take, where that is more than their milliseconds: on adapters that are slow a few
/// milliseconds do not show.
const SHARE: f64 = 0.1;

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
    /// The scene's camera as it was given.
    camera: Camera,
    /// Lights that stand for the environment, projected once.
    environment: Vec<FrameLight>,
    /// Exact depths, a part in each frame.
    spread: Spread,
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
            spread: Spread::new(&asset, Settings::DEFAULT)?,
            first_orbit: orbit,
            camera: scene.camera,
            asset,
            scene,
            mode,
            edit,
            orbit,
        })
    }

    /// Shows another asset: lights, camera and material stay as the user left them.
    ///
    /// # Errors
    /// As [`Self::new`]; the session then stays as it was.
    pub fn replace_asset(&mut self, asset: Asset) -> Result<()> {
        let next = Self::new(asset, self.scene.clone(), self.mode, self.edit)?;
        let (orbit, first_orbit, camera) = (self.orbit, self.first_orbit, self.camera);
        *self = Self { orbit, first_orbit, camera, ..next };
        Ok(())
    }

    /// Shows the asset in another scene. The user's camera stays unless the scene's is another one.
    ///
    /// # Errors
    /// As [`Self::new`]; the session then stays as it was.
    pub fn replace_scene(&mut self, scene: Scene) -> Result<()> {
        let all = Frame::new(&scene, &self.asset.info)?;
        self.environment = all.lights[all.scene_lights..].to_vec();
        if scene.camera != self.camera {
            self.camera = scene.camera;
            self.first_orbit = Orbit::new(&scene.camera, f64::from(self.asset.info.diagonal()));
            self.orbit = self.first_orbit;
        }
        self.scene = scene;
        Ok(())
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

    /// What the next frame knows of its lights beyond the baked depths. The frame before took `milliseconds`.
    pub fn advance(&mut self, frame: &Frame, milliseconds: f64) -> Option<ExactDepths> {
        self.spread.set_milliseconds(Settings::DEFAULT.milliseconds.max(SHARE * milliseconds));
        let exact = self.spread.advance(frame, self.mode);
        (!exact.is_empty()).then_some(exact)
    }

    /// Takes over the material.
    ///
    /// # Errors
    /// Values out of range.
    pub fn set_material(&mut self) -> Result<Info> {
        let info = self.edit.apply(&self.asset.info)?;
        self.spread.set_material(&info);
        Ok(info)
    }

    /// Whether exact depths are on their way.
    pub fn is_busy(&self) -> bool {
        self.spread.is_busy()
    }

    /// What became of exact depths in the last frame.
    pub fn exact_report(&self) -> &ExactReport {
        self.spread.report()
    }
}
