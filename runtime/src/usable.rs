//! Samples that single precision can draw.

use diaphane_formats::asset::{Asset, Samples};

/// An asset's samples, where those whose place, size or weight would overflow single precision lost their weight and
/// moved to the centre: no bake makes such samples, but a file can hold them. Order and number are kept.
pub fn usable_samples(asset: &Asset) -> Samples {
    let mut samples = asset.samples.clone();
    let diagonal = asset.info.diagonal();
    for (p, weight) in samples.position_radius.iter_mut().zip(&mut samples.weight) {
        let [x, y, z, radius] = p.map(|v| v / diagonal);
        let near = x.abs().max(y.abs()).max(z.abs()) < 100.0;
        if !(near && radius > 1e-6 && radius < 100.0 && *weight < 1e12) {
            *p = [0.0, 0.0, 0.0, 1e-3 * diagonal];
            *weight = 0.0;
        }
    }
    samples
}
