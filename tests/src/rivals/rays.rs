//! The camera rays of a frame and their inside pieces, exactly those of the player, and a picture from what they see.

use super::object::Object;
use diaphane_formats::directions::subpixel_offsets;
use diaphane_formats::picture::Picture;
use diaphane_runtime::cpu::segments::{self, Piece};
use diaphane_runtime::frame::Frame;
use glam::Vec3;
use rayon::prelude::*;

/// Side of the squares of pixels that are drawn together.
const TILE: usize = 8;

/// A ray that meets the object.
pub struct CameraRay<'a> {
    /// Where it starts, relative to the object's centre.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// Inside pieces, in order.
    pub pieces: &'a [Piece],
    /// Number of the ray within its pixel, and how many there are.
    pub place: [usize; 2],
}

/// A square of pixels: first column and row, column and row after the last.
pub type Tile = [usize; 4];

/// Draws a frame: `open` prepares a tile, `shade` gives the radiance of each of its rays that meet the object.
pub fn draw<M>(
    object: &Object<'_>,
    frame: &Frame,
    open: impl Fn(Tile) -> M + Sync,
    shade: impl Fn(&CameraRay<'_>, &mut M) -> Vec3 + Sync,
) -> Picture {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let offsets = subpixel_offsets(frame.samples_per_pixel as usize);
    let columns = width.div_ceil(TILE);
    let tiles: Vec<(Tile, Vec<Vec3>)> = (0..columns * height.div_ceil(TILE))
        .into_par_iter()
        .with_max_len(1)
        .map(|i| {
            let [x, y] = [i % columns * TILE, i / columns * TILE];
            let tile = [x, y, (x + TILE).min(width), (y + TILE).min(height)];
            (tile, draw_tile(object, frame, &offsets, tile, &open, &shade))
        })
        .collect();
    let mut picture = Picture::new(width, height);
    for ([left, top, right, _], pixels) in tiles {
        for (k, value) in pixels.iter().enumerate() {
            let (x, y) = (left + k % (right - left), top + k / (right - left));
            picture.pixels[y * width + x] = value.to_array();
        }
    }
    picture
}

fn draw_tile<M>(
    object: &Object<'_>,
    frame: &Frame,
    offsets: &[[f32; 2]],
    tile: Tile,
    open: &(impl Fn(Tile) -> M + Sync),
    shade: &(impl Fn(&CameraRay<'_>, &mut M) -> Vec3 + Sync),
) -> Vec<Vec3> {
    let [left, top, right, bottom] = tile;
    let mut scratch = segments::Scratch::default();
    // Empty tiles need no preparation.
    let mut memory = None;
    let mut pixels = Vec::with_capacity((right - left) * (bottom - top));
    let origin = frame.view.origin;
    for y in top..bottom {
        for x in left..right {
            let mut sum = Vec3::ZERO;
            for (k, [dx, dy]) in offsets.iter().enumerate() {
                let direction = frame.view.direction(x as f32 + dx, y as f32 + dy, frame.width, frame.height);
                let found =
                    segments::trace(&object.accel, object.medium.ior(), origin, direction, &mut scratch);
                if found.count > 0 {
                    let pieces = found.pieces();
                    let ray = CameraRay { origin, direction, pieces, place: [k, offsets.len()] };
                    sum += shade(&ray, memory.get_or_insert_with(|| open(tile)));
                }
            }
            pixels.push(sum / offsets.len() as f32);
        }
    }
    pixels
}
