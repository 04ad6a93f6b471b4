//! The density grid on the GPU, cut along z into as many slabs as the adapter's bindings ask for.

use super::bindings::{empty_buffer, filled_buffer};
use diaphane_formats::asset::DensityGrid;
use wgpu::{Buffer, BufferUsages, Device};

/// What profile.wgsl binds.
pub(super) const MOST_SLABS: usize = 6;

/// Buffers for [`MOST_SLABS`] slabs, of which those behind the last are next to nothing.
#[derive(Clone)]
pub(super) struct Slabs {
    pub buffers: Vec<Buffer>,
    /// Layers of each but the last.
    pub layers: u32,
    /// Of the grid.
    all_layers: u32,
    /// Bytes of a binding.
    binding: u64,
}

impl Slabs {
    /// `None` where so many slabs of `binding` bytes do not hold the grid.
    pub fn new(device: &Device, grid: Option<&DensityGrid>, binding: u64) -> Option<Self> {
        let storage = BufferUsages::STORAGE;
        let cells = grid.map_or([1; 3], |g| g.size);
        let layers = layers(cells, binding)?;
        let size = grid.map_or(1, |g| (g.size[0] * g.size[1]) as usize * layers as usize);
        let mut buffers: Vec<Buffer> = grid
            .map_or(&[][..], |g| &g.values)
            .chunks(size)
            .map(|slab| filled_buffer(device, "slab", slab, storage))
            .collect();
        buffers.resize_with(MOST_SLABS, || empty_buffer(device, "no slab", 16, storage));
        Some(Self { buffers, layers, all_layers: cells[2], binding })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.all_layers.div_ceil(self.layers.max(1)) as usize
    }

    /// Whether there is more than one.
    pub fn are_several(&self) -> bool {
        self.layers < self.all_layers
    }

    /// Whether there would be for another grid.
    pub fn are_several_for(&self, grid: Option<&DensityGrid>) -> bool {
        grid.is_some_and(|g| layers(g.size, self.binding).is_none_or(|l| l < g.size[2]))
    }
}

/// Layers of a slab.
fn layers([x, y, z]: [u32; 3], binding: u64) -> Option<u32> {
    let layer = 4 * u64::from(x) * u64::from(y);
    let most = (binding / layer.max(1)).min(u64::from(z));
    (most * MOST_SLABS as u64 >= u64::from(z)).then_some(most as u32)
}

#[cfg(test)]
mod tests {
    use super::layers;

    #[test]
    fn slabs_hold_the_grid_or_there_are_none() {
        assert_eq!(layers([10, 10, 12], 1 << 20), Some(12));
        assert_eq!(layers([10, 10, 12], 800), Some(2));
        assert_eq!(layers([10, 10, 13], 800), None);
        assert_eq!(layers([10, 10, 1], 399), None);
    }
}
