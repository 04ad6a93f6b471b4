//! Samples that single precision can draw.

use diaphane_formats::asset::{Asset, DensityGrid, Info, Samples};
use glam::{DVec3, Vec3};

/// Extinction in single precision is clamped here; nothing passes through a medium that dense anyway.
pub const MOST_EXTINCTION: f64 = 1e30;

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

/// ρ at a point; `grid` is the asset's density grid if it has one.
pub fn density_at<'a>(info: &Info, grid: Option<&'a DensityGrid>) -> impl Fn(Vec3) -> f32 + Sync + 'a {
    let uniform = info.uniform_density as f32;
    move |x| grid.map_or(uniform, |g| g.value(x)[0])
}

/// The largest channel's κt at a point, which limits slopes.
pub fn largest_extinction<'a>(
    info: &Info,
    grid: Option<&'a DensityGrid>,
) -> impl Fn(Vec3) -> f32 + Sync + 'a {
    let most = DVec3::from(info.extinction).max_element().min(MOST_EXTINCTION) as f32;
    let density = density_at(info, grid);
    move |x| (most * density(x)).min(1e30)
}
