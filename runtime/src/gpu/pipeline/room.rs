//! Room for the pixels of what is drawn: tiles, lots, and targets for them.

use super::Pipeline;
use crate::Result;
use crate::gpu::lot::Lot;
use crate::gpu::shard::BATCH;
use crate::gpu::splatting::{SplatPath, Splatting};
use crate::gpu::targets::{LEAST, Targets, budget};
use crate::gpu::tiles::{Tile, split};
use wgpu::Device;

impl Pipeline {
    pub(super) fn split(&self, device: &Device, [low, high]: [[u32; 2]; 2]) -> Result<Vec<Tile>> {
        let budget = budget(device, self.asset.pixel_state(), self.most_memory);
        let mut tiles = split(high[0] - low[0], high[1] - low[1], budget)?;
        tiles.iter_mut().for_each(|t| t.start = [t.start[0] + low[0], t.start[1] + low[1]]);
        Ok(tiles)
    }

    /// How much state tiles have that are drawn one after the other.
    pub(in crate::gpu) fn largest(&self, tiles: &[Tile]) -> Lot {
        tiles.iter().map(|t| self.cut((*t).into())).fold(Lot::default(), Lot::or)
    }

    /// A lot with its samples cut into as many slices as keep the device busy.
    pub(in crate::gpu) fn cut(&self, lot: Lot) -> Lot {
        let samples = self.asset.shards.iter().map(|s| s.range.len()).max().unwrap_or(0);
        let (clusters, pieces) = (samples.div_ceil(BATCH) as u32, self.pieces_at_once() as u64);
        let lot = lot.sliced(self.workgroups, clusters, pieces, self.most_sums);
        if self.asset.pixel_state().kept { lot.kept() } else { lot }
    }

    pub(super) fn allocate(&mut self, device: &Device, tiles: &[Tile]) -> Result<Targets> {
        let state = self.asset.pixel_state();
        let lot = self.largest(tiles);
        self.tile_memory = budget(device, state, self.most_memory).pixel_total * lot.pixels;
        Targets::allocate(device, state, lot, self.path(), self.tile_memory)
    }

    /// Draws in tiles of half the memory from now on, because there is none for `what`. False where they are small already.
    pub(in crate::gpu) fn shrink(&mut self, what: &str) -> bool {
        let half = self.most_memory.min(self.tile_memory) / 2;
        let may = half >= LEAST;
        if may {
            log::warn!("the GPU has no memory for {what}; drawing in smaller tiles");
            self.most_memory = half;
            self.forget_targets();
        }
        may
    }

    /// Forgets what the size of the picture decides, so that it is made anew.
    pub(in crate::gpu) fn forget_targets(&mut self) {
        self.targets = None;
        self.lit.clear();
    }

    /// Another number of workgroups that keep the device busy.
    pub(in crate::gpu) fn set_workgroups(&mut self, device: &Device, workgroups: u32) {
        self.workgroups = if self.path() == SplatPath::Tiles { workgroups } else { 0 };
        self.make_splatting(device);
        self.forget_targets();
    }

    /// Pieces of a ray that one dispatch sums.
    pub(super) fn pieces_at_once(&self) -> usize {
        self.asset.pieces_at_once(self.path())
    }

    pub(super) fn make_splatting(&mut self, device: &Device) {
        let sliced = self.workgroups > 0;
        self.splatting = Splatting::new(device, &self.common, &self.asset, self.path(), sliced);
    }
}
