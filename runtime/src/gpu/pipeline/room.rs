//! Room for the pixels of what is drawn: tiles, lots, and targets for them.

use super::Pipeline;
use crate::Result;
use crate::gpu::lot::{Lot, MOST_VIEWS};
use crate::gpu::shard::BATCH;
use crate::gpu::splatting::{SplatPath, Splatting};
use crate::gpu::targets::{LEAST, Targets, budget};
use crate::gpu::tiles::{Tile, split};
use wgpu::Device;

/// Pixels of rays that are drawn side by side, at the most: all of them are read back.
const SIDE_BY_SIDE: u64 = 1 << 17;

impl Pipeline {
    pub(super) fn split(&self, device: &Device, [low, high]: [[u32; 2]; 2]) -> Result<Vec<Tile>> {
        let budget = budget(device, self.asset.pixel_state(), self.most_memory);
        let mut tiles = split(high[0] - low[0], high[1] - low[1], budget)?;
        tiles.iter_mut().for_each(|t| t.start = [t.start[0] + low[0], t.start[1] + low[1]]);
        Ok(tiles)
    }

    /// How much state tiles have that are drawn one after the other, of so many rays a pixel.
    pub(in crate::gpu) fn largest(&self, device: &Device, tiles: &[Tile], rays: usize) -> Lot {
        let of = |tile: &Tile| {
            let most = self.rays_at_once(device, *tile, rays);
            let lot = self.side_by_side(*tile, most);
            // The last ones may be fewer, in more slices.
            let last = rays % most;
            if last == 0 { lot } else { lot.or(self.side_by_side(*tile, last)) }
        };
        tiles.iter().map(of).fold(Lot::default(), Lot::or)
    }

    /// The state of so many rays of a tile's pixels side by side.
    pub(in crate::gpu) fn side_by_side(&self, tile: Tile, rays: usize) -> Lot {
        let mut lot = Lot::default();
        for _ in 0..rays {
            lot.add(tile);
        }
        self.cut(lot)
    }

    /// Of `rays` rays of a tile's pixels those that are drawn side by side, each as a tile of its own: many for a small picture,
    /// which would leave the device idle otherwise.
    pub(in crate::gpu) fn rays_at_once(&self, device: &Device, tile: Tile, rays: usize) -> usize {
        let room = budget(device, self.asset.pixel_state(), self.most_memory).pixels();
        let busy = u64::from(self.workgroups) / Lot::from(tile).tiles.max(1);
        let most = busy.min(room.min(SIDE_BY_SIDE) / tile.pixels().max(1)) as usize;
        rays.min(most).clamp(1, MOST_VIEWS)
    }

    /// A lot with its samples cut into as many slices as keep the device busy.
    pub(in crate::gpu) fn cut(&self, lot: Lot) -> Lot {
        let samples = self.asset.shards.iter().map(|s| s.range.len()).max().unwrap_or(0);
        let (clusters, pieces) = (samples.div_ceil(BATCH) as u32, self.pieces_at_once() as u64);
        let state = self.asset.pixel_state();
        let most = self.most_sums.min(state.room_for_sums(lot, self.most_memory));
        let lot = lot.sliced(self.workgroups, clusters, pieces, most);
        if state.kept { lot.kept() } else { lot }
    }

    pub(super) fn allocate(&mut self, device: &Device, tiles: &[Tile], rays: usize) -> Result<Targets> {
        let state = self.asset.pixel_state();
        let lot = self.largest(device, tiles, rays);
        self.tile_memory = state.bytes_of(lot);
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
