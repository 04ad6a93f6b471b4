//! One renderer, whichever backend draws: what the command line, the window and the validation call.

mod recovery;

use crate::cpu::CpuRenderer;
use crate::edit::Edit;
use crate::exact::{DepthTracer, ExactDepths, ExactReport, Settings, Spread};
use crate::frame::Frame;
use crate::gpu::{GpuRenderer, SplatPath};
use crate::rendered::Rendered;
use crate::{Error, Result};
use diaphane_formats::asset::{Asset, Info};
use std::time::Instant;

/// Which backend to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// The GPU where there is one, the CPU otherwise. A software adapter does not count: the CPU renderer takes a
    /// fifth of its time on the same machine.
    #[default]
    Auto,
    /// The GPU or an error.
    Gpu,
    /// The CPU.
    Cpu,
}

/// Where the optical depth from the samples to the lights comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightMode {
    /// The baked spherical harmonics, which run to infinity.
    #[default]
    Baked,
    /// Rays to every light of the scene (those of the environment stay baked).
    Exact,
    /// Rays to lights inside the object's bounding box and to those that the scene marks exact; where depths are spread over
    /// frames ([`Player::spread`]) to all that have come to rest. Baked depths for the others.
    Auto,
}

/// The backend at work.
enum Engine {
    Cpu(Box<CpuRenderer>),
    Gpu(Box<GpuRenderer>),
    /// It failed.
    Closed,
}

/// Plays one asset.
pub struct Player {
    engine: Engine,
    note: Option<String>,
    /// What was asked for.
    backend: Backend,
    path: Option<SplatPath>,
    baked: Info,
    /// Of the material that is played.
    info: Info,
    tracer: DepthTracer,
    /// Where depths are spread over frames.
    spread: Option<Spread>,
    /// Whether somebody has been asked to trace in place of the CPU.
    asked: bool,
    reuse: bool,
    counting: bool,
    last: Option<(Frame, LightMode, Rendered)>,
}

impl Player {
    /// Prepares an asset on a backend. [`Backend::Auto`] falls back to the CPU and says why in [`Player::note`].
    ///
    /// # Errors
    /// An asset that makes no sense; no GPU where one is demanded.
    pub fn new(asset: &Asset, backend: Backend) -> Result<Self> {
        Self::with_path(asset, backend, None)
    }

    /// As [`Self::new`]; on a GPU kernels are summed along `path`.
    ///
    /// # Errors
    /// As [`Self::new`]; a path that the adapter cannot take.
    pub fn with_path(asset: &Asset, backend: Backend, path: Option<SplatPath>) -> Result<Self> {
        let (engine, note) = open(asset, backend, path)?;
        let tracer = DepthTracer::new(asset)?;
        Ok(Self {
            engine,
            note,
            backend,
            path,
            baked: asset.info.clone(),
            info: asset.info.clone(),
            tracer,
            spread: None,
            asked: false,
            reuse: false,
            counting: false,
            last: None,
        })
    }

    /// Why the backend is not the one that would have been preferred.
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// The same, told once.
    pub fn take_note(&mut self) -> Option<String> {
        self.note.take()
    }

    /// The GPU's device; `None` on the CPU.
    pub fn device(&self) -> Option<&wgpu::Device> {
        match &self.engine {
            Engine::Cpu(_) | Engine::Closed => None,
            Engine::Gpu(gpu) => Some(gpu.device()),
        }
    }

    /// The backend ("gpu" or "cpu") and the adapter's name.
    pub fn describe(&self) -> (&'static str, String) {
        match &self.engine {
            Engine::Cpu(_) => ("cpu", format!("{} threads", rayon::current_num_threads())),
            Engine::Gpu(gpu) => ("gpu", gpu.adapter().to_owned()),
            Engine::Closed => ("none", "closed when the GPU failed".to_owned()),
        }
    }

    /// How kernels are summed; `None` on the CPU.
    pub fn path(&self) -> Option<SplatPath> {
        match &self.engine {
            Engine::Cpu(_) | Engine::Closed => None,
            Engine::Gpu(gpu) => Some(gpu.path()),
        }
    }

    /// Why kernels are summed in this way; `None` on the CPU.
    pub fn why_path(&self) -> Option<&'static str> {
        let device = self.device()?;
        Some(if self.path.is_some() { "asked for" } else { SplatPath::why_best(device) })
    }

    /// Whether times of passes come from the adapter's own clock; `None` on the CPU.
    pub fn has_clock(&self) -> Option<bool> {
        self.device().map(|device| device.features().contains(wgpu::Features::TIMESTAMP_QUERY))
    }

    /// Whether later frames may keep what an unchanged frame computed before. Off at first: every frame redoes every
    /// pass.
    pub fn set_reuse(&mut self, reuse: bool) {
        self.reuse = reuse;
        match &mut self.engine {
            Engine::Cpu(cpu) => cpu.set_reuse(reuse),
            Engine::Gpu(gpu) => gpu.set_reuse(reuse),
            Engine::Closed => {}
        }
    }

    /// Parts that a GPU's bindings cut the samples into; `None` on the CPU.
    pub fn shards(&self) -> Option<usize> {
        match &self.engine {
            Engine::Cpu(_) | Engine::Closed => None,
            Engine::Gpu(gpu) => Some(gpu.shards()),
        }
    }

    /// Whether [`crate::rendered::Census`] is wanted, which costs the CPU some time; a GPU always takes it. Off at first.
    pub fn set_counting(&mut self, counting: bool) {
        self.counting = counting;
        if let Engine::Cpu(cpu) = &mut self.engine {
            cpu.set_counting(counting);
        }
    }

    /// Spreads exact depths over the frames to come, as a window does ([`Spread`]): each frame does a part of the work, and lights
    /// go from baked to exact depths without a jump. `None`, as at first, has all of a frame's depths in that frame. `asset` is
    /// the one that the player was made of.
    ///
    /// # Errors
    /// An asset whose mesh or medium makes no sense.
    pub fn spread(&mut self, asset: &Asset, settings: Option<Settings>) -> Result<()> {
        self.spread = settings.map(|s| Spread::new(asset, s)).transpose()?;
        self.asked = false;
        if let Some(spread) = &mut self.spread {
            spread.set_material(&self.info);
        }
        self.last = None;
        Ok(())
    }

    /// Has the GPU trace exact depths, which hardware does by itself as soon as a light asks for them, and a software adapter
    /// only when told to: it is slower than the CPU. Says whether it does; it does not where there is none, the medium is uneven,
    /// shells overlap, or it finds other depths than the CPU.
    pub fn trace_on_gpu(&mut self) -> bool {
        self.asked = true;
        let Engine::Gpu(gpu) = &self.engine else { return false };
        let spread = self.spread.as_mut().map(|s| s.use_gpu(gpu.owned()));
        spread.unwrap_or_else(|| self.tracer.use_gpu(gpu.owned()))
    }

    /// Whether the next frames will differ from the last one although nothing moves.
    pub fn is_busy(&self) -> bool {
        self.spread.as_ref().is_some_and(Spread::is_busy)
    }

    /// Plays another extinction and albedo from the next frame on, relative to those that were baked: edits do not
    /// add up, and [`Edit::default`] brings the baked material back to the bit. Costs a few bytes to the GPU, or an
    /// operation a sample on the CPU.
    ///
    /// # Errors
    /// Values out of range; the player then stays as it was.
    pub fn edit(&mut self, edit: &Edit) -> Result<()> {
        self.info = edit.apply(&self.baked)?;
        match &mut self.engine {
            Engine::Cpu(cpu) => cpu.set_material(&self.info),
            Engine::Gpu(gpu) => gpu.set_material(&self.info),
            Engine::Closed => {}
        }
        self.tracer.set_material(&self.info);
        if let Some(spread) = &mut self.spread {
            spread.set_material(&self.info);
        }
        self.last = None;
        Ok(())
    }

    /// The asset's parameters, extinction and albedo as they are played.
    pub fn info(&self) -> &Info {
        &self.info
    }

    /// Draws a frame. Where an unchanged frame is reused nothing is copied, and the list of passes is empty.
    ///
    /// # Errors
    /// The GPU failed.
    pub fn render(&mut self, frame: &Frame, mode: LightMode) -> Result<Rendered> {
        if self.reuse
            && !self.is_busy()
            && let Some((last, last_mode, rendered)) = &self.last
            && last == frame
            && *last_mode == mode
        {
            return Ok(rendered.clone());
        }
        // Its picture may be drawn on again.
        self.last = None;
        let started = Instant::now();
        let (exact, report) = self.exact(frame, mode);
        let exact_ms = started.elapsed().as_secs_f64() * 1e3;
        let mut rendered = match &mut self.engine {
            Engine::Cpu(cpu) => cpu.render(frame, exact.as_ref()),
            Engine::Gpu(gpu) => gpu.render(frame, exact.as_ref())?,
            Engine::Closed => return Err(Error::Gpu("it failed before and was closed".to_owned())),
        };
        if exact.is_some() {
            rendered.passes.insert(0, ("exact depths", exact_ms));
        }
        rendered.exact = report;
        if self.reuse {
            self.last = Some((frame.clone(), mode, Rendered { passes: Vec::new(), ..rendered.clone() }));
        }
        Ok(rendered)
    }

    /// The exact depths that `mode` asks for, `None` when the baked ones serve all lights; and what they cost.
    fn exact(&mut self, frame: &Frame, mode: LightMode) -> (Option<ExactDepths>, ExactReport) {
        let hardware = matches!(&self.engine, Engine::Gpu(gpu) if !is_software(gpu));
        if hardware && !self.asked && mode != LightMode::Baked {
            self.trace_on_gpu();
        }
        if let Some(spread) = &mut self.spread {
            let exact = spread.advance(frame, mode);
            return ((!exact.is_empty()).then_some(exact), spread.report().clone());
        }
        let wanted = mode.wanted(frame, &self.info);
        if wanted.is_empty() {
            return (None, ExactReport { baked: frame.lights.len(), ..ExactReport::default() });
        }
        if !self.reuse {
            self.tracer.forget();
        }
        let exact = self.tracer.trace(frame, &wanted);
        (Some(exact), self.tracer.report().clone())
    }
}

impl LightMode {
    /// Lights whose depths are exact where a frame has all of them at once, by index.
    pub fn wanted(self, frame: &Frame, info: &Info) -> Vec<usize> {
        match self {
            Self::Baked => Vec::new(),
            Self::Exact => (0..frame.scene_lights).collect(),
            Self::Auto => {
                let mut wanted = frame.lights_inside(info);
                wanted.extend(frame.lights_marked());
                wanted.sort_unstable();
                wanted.dedup();
                wanted
            }
        }
    }
}

fn open(asset: &Asset, backend: Backend, path: Option<SplatPath>) -> Result<(Engine, Option<String>)> {
    let cpu = || -> Result<Engine> { Ok(Engine::Cpu(Box::new(CpuRenderer::new(asset)?))) };
    let gpu = || -> Result<Engine> { Ok(Engine::Gpu(Box::new(GpuRenderer::new(asset, path)?))) };
    match backend {
        Backend::Cpu => Ok((cpu()?, None)),
        Backend::Gpu => Ok((gpu()?, None)),
        Backend::Auto => match gpu() {
            Ok(Engine::Gpu(gpu)) if is_software(&gpu) => {
                let why =
                    format!("{} is slower than this program on the CPU; drawing on the CPU", gpu.adapter());
                Ok((cpu()?, Some(why)))
            }
            Ok(engine) => Ok((engine, None)),
            Err(Error::NoAdapter(why)) => {
                Ok((cpu()?, Some(format!("no usable GPU ({why}); drawing on the CPU"))))
            }
            Err(e @ (Error::Gpu(_) | Error::GpuMemory(_) | Error::Lost(_))) => {
                Ok((cpu()?, Some(format!("{e}; drawing on the CPU"))))
            }
            Err(other) => Err(other),
        },
    }
}

/// Whether the adapter is a program itself: its description ends with that word.
fn is_software(gpu: &GpuRenderer) -> bool {
    gpu.adapter().ends_with("software)")
}
