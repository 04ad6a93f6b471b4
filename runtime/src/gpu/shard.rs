//! Samples that share buffers. An adapter binds only so much of a buffer at once (128 MiB are certain): where an asset has more
//! samples than that holds, they are cut into shards of about equal size. Passes over the samples run shard after shard, and sums
//! go on from one to the next in the order of the samples, so that a picture depends on how many there are by
//! rounding at the most: where several workgroups share a tile each shard is cut into slices of its own.

use super::bindings::{empty_buffer, filled_buffer};
use super::packed;
use super::splatting::SplatPath;
use super::uniforms::MediumUniform;
use crate::rendered::MAX_PIECES;
use diaphane_formats::asset::Samples;
use diaphane_formats::kernel;
use diaphane_formats::slopes::NEIGHBOURS;
use glam::Vec3;
use std::ops::Range;
use wgpu::{BindingResource, Buffer, BufferBinding, BufferSize, BufferUsages, Device};

/// Samples of a batch of the splat pass's draws, and of a cluster of the gather pass.
pub(super) const BATCH: usize = 64;

/// Bytes of a sample in the largest of its buffers, the spokes: codes of fourteen bands are less.
const LARGEST: u64 = 16 * NEIGHBOURS as u64;
/// Bytes of a source, and of an outline.
pub(super) const SOURCE: u64 = 64;
const OUTLINE: u64 = 24;

/// Bytes of one piece's indirect draw in [`Shard::batches`], and of all of them.
pub(super) const DRAW: u64 = 32;
const DRAWS: u64 = 256;

/// Some of an asset's samples.
#[derive(Clone)]
pub(super) struct Shard {
    /// Which samples.
    pub range: Range<usize>,
    /// The object's medium, and which samples these are.
    pub medium: Buffer,
    /// Kernels, then a sphere around every [`BATCH`] of them that follow each other; radius 0 without any.
    pub samples: Buffer,
    pub weights: Buffer,
    pub depth: Buffer,
    pub boundary: Buffer,
    /// Where each sample's codes are, and its scales.
    pub packed: Buffer,
    /// Where values hold, and the density there.
    pub centroids: Buffer,
    /// Gradient stencils; neighbours by their place among all samples.
    pub spokes: Buffer,
    /// Written by the slopes pass.
    pub sources: Buffer,
    /// Written by the outlines pass, and by the next instance's. Like the next two only for quads.
    pub outlines: Buffer,
    /// Whether a sample may meet each piece.
    pub shown: Buffer,
    /// For each piece an indirect draw; then for each a bit a batch, whether it has samples that may meet it; then lists of
    /// these batches.
    pub batches: Buffer,
}

/// What shards are cut from.
pub(super) struct Source<'a> {
    pub samples: &'a Samples,
    pub kernels: &'a [[f32; 4]],
    pub centroids: &'a [[f32; 4]],
    pub spokes: &'a [[f32; 4]],
    pub material: MediumUniform,
}

/// Which samples each shard gets where bindings hold `most` bytes: whole batches but for the last. `None` where not even a batch
/// fits.
pub(super) fn ranges(samples: usize, most: u64) -> Option<Vec<Range<usize>>> {
    let most = (most / LARGEST) as usize / BATCH * BATCH;
    if most == 0 {
        return None;
    }
    let count = samples.div_ceil(most).max(1);
    let size = samples.div_ceil(count).next_multiple_of(BATCH);
    Some((0..count).map(|k| (k * size).min(samples)..((k + 1) * size).min(samples)).collect())
}

impl Shard {
    pub fn new(device: &Device, source: &Source, range: Range<usize>, path: SplatPath) -> Self {
        let Source { samples, kernels, centroids, spokes, material } = source;
        let storage = BufferUsages::STORAGE;
        let kernels = &kernels[range.clone()];
        let weights = &samples.weight[range.clone()];
        let count = range.len() as u64;
        // Only quads need them.
        let outlined = if path == SplatPath::Quads { count } else { 0 };
        let codes = packed::Codes::new(samples, range.clone());
        let mut shard = Self {
            samples: filled_buffer(
                device,
                "samples",
                &[kernels, &clusters(kernels, weights)].concat(),
                storage,
            ),
            weights: filled_buffer(device, "weights", weights, storage),
            depth: filled_buffer(device, "depth", &codes.depth, storage),
            boundary: filled_buffer(device, "boundary", &codes.boundary, storage),
            packed: filled_buffer(device, "packed", &codes.records, storage),
            centroids: filled_buffer(device, "centroids", &centroids[range.clone()], storage),
            spokes: filled_buffer(
                device,
                "spokes",
                &spokes[NEIGHBOURS * range.start..NEIGHBOURS * range.end],
                storage,
            ),
            sources: empty_buffer(device, "sources", SOURCE * count, storage),
            outlines: empty_buffer(device, "outlines", OUTLINE * outlined.max(1), storage),
            shown: empty_buffer(device, "shown", MAX_PIECES as u64 * shown_stride(outlined), storage),
            batches: empty_buffer(
                device,
                "batches",
                DRAWS + MAX_PIECES as u64 * (mark_stride(outlined) + list_stride(outlined)),
                storage | BufferUsages::INDIRECT | BufferUsages::COPY_DST,
            ),
            medium: empty_buffer(device, "medium", 16, BufferUsages::UNIFORM),
            range,
        };
        shard.own_medium(device, *material);
        shard
    }

    /// What [`Self::medium`] holds for a material.
    pub fn uniform(&self, material: MediumUniform) -> MediumUniform {
        MediumUniform { samples: self.range.len() as u32, first: self.range.start as u32, ..material }
    }

    /// Gives it a medium of its own.
    pub fn own_medium(&mut self, device: &Device, material: MediumUniform) {
        let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        self.medium = filled_buffer(device, "medium", &[self.uniform(material)], usage);
    }

    /// The same samples with sources for so many objects.
    pub fn with_slots(&self, device: &Device, slots: usize) -> Self {
        let size = SOURCE * self.range.len() as u64 * slots as u64;
        let sources = empty_buffer(device, "sources", size, self.sources.usage());
        Self { sources, ..self.clone() }
    }

    /// Which samples may meet piece `k`.
    pub fn shown(&self, k: usize) -> BindingResource<'_> {
        part(&self.shown, 0, k, self.shown.size() / MAX_PIECES as u64)
    }

    /// The batches with samples that may meet piece `k`.
    pub fn listed(&self, k: usize) -> BindingResource<'_> {
        let count = self.range.len() as u64;
        part(&self.batches, DRAWS + MAX_PIECES as u64 * mark_stride(count), k, list_stride(count))
    }

    /// Columns and rows of workgroups with 64 threads that give each sample one.
    pub fn sample_groups(&self) -> [u32; 2] {
        groups(self.range.len())
    }

    /// The same for batches, at least one.
    pub fn batch_groups(&self) -> [u32; 2] {
        groups(self.range.len().div_ceil(BATCH).max(1))
    }
}

fn groups(threads: usize) -> [u32; 2] {
    const ROW: u32 = 1024;
    let groups = threads.div_ceil(64) as u32;
    [groups.min(ROW), groups.div_ceil(ROW)]
}

fn part(buffer: &Buffer, start: u64, k: usize, size: u64) -> BindingResource<'_> {
    let offset = start + k as u64 * size;
    BindingResource::Buffer(BufferBinding { buffer, offset, size: BufferSize::new(size) })
}

/// Bytes that tell of each of so many samples whether it is shown, such that a binding may begin behind them.
fn shown_stride(samples: u64) -> u64 {
    (4 * samples).next_multiple_of(256).max(256)
}

/// Bytes with a bit for every batch of so many samples, likewise.
fn mark_stride(samples: u64) -> u64 {
    samples.div_ceil(BATCH as u64).div_ceil(8).next_multiple_of(256).max(256)
}

/// Bytes of a list of all batches, likewise.
fn list_stride(samples: u64) -> u64 {
    (4 * samples.div_ceil(BATCH as u64)).next_multiple_of(256).max(256)
}

/// Spheres around the supports of [`BATCH`] kernels each (position, sharpness), as far as they have weight.
fn clusters(kernels: &[[f32; 4]], weights: &[f32]) -> Vec<[f32; 4]> {
    let sphere = |(kernels, weights): (&[[f32; 4]], &[f32])| {
        let drawn = || kernels.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(k, _)| *k);
        let centre = |k: [f32; 4]| Vec3::new(k[0], k[1], k[2]);
        let low = drawn().map(centre).fold(Vec3::INFINITY, Vec3::min);
        let high = drawn().map(centre).fold(Vec3::NEG_INFINITY, Vec3::max);
        let middle = if low.is_finite() { 0.5 * (low + high) } else { Vec3::ZERO };
        let reach = |k: [f32; 4]| middle.distance(centre(k)) + kernel::CUT_OFF_RADIUS / k[3];
        middle.extend(drawn().map(reach).fold(0.0, f32::max)).to_array()
    };
    kernels.chunks(BATCH).zip(weights.chunks(BATCH)).map(sphere).collect()
}

#[cfg(test)]
mod tests {
    use super::{BATCH, LARGEST, ranges};
    use diaphane_formats::{harmonics, sh};

    #[test]
    fn nothing_of_a_sample_is_larger_than_its_spokes() {
        assert!((harmonics::bytes(sh::MAX_ORDER) as u64) < LARGEST - 8);
    }

    #[test]
    fn every_sample_is_in_one_shard_that_fits() {
        for (samples, most) in
            [(0, 1 << 20), (1, 1 << 20), (4681, 1 << 20), (10_000, 1 << 20), (64, LARGEST * 64)]
        {
            let shards = ranges(samples, most).unwrap();
            assert_eq!(shards.len(), samples.div_ceil((most / LARGEST) as usize / BATCH * BATCH).max(1));
            let mut next = 0;
            for shard in &shards {
                assert_eq!(shard.start, next);
                assert!(shard.start % BATCH == 0 && shard.len() as u64 * LARGEST <= most);
                next = shard.end;
            }
            assert_eq!(next, samples);
        }
        assert_eq!(ranges(1, LARGEST * 63), None);
    }
}
