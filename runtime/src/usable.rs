//! Samples that single precision can draw.

use diaphane_formats::asset::{Asset, Samples};
use diaphane_formats::slopes::Stencil;

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

/// Gradient stencils of an asset's (usable) samples, limited by its largest extinction.
pub fn slope_stencil(asset: &Asset, samples: &Samples) -> Stencil {
    let extinction = asset.info.extinction.into_iter().fold(0.0, f64::max) as f32;
    Stencil::new(samples, |x| {
        let density = match &asset.density {
            Some(grid) => grid.value(x)[0],
            None => asset.info.uniform_density as f32,
        };
        (extinction * density).min(1e30)
    })
}
