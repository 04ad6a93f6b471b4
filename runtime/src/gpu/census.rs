//! The census as the GPU writes it.

use crate::rendered::{Census, MAX_PIECES};

/// Adds what outlines.wgsl and batches.wgsl counted in some views of `size` pixels.
pub(super) fn add(census: &mut Census, words: &[u32], views: u64, size: [u32; 2]) {
    let word = |i: usize| u64::from(words.get(i).copied().unwrap_or_default());
    let pieces = |first: usize| -> [u64; MAX_PIECES] { std::array::from_fn(|k| word(first + k)) };
    census.add(views, size, std::array::from_fn(word), pieces(8), pieces(12));
    census.batches_drawn += word(6);
    census.batches += word(7);
}
