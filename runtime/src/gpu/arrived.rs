//! What came back of a tile becomes part of a picture.

use super::tiles::Tile;
use diaphane_formats::picture::Picture;
use rayon::prelude::*;
use std::ops::AddAssign;

/// Pixels that are worth waking another thread for.
const SHARED: usize = 1 << 15;

/// Writes the mean of so many rays to the pixels of a tile, and their share that hit to the coverage; sums that lie one tile behind
/// the other are those of rays drawn side by side. Returns the sums of the counts: rays that hit, pieces dropped, kernels, rays
/// without a kernel.
pub(super) fn paint(
    picture: &mut Picture,
    tile: Tile,
    radiance: &[[f32; 4]],
    counts: &[[u32; 4]],
    rays: usize,
) -> [u64; 4] {
    let one = tile.pixels() as usize;
    if radiance.len() > one {
        return paint(picture, tile, &stacked(radiance, one), &stacked(counts, one), rays);
    }
    let width = picture.width.max(1);
    let [left, top] = tile.start.map(|n| n as usize);
    let [columns, rows] = tile.size.map(|n| n as usize);
    if columns == 0 {
        return [0; 4];
    }
    let per_ray = 1.0 / rays as f32;
    let coverage = picture.coverage.get_or_insert_with(|| vec![0.0; picture.pixels.len()]);
    let least = SHARED.div_ceil(columns);
    let row = |((pixels, covered), (sums, counts)): Row| {
        let place = left..left + columns;
        paint_row(&mut pixels[place.clone()], &mut covered[place], sums, counts, per_ray)
    };
    if rows <= least {
        let to = picture.pixels.chunks_mut(width).zip(coverage.chunks_mut(width)).skip(top);
        let from = radiance.chunks(columns).zip(counts.chunks(columns));
        to.zip(from).take(rows).map(row).fold([0; 4], added)
    } else {
        let to = picture.pixels.par_chunks_mut(width).zip(coverage.par_chunks_mut(width)).skip(top);
        let from = radiance.par_chunks(columns).zip(counts.par_chunks(columns));
        to.zip(from).take(rows).with_min_len(least).map(row).reduce(|| [0; 4], added)
    }
}

/// The sum of what lies every `one` entries.
fn stacked<T: Copy + AddAssign>(layers: &[[T; 4]], one: usize) -> Vec<[T; 4]> {
    let mut layers = layers.chunks_exact(one);
    let mut sum = layers.next().map_or_else(Vec::new, <[[T; 4]]>::to_vec);
    for layer in layers {
        for (sum, more) in sum.iter_mut().zip(layer) {
            sum.iter_mut().zip(more).for_each(|(s, m)| *s += *m);
        }
    }
    sum
}

/// Pixels and coverage of a picture's row, radiance and counts of a tile's.
type Row<'a> = ((&'a mut [[f32; 3]], &'a mut [f32]), (&'a [[f32; 4]], &'a [[u32; 4]]));

fn added(a: [u64; 4], b: [u64; 4]) -> [u64; 4] {
    std::array::from_fn(|k| a[k] + b[k])
}

fn paint_row(
    pixels: &mut [[f32; 3]],
    covered: &mut [f32],
    sums: &[[f32; 4]],
    counts: &[[u32; 4]],
    per_ray: f32,
) -> [u64; 4] {
    let mut all = [0; 4];
    for (((pixel, covered), [r, g, b, _]), counts) in pixels.iter_mut().zip(covered).zip(sums).zip(counts) {
        *pixel = [r * per_ray, g * per_ray, b * per_ray];
        *covered = counts[0] as f32 * per_ray;
        (0..4).for_each(|k| all[k] += u64::from(counts[k]));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One pixel after the other.
    fn plainly(
        picture: &mut Picture,
        tile: Tile,
        radiance: &[[f32; 4]],
        counts: &[[u32; 4]],
        rays: usize,
    ) -> [u64; 4] {
        let (mut all, columns) = ([0; 4], tile.size[0] as usize);
        for (i, (sum, counts)) in radiance.iter().zip(counts).enumerate() {
            let [x, y] = [tile.start[0] as usize + i % columns, tile.start[1] as usize + i / columns];
            let at = y * picture.width + x;
            let per_ray = 1.0 / rays as f32;
            picture.pixels[at] = [sum[0] * per_ray, sum[1] * per_ray, sum[2] * per_ray];
            picture.coverage.as_mut().unwrap()[at] = counts[0] as f32 * per_ray;
            all = added(all, counts.map(u64::from));
        }
        all
    }

    #[test]
    fn rays_side_by_side_are_summed() {
        let tile = Tile { start: [1, 2], size: [3, 2] };
        let radiance: Vec<[f32; 4]> = (0..18).map(|i| [i as f32, 1.0, 0.5 * i as f32, 0.0]).collect();
        let counts: Vec<[u32; 4]> = (0..18).map(|i| [u32::from(i >= 6), 1, i, 0]).collect();
        let mut picture = Picture { coverage: Some(vec![0.0; 20]), ..Picture::new(5, 4) };
        let sums = paint(&mut picture, tile, &radiance, &counts, 3);
        assert_eq!(sums, [12, 18, 153, 0]);
        // The fifth pixel of the tile: entries 4, 10 and 16.
        assert_eq!(picture.pixels[3 * 5 + 2], [10.0, 1.0, 5.0]);
        assert_eq!(picture.coverage.unwrap()[3 * 5 + 2], 2.0 / 3.0);
    }

    #[test]
    fn rows_are_painted_as_pixels_one_by_one() {
        let tiles = [
            ([0, 0], [1, 1]),
            ([3, 2], [5, 4]),
            ([0, 0], [400, 300]),
            ([17, 5], [383, 251]),
            ([399, 0], [1, 300]),
        ];
        for (start, size) in tiles {
            let tile = Tile { start, size };
            let radiance: Vec<[f32; 4]> =
                (0..tile.pixels()).map(|i| [i as f32, 0.5, 1.0 / (1.0 + i as f32), -1.0]).collect();
            let counts: Vec<[u32; 4]> =
                (0..tile.pixels() as u32).map(|i| [i % 4, i % 3, u32::MAX - i, i % 2]).collect();
            let blank = || Picture { coverage: Some(vec![7.0; 400 * 300]), ..Picture::new(400, 300) };
            let (mut by_rows, mut plain) = (blank(), blank());
            let sums = paint(&mut by_rows, tile, &radiance, &counts, 3);
            assert_eq!(sums, plainly(&mut plain, tile, &radiance, &counts, 3), "{tile:?}");
            assert!(sums[2] > u64::from(u32::MAX) / 2 && by_rows == plain, "{tile:?}");
        }
    }
}
