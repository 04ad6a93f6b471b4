//! Exact depths of a host's lights: of every object and level for itself, because lights stand elsewhere in its coordinates, but
//! with the milliseconds and the memory of one.

use crate::Result;
use crate::exact::{DepthTracer, ExactDepths, Settings, Spread};
use crate::frame::Frame;
use crate::player::LightMode;
use diaphane_formats::asset::{Asset, Info};

/// What traces for the objects of an asset, by level.
pub(super) struct Tracers(Vec<DepthTracer>);

impl Tracers {
    /// # Errors
    /// An asset whose mesh or medium makes no sense.
    pub fn new(asset: &Asset) -> Result<Self> {
        let all = DepthTracer::new(asset)?;
        let coarser = (1..asset.level_sizes().len())
            .map(|k| Ok(all.for_level(&asset.level(k)?)))
            .collect::<Result<Vec<_>>>()?;
        let tracers: Vec<DepthTracer> = std::iter::once(all).chain(coarser).collect();
        tracers.iter().for_each(DepthTracer::prepare);
        Ok(Self(tracers))
    }
}

/// The levels of one object that are drawn, and who traces for each.
#[derive(Default)]
pub(super) struct Spreads(Vec<(usize, Spread)>);

impl Spreads {
    /// Forgets levels that are not drawn any more, and sees that there is one for each that is.
    pub fn follow(&mut self, levels: &[usize], tracers: &Tracers, info: &Info, settings: Settings) {
        self.0.retain(|(level, _)| levels.contains(level));
        for level in levels {
            if !self.0.iter().any(|(known, _)| known == level)
                && let Some(tracer) = tracers.0.get(*level)
            {
                let mut spread = Spread::with(tracer.another(), settings);
                spread.set_material(info);
                spread.prepare();
                self.0.push((*level, spread));
            }
        }
    }

    pub fn set_material(&mut self, info: &Info) {
        self.0.iter_mut().for_each(|(_, s)| s.set_material(info));
    }

    pub fn is_busy(&self) -> bool {
        self.0.iter().any(|(_, s)| s.is_busy())
    }

    /// A frame of one level; `None` where it has baked depths alone.
    pub fn advance(&mut self, level: usize, frame: &Frame, pool: &mut Budget) -> Option<ExactDepths> {
        let (_, spread) = self.0.iter_mut().find(|(known, _)| *known == level)?;
        spread.set_milliseconds(pool.milliseconds);
        spread.set_memory(pool.bytes);
        let exact = spread.advance(frame, LightMode::Auto);
        pool.bytes = pool.bytes.saturating_sub(spread.kept_bytes());
        let report = spread.report();
        pool.milliseconds = (pool.milliseconds - report.milliseconds).max(0.0);
        pool.exact += report.exact;
        pool.waiting += report.waiting + report.crowded;
        pool.rays += report.rays;
        (!exact.is_empty()).then_some(exact)
    }
}

/// What is left for the objects to come, and what those before them did.
pub(super) struct Budget {
    milliseconds: f64,
    bytes: u64,
    /// Lights with exact depths, summed over objects.
    pub exact: usize,
    /// Lights that wait for theirs.
    pub waiting: usize,
    /// Samples times lights that were traced.
    pub rays: u64,
}

impl Budget {
    /// Of a frame; tables of all objects together, half of what is kept, must fit `binding` bytes.
    pub fn new(settings: Settings, binding: u64) -> Self {
        let bytes = settings.memory.min(binding.saturating_mul(2));
        Self { milliseconds: settings.milliseconds, bytes, exact: 0, waiting: 0, rays: 0 }
    }
}
