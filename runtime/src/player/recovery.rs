//! What becomes of a player whose GPU fails.

use super::{Backend, Engine, LightMode, Player};
use crate::cpu::CpuRenderer;
use crate::exact::Spread;
use crate::frame::Frame;
use crate::gpu::GpuRenderer;
use crate::rendered::Rendered;
use crate::{Error, Result};
use diaphane_formats::asset::Asset;

impl Player {
    /// As [`Self::render`]. Where the GPU is lost, has no memory left or fails it is opened once more and draws the frame from
    /// the start; where that is in vain too the CPU draws from then on, unless the GPU was demanded. [`Self::note`] tells of both.
    /// `asset` is the one that the player was made of.
    ///
    /// # Errors
    /// The GPU failed twice and was demanded.
    pub fn render_anyway(&mut self, asset: &Asset, frame: &Frame, mode: LightMode) -> Result<Rendered> {
        let path = self.path;
        match self.render(frame, mode) {
            Err(e @ (Error::Lost(_) | Error::GpuMemory(_) | Error::Gpu(_))) => {
                self.recover(asset, frame, mode, &e, || {
                    Ok(Engine::Gpu(Box::new(GpuRenderer::new(asset, path)?)))
                })
            }
            done => done,
        }
    }

    /// Draws with another GPU renderer after `failure`, or with the CPU.
    fn recover(
        &mut self,
        asset: &Asset,
        frame: &Frame,
        mode: LightMode,
        failure: &Error,
        gpu: impl FnOnce() -> Result<Engine>,
    ) -> Result<Rendered> {
        // What is left of the old one may be all the memory that there is.
        self.engine = Engine::Closed;
        self.tracer.use_cpu();
        self.spread.iter_mut().for_each(Spread::use_cpu);
        let again = gpu().and_then(|engine| {
            self.replace(engine);
            self.render(frame, mode)
        });
        match again {
            Ok(rendered) => {
                self.note = Some(format!("the GPU was opened again and drew the frame anew: {failure}"));
                Ok(rendered)
            }
            Err(second) if self.backend == Backend::Gpu => {
                self.engine = Engine::Closed;
                Err(Error::Gpu(format!("{failure}; opened again: {second}")))
            }
            Err(second) => {
                self.replace(Engine::Cpu(Box::new(CpuRenderer::new(asset)?)));
                self.note =
                    Some(format!("drawing on the CPU from now on: {failure}; opened again: {second}"));
                self.render(frame, mode)
            }
        }
    }

    /// Goes on with another engine where the last one was.
    fn replace(&mut self, engine: Engine) {
        self.engine = engine;
        self.last = None;
        self.asked = false;
        self.set_reuse(self.reuse);
        self.set_counting(self.counting);
        match &mut self.engine {
            Engine::Cpu(cpu) => cpu.set_material(&self.info),
            Engine::Gpu(gpu) => gpu.set_material(&self.info),
            Engine::Closed => {}
        }
    }
}

#[cfg(test)]
#[path = "../../tests/gpu/objects.rs"]
#[allow(dead_code, missing_docs, reason = "shared with the tests of the GPU")]
mod objects;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::Edit;
    use crate::framing::default_scene;

    fn gone() -> Error {
        Error::NoAdapter("unplugged".to_owned())
    }

    /// What a player of `backend` that has failed does when no GPU can be opened any more.
    fn without_gpu(backend: Backend) -> (Player, Result<Rendered>, Rendered) {
        let asset = objects::Object { spacing: 0.4, ..objects::ball() }.build();
        let mut scene = default_scene(&asset.info);
        (scene.image.width, scene.image.height, scene.image.samples_per_pixel) = (16, 16, 1);
        let frame = Frame::new(&scene, &asset.info).unwrap();
        let edit = Edit { albedo: Some(glam::DVec3::splat(0.3)), ..Edit::default() };
        let mut cpu = Player::new(&asset, Backend::Cpu).unwrap();
        cpu.edit(&edit).unwrap();
        let expected = cpu.render(&frame, LightMode::Baked).unwrap();
        let mut player = Player { backend, ..Player::new(&asset, Backend::Cpu).unwrap() };
        player.edit(&edit).unwrap();
        let failure = Error::Lost("reset".to_owned());
        let done = player.recover(&asset, &frame, LightMode::Baked, &failure, || Err(gone()));
        (player, done, expected)
    }

    #[test]
    fn the_cpu_takes_over_with_the_same_material_and_says_why() {
        let (mut player, done, expected) = without_gpu(Backend::Auto);
        assert_eq!(done.unwrap().picture.pixels, expected.picture.pixels);
        assert_eq!(player.describe().0, "cpu");
        let note = player.take_note().unwrap();
        assert!(["reset", "unplugged", "on the CPU"].iter().all(|part| note.contains(part)), "{note}");
    }

    #[test]
    fn a_gpu_that_was_demanded_is_never_replaced() {
        let (player, done, _) = without_gpu(Backend::Gpu);
        let error = done.err().unwrap().to_string();
        assert!(error.contains("reset") && error.contains("unplugged"), "{error}");
        assert_eq!(player.describe().0, "none");
    }
}
