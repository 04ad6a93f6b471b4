//! Which objects are in sight, with which levels of detail, and what serves their lights.

use super::exact::Budget;
use super::{HostFrame, HostReport, Instance, Levels, Renderer};
use crate::Result;
use crate::detail::{Choice, pixels_at_nearest};
use crate::exact::ExactDepths;
use crate::frame::Frame;
use crate::gpu::bindings::most_bound;
use crate::gpu::targets::{TOTAL, budget};
use crate::gpu::tiles::{Tile, split};
use crate::placement::covered;
use wgpu::{Device, Queue};

/// An object that is in sight.
pub(super) struct Visible {
    pub instance: usize,
    pub choice: Choice,
    pub frame: Frame,
    pub tiles: Vec<Tile>,
    /// Its units of a world unit.
    pub per_unit: f32,
}

/// Which pool draws something: of an asset, a level, one of its pools.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PoolId {
    pub asset: usize,
    pub level: usize,
    pub pool: usize,
}

/// A level of an object that is in sight, by its place among these.
pub(super) struct Part {
    pub visible: usize,
    pub pool: PoolId,
    pub slot: usize,
    /// See view.wgsl.
    pub share: f32,
}

impl Renderer {
    /// Objects in sight, the nearest first.
    pub(super) fn visible(
        &self,
        device: &Device,
        host: &HostFrame<'_>,
    ) -> Result<(Vec<Visible>, HostReport)> {
        let mut report = HostReport::default();
        let mut visible = Vec::new();
        for (index, instance) in self.instances.iter().enumerate() {
            let Some(Instance { placement, info, .. }) = instance else { continue };
            let Some(levels) = self.levels_of(index) else { continue };
            let HostFrame { size, lights, environment, surface, .. } = *host;
            let mut frame = host.camera.frame(size, lights, environment, surface, placement, info);
            let marked = frame.lights.iter_mut().zip(host.exact).take(lights.len());
            marked.for_each(|(light, exact)| light.exact = *exact);
            let Some([low, high]) = covered(&frame, info) else {
                report.culled += 1;
                continue;
            };
            let state = levels.pipelines[0].asset.pixel_state();
            let budget = budget(device, state, TOTAL);
            let mut tiles = split(high[0] - low[0], high[1] - low[1], budget)?;
            tiles.iter_mut().for_each(|t| t.start = [t.start[0] + low[0], t.start[1] + low[1]]);
            report.drawn += 1;
            report.tiles += tiles.len();
            let distance = host.camera.distance(placement.centre(info));
            let pixels = pixels_at_nearest(&frame, info);
            let choice = self.fineness.choose(&levels.details, pixels, state.heterogeneous);
            report.fading += usize::from(choice.coarser > 0.0);
            let samples = |(level, _): (usize, f32)| u64::from(levels.pipelines[level].asset.sample_count);
            report.samples += shares(choice).map(samples).sum::<u64>();
            let per_unit = (1.0 / placement.scale) as f32;
            visible.push((distance, Visible { instance: index, choice, frame, tiles, per_unit }));
        }
        visible.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok((visible.into_iter().map(|(_, v)| v).collect(), report))
    }

    pub(super) fn levels_of(&self, instance: usize) -> Option<&Levels> {
        let instance = self.instances.get(instance)?.as_ref()?;
        self.assets.get(instance.asset)?.as_ref()
    }

    /// The levels of all objects in sight, the nearest object first, and where they are drawn.
    pub(super) fn parts(&mut self, device: &Device, queue: &Queue, visible: &[Visible]) -> Vec<Part> {
        let mut parts = Vec::new();
        for (v, seen) in visible.iter().enumerate() {
            let Some(Some(Instance { asset, info, .. })) = self.instances.get(seen.instance) else {
                continue;
            };
            let Some(Some(levels)) = self.assets.get_mut(*asset) else { continue };
            for (level, share) in shares(seen.choice) {
                let pipeline = &levels.pipelines[level];
                let baked = &pipeline.asset.info;
                let is_edited = baked.extinction != info.extinction || baked.albedo != info.albedo;
                let berth = levels.pools[level].place(
                    device,
                    queue,
                    pipeline,
                    seen.instance,
                    is_edited.then_some(info),
                );
                let pool = PoolId { asset: *asset, level, pool: berth.pool };
                parts.push(Part { visible: v, pool, slot: berth.slot, share });
            }
        }
        parts
    }

    /// Traces for as long as the frame may take, for the nearest objects first; what serves the lights of each part now.
    pub(super) fn trace(
        &mut self,
        device: &Device,
        visible: &[Visible],
        parts: &[Part],
    ) -> Vec<Option<ExactDepths>> {
        let Some(settings) = self.exact else { return parts.iter().map(|_| None).collect() };
        for (k, instance) in self.instances.iter_mut().enumerate() {
            let Some(Instance { asset, info, spreads, .. }) = instance else { continue };
            // Those out of sight keep nothing, and nobody waits for them.
            let mine = parts.iter().filter(|p| visible[p.visible].instance == k);
            let levels: Vec<usize> = mine.map(|p| p.pool.level).collect();
            if let Some(Some(Levels { tracers: Some(tracers), .. })) = self.assets.get(*asset) {
                spreads.follow(&levels, tracers, info, settings);
            }
        }
        let mut budget = Budget::new(settings, most_bound(device));
        let mut exact = Vec::with_capacity(parts.len());
        for part in parts {
            let seen = &visible[part.visible];
            let instance = self.instances.get_mut(seen.instance).and_then(Option::as_mut);
            exact.push(instance.and_then(|i| i.spreads.advance(part.pool.level, &seen.frame, &mut budget)));
        }
        (self.report.exact, self.report.waiting, self.report.rays) =
            (budget.exact, budget.waiting, budget.rays);
        exact
    }
}

/// The levels to draw, one after the other, and their shares as view.wgsl knows them.
fn shares(choice: Choice) -> impl Iterator<Item = (usize, f32)> {
    let Choice { level, coarser } = choice;
    let (first, second) = match coarser > 0.0 {
        true => ((level, coarser - 1.0), Some((level + 1, coarser))),
        false => ((level, 1.0), None),
    };
    std::iter::once(first).chain(second)
}
