//! The samples' harmonics as the lighting shader reads them: codes as in the asset, and one record a sample.

use diaphane_formats::asset::Samples;
use diaphane_formats::harmonics::{Harmonics, bits, bits_before};
use diaphane_formats::sh::MAX_ORDER;
use half::f16;

/// Codes padded to whole words, with one more, because a code is read with the word after it.
pub(super) fn words(harmonics: &Harmonics) -> Vec<u32> {
    let (whole, rest) = harmonics.codes.as_chunks::<4>();
    let mut last = [0; 4];
    last[..rest.len()].copy_from_slice(rest);
    whole.iter().chain([&last, &[0; 4]]).map(|c| u32::from_le_bytes(*c)).collect()
}

/// `packed` of lighting.wgsl.
pub(super) fn records(samples: &Samples) -> Vec<[u32; 4]> {
    let pair = |low: u16, high: u16| u32::from(low) | u32::from(high) << 16;
    let depth = &samples.depth;
    depth
        .starts()
        .into_iter()
        .enumerate()
        .map(|(i, start)| {
            let lobe = samples.lobe.get(i).copied().unwrap_or_default();
            let lobe = lobe.to_array().map(|v| f16::from_f32(v).to_bits());
            let boundary = samples.boundary.scale.get(i).copied().unwrap_or_default().to_bits();
            [
                start as u32,
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
