//! Samples in blocks: what is found for all directions of a sample is kept for the samples of one block only, so that the
//! memory of a bake does not grow with samples times directions.

use crate::samples::Candidate;
use diaphane_formats::morton;
use glam::DVec3;
use std::ops::Range;

/// Samples of a block, at most.
pub(crate) const BLOCK: usize = 1 << 16;

/// Blocks of so many samples.
pub(crate) fn count(samples: usize) -> usize {
    samples.div_ceil(BLOCK).max(1)
}

/// Sorts samples along a space-filling curve, in as many strands as there are blocks: every block covers the whole object
/// evenly, so that it stands for all samples, and within it neighbours are close to each other.
pub(crate) fn arrange(samples: Vec<Candidate>, low: DVec3, high: DVec3) -> Vec<Candidate> {
    let order = morton::order(samples.iter().map(|s| s.position), low, high);
    let blocks = count(samples.len());
    let strand = |b: usize| order.iter().skip(b).step_by(blocks);
    (0..blocks).flat_map(strand).map(|i| samples[*i as usize]).collect()
}

/// The blocks of samples that [`arrange`] sorted.
pub(crate) fn ranges(samples: usize) -> Vec<Range<usize>> {
    let blocks = count(samples);
    let mut from = 0;
    (0..blocks)
        .map(|b| {
            let size = (samples + blocks - 1 - b) / blocks;
            from += size;
            from - size..from
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_all_samples_and_cover_the_object_alike() {
        let n = 2 * BLOCK + 7;
        let at = |i: usize| DVec3::new(i as f64 / n as f64, (i * 7_919 % n) as f64 / n as f64, 0.0);
        let samples: Vec<Candidate> =
            (0..n).map(|i| Candidate { position: at(i), radius: 1.0, fluence: i as f64 }).collect();
        let arranged = arrange(samples, DVec3::ZERO, DVec3::ONE);
        let ranges = ranges(n);
        assert_eq!(ranges.len(), 3);
        assert_eq!((ranges[0].start, ranges[2].end), (0, n));
        for range in &ranges {
            assert!(range.len() <= BLOCK);
            let own = &arranged[range.clone()];
            let mean = own.iter().map(|s| s.position).sum::<DVec3>() / own.len() as f64;
            assert!((mean.x - 0.5).abs() < 1e-3 && (mean.y - 0.5).abs() < 1e-3, "{mean}");
        }
        let mut seen: Vec<usize> = arranged.iter().map(|s| s.fluence as usize).collect();
        seen.sort_unstable();
        assert!(seen.into_iter().eq(0..n));
    }
}
