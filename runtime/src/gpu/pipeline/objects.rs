//! The objects of a frame: which are lit anew, and how the camera sees each.

use super::Pipeline;
use crate::Result;
use crate::fold::{LightCounts, LightingKey};
use crate::frame::Frame;
use crate::gpu::frame::Object;
use crate::gpu::lot::Lot;
use crate::gpu::tiles::Tile;
use crate::gpu::uniforms::ViewUniform;
use wgpu::{Device, Queue};

/// One tile of an object, as it is drawn with others.
pub(in crate::gpu) struct Drawn<'a> {
    pub slot: usize,
    pub frame: &'a Frame,
    pub tile: Tile,
    /// `share` of view.wgsl.
    pub share: f32,
    /// The object's units of a world unit.
    pub per_unit: f32,
}

impl Pipeline {
    /// Uploads the lights of objects that need other sources.
    pub(super) fn light(&mut self, device: &Device, queue: &Queue, objects: &[Object<'_>]) -> Result<()> {
        let lights = objects.iter().map(|o| o.frame.lights.len()).max().unwrap_or(0);
        self.lit.resize(self.asset.slots, None);
        if self.frame.reserve(device, self.asset.slots, lights)? {
            self.lit.fill(None);
        }
        self.frame.keep_tables(objects);
        let mut stale = Vec::new();
        self.pending.clear();
        for object in objects {
            let key = LightingKey::new(object.frame, &self.asset.info, object.exact);
            if !self.reuse || self.lit[object.slot].as_ref() != Some(&key) {
                // Not before all went well.
                self.lit[object.slot] = None;
                self.pending.push((object.slot, key));
                stale.push(*object);
            }
        }
        self.relit = if stale.is_empty() {
            Vec::new()
        } else {
            self.frame.write_lights(device, queue, &self.asset, &stale)?
        };
        self.relit.sort_by_key(|lit| std::cmp::Reverse(lit.lights));
        let frame_of = |slot: usize| stale.iter().find(|o| o.slot == slot).map(|o| o.frame);
        let pixel = Tile { start: [0; 2], size: [1; 2] };
        self.views.clear();
        for lit in &self.relit {
            self.views.extend(frame_of(lit.slot).map(|f| self.view(lit.slot, f, pixel, [0.5; 2], 1)));
        }
        Ok(())
    }

    /// Remembers what the sources depend on that are made now.
    pub(super) fn keep_lit(&mut self) {
        self.lit.resize(self.asset.slots, None);
        for (slot, key) in self.pending.drain(..) {
            self.lit[slot] = Some(key);
        }
    }

    /// Makes room for the values and sources of so many objects; those that are there are gone then.
    pub(in crate::gpu) fn set_slots(&mut self, device: &Device, slots: usize) {
        self.asset = self.asset.with_slots(device, slots);
        self.lit.clear();
        self.targets = None;
    }

    pub(super) fn view(
        &self,
        slot: usize,
        frame: &Frame,
        tile: Tile,
        offset: [f32; 2],
        rays: u32,
    ) -> ViewUniform {
        ViewUniform::new(frame, self.asset.diagonal, tile, offset, rays, self.frame.layout(slot))
    }

    /// Uploads the rays of some tiles of the object that was begun: view `t * offsets.len() + o` is offset o in tile t, added to
    /// pictures of `before` rays.
    pub(in crate::gpu) fn write_views(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame,
        tiles: &[Tile],
        offsets: &[[f32; 2]],
        before: u32,
    ) {
        self.views.truncate(self.relit.len());
        for &tile in tiles {
            for (&offset, rays) in offsets.iter().zip(before + 1..) {
                let view = self.view(0, frame, tile, offset, rays);
                self.views.push(view.of(&self.cut(tile.into())));
            }
        }
        self.upload_views(device, queue);
    }

    /// Uploads the rays of a tile of the object that was begun. Returns what is drawn one after the other: rays side by side, and the
    /// view that is their first.
    pub(in crate::gpu) fn write_rays(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &Frame,
        tile: Tile,
        offsets: &[[f32; 2]],
    ) -> Vec<(Lot, usize)> {
        self.views.truncate(self.relit.len());
        let most = self.rays_at_once(device, tile, offsets.len());
        let mut lots = Vec::new();
        for (n, some) in offsets.chunks(most).enumerate() {
            let first = self.views.len();
            let mut lot = Lot::default();
            for (&offset, rays) in some.iter().zip((n * most + 1) as u32..) {
                let view = self.view(0, frame, tile, offset, rays).at(lot.add(tile));
                self.views.push(view);
            }
            let lot = self.cut(lot);
            self.views[first..].iter_mut().for_each(|view| *view = view.of(&lot));
            lots.push((lot, first - self.relit.len()));
        }
        self.upload_views(device, queue);
        lots
    }

    /// Adds the views of objects that are drawn together, a ray through the middle of every pixel. Says how much they are, and which
    /// view is their first.
    pub(in crate::gpu) fn add_lot(&mut self, drawn: &[Drawn<'_>]) -> (Lot, usize) {
        let first = self.views.len();
        let mut lot = Lot::default();
        for d in drawn {
            let view = self.view(d.slot, d.frame, d.tile, [0.5; 2], 1).at(lot.add(d.tile));
            self.views.push(ViewUniform { share: d.share, per_unit: d.per_unit, ..view });
        }
        let lot = self.cut(lot);
        self.views[first..].iter_mut().for_each(|view| *view = view.of(&lot));
        (lot, first - self.relit.len())
    }

    /// Uploads the views that were added.
    pub(in crate::gpu) fn upload_views(&mut self, device: &Device, queue: &Queue) {
        self.frame.write_views(device, queue, &self.common, &self.asset, &self.views);
    }

    /// What became of the lights of the frame that was begun.
    pub(in crate::gpu) fn light_counts(&self) -> LightCounts {
        self.frame.plan(0).map_or_else(LightCounts::default, |p| p.counts(self.frame.fold_error(), None))
    }
}
