//! The samples' harmonics as the lighting shader reads them: codes as in the asset, and one record a sample.

use diaphane_formats::asset::Samples;
use diaphane_formats::harmonics::{Harmonics, bits, bits_before, bytes};
use diaphane_formats::sh::MAX_ORDER;
use half::f16;
use std::ops::Range;

/// Some samples' codes.
pub(super) struct Codes {
    /// Of the depth, as words.
    pub depth: Vec<u32>,
    /// Of the boundary.
    pub boundary: Vec<u32>,
    /// `packed` of lighting.wgsl.
    pub records: Vec<[u32; 4]>,
}

impl Codes {
    /// Of the samples of a range.
    pub fn new(samples: &Samples, range: Range<usize>) -> Self {
        let depth = codes_of(&samples.depth, range.clone());
        let boundary = codes_of(&samples.boundary, range.clone());
        Self {
            depth: words(&samples.depth.codes[depth]),
            boundary: words(&samples.boundary.codes[boundary]),
            records: records(samples, range),
        }
    }
}

/// Where the codes of some functions are.
fn codes_of(harmonics: &Harmonics, range: Range<usize>) -> Range<usize> {
    let size = |orders: &[u8]| orders.iter().map(|k| bytes(usize::from(*k))).sum::<usize>();
    let clamp = |i: usize| i.min(harmonics.order.len());
    let (start, end) = (clamp(range.start), clamp(range.end));
    let before = size(&harmonics.order[..start]);
    before..before + size(&harmonics.order[start..end])
}

/// Codes padded to whole words, with one more, because a code is read with the word after it.
fn words(codes: &[u8]) -> Vec<u32> {
    let (whole, rest) = codes.as_chunks::<4>();
    let mut last = [0; 4];
    last[..rest.len()].copy_from_slice(rest);
    whole.iter().chain([&last, &[0; 4]]).map(|c| u32::from_le_bytes(*c)).collect()
}

fn records(samples: &Samples, range: Range<usize>) -> Vec<[u32; 4]> {
    let pair = |low: u16, high: u16| u32::from(low) | u32::from(high) << 16;
    let depth = &samples.depth;
    let mut start = 0;
    range
        .map(|i| {
            let lobe = samples.lobe.get(i).copied().unwrap_or_default();
            let lobe = lobe.to_array().map(|v| f16::from_f32(v).to_bits());
            let boundary = samples.boundary.scale.get(i).copied().unwrap_or_default().to_bits();
            let at = start as u32;
            start += bytes(usize::from(depth.order[i]));
            [
                at,
                pair(u16::from(depth.order[i]), depth.scale[i].to_bits()),
                pair(boundary, lobe[0]),
                pair(lobe[1], lobe[2]),
            ]
        })
        .collect()
}

/// `bands` of lighting.wgsl.
pub(super) fn bands(samples: &Samples) -> Vec<[u32; 4]> {
    let profile = |h: &Harmonics, l: usize| h.profile.get(l).copied().unwrap_or(0.0).to_bits();
    (0..MAX_ORDER)
        .map(|l| [bits_before(l), bits(l), profile(&samples.depth, l), profile(&samples.boundary, l)])
        .collect()
}
