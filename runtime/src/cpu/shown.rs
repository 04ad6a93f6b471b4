//! Which samples a view shows, and why it shows no others: twin of outlines.wgsl. The view is one ray of every pixel.
//!
//! A kernel of radius R at the distance z along the view and p across it projects to an ellipse: with w = z² - R², middle p z / w
//! away from the picture's centre, semi-axes R √(p² + w) / w that way and R / √w across. What rays are inside under its box is
//! known for squares of 8 × 8 pixels.

use super::segments::Piece;
use super::tiles::Rect;
use crate::frame::{Frame, View};
use crate::rendered::MAX_PIECES;
use diaphane_formats::kernel::CUT_OFF_RADIUS;
use diaphane_formats::reconstruct::Cloud;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Optical depth behind which nothing is seen in single precision: e^-16 is 1.1e-7.
const DARK: f32 = 16.0;

/// Side of a cell, pixels, and of what a GPU gathers at once, cells.
const CELL: u32 = 8;
const TILE: usize = 2;

/// Kernels that cover more cells are taken to be shown.
const MOST_CELLS: usize = 256;

/// How far one sees into a medium of extinction `kappa` or more, mesh units.
pub fn sight(kappa: f32) -> f32 {
    DARK / kappa.max(1e-30)
}

/// Where rays are inside the object in one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Range {
    start: f32,
    end: f32,
    latest_start: f32,
}

impl Range {
    const NONE: Self = Self { start: f32::INFINITY, end: f32::NEG_INFINITY, latest_start: 0.0 };

    fn is_some(self) -> bool {
        self.start <= self.end
    }
}

/// Where the pieces of rays are, for each cell of a picture or of a part of it.
#[derive(Clone, Debug)]
pub struct Cells {
    columns: usize,
    ranges: Vec<[Range; MAX_PIECES]>,
}

impl Cells {
    /// Of a whole picture, without rays.
    pub fn new(frame: &Frame) -> Self {
        Self::of(Rect::all(frame))
    }

    /// Of a rectangle.
    pub fn of(rect: Rect) -> Self {
        let [columns, rows] = [0, 1].map(|c| (rect.high[c] - rect.low[c]).div_ceil(CELL) as usize);
        Self { columns, ranges: vec![[Range::NONE; MAX_PIECES]; columns * rows] }
    }

    /// Adds the ray of a pixel. Pieces too short for single precision count for nothing, as on the GPU.
    pub fn add(&mut self, pixel: [u32; 2], pieces: &[Piece]) {
        let [x, y] = pixel.map(|p| (p / CELL) as usize);
        let cell = &mut self.ranges[y * self.columns + x];
        for (range, piece) in cell.iter_mut().zip(pieces.iter().filter(|p| p.end > p.start)) {
            range.start = range.start.min(piece.start);
            range.end = range.end.max(piece.end);
            range.latest_start = range.latest_start.max(piece.start);
        }
    }

    /// Takes over the cells of `rect`, whose corner is a cell's.
    pub fn put(&mut self, rect: Rect, part: &Self) {
        let [left, top] = rect.low.map(|p| (p / CELL) as usize);
        for (row, cells) in part.ranges.chunks(part.columns.max(1)).enumerate() {
            let at = (top + row) * self.columns + left;
            self.ranges[at..at + cells.len()].copy_from_slice(cells);
        }
    }

    /// For each piece, in how many squares of 16 × 16 pixels it is, and whether anywhere.
    pub fn tiles(&self) -> ([u64; MAX_PIECES], [u64; MAX_PIECES]) {
        let columns = self.columns.div_ceil(TILE);
        let rows = self.ranges.len().div_ceil(self.columns.max(1));
        let mut has = vec![[false; MAX_PIECES]; columns * rows.div_ceil(TILE)];
        for (i, cell) in self.ranges.iter().enumerate() {
            let (x, y) = (i % self.columns / TILE, i / self.columns / TILE);
            (0..MAX_PIECES).for_each(|k| has[y * columns + x][k] |= cell[k].is_some());
        }
        let tiles: [u64; MAX_PIECES] =
            std::array::from_fn(|k| has.iter().filter(|tile| tile[k]).count() as u64);
        (tiles, tiles.map(|n| u64::from(n > 0)))
    }

    fn class(&self, [first, last]: [[u32; 2]; 2], [low, high]: [f32; 2], sight: f32) -> Class {
        let [left, top] = first.map(|p| (p / CELL) as usize);
        let [right, bottom] = last.map(|p| (p / CELL) as usize);
        if (right - left + 1) * (bottom - top + 1) > MOST_CELLS {
            return Class::Shown;
        }
        let rows = (top..=bottom).flat_map(|y| &self.ranges[y * self.columns..][left..=right]);
        let met = || rows.clone().flatten().filter(|r| r.is_some() && r.start < high && r.end > low);
        if met().any(|r| low < r.latest_start + sight) {
            Class::Shown
        } else if met().next().is_some() {
            Class::Hidden
        } else {
            Class::Apart
        }
    }
}

/// Classes of samples, numbered as in outlines.wgsl.
#[derive(Clone, Copy)]
enum Class {
    Dark,
    OutOfView,
    BetweenRays,
    Apart,
    Hidden,
    Shown,
}

/// Samples of each class in the view whose rays stand at `offset` in their pixels.
pub fn count(cloud: &Cloud, frame: &Frame, offset: [f32; 2], cells: &Cells, sight: f32) -> [u64; 6] {
    let class = |i: usize| {
        if cloud.weight[i] <= 0.0 {
            return Class::Dark;
        }
        let centre = cloud.centre[i] - frame.view.origin;
        let radius = 1.0001 * CUT_OFF_RADIUS / cloud.sharpness[i];
        if centre.dot(frame.view.forward) <= -radius {
            return Class::OutOfView;
        }
        match pixels_of(bounds(&frame.view, frame, centre, radius), frame, offset) {
            Err(class) => class,
            Ok(pixels) => {
                let distance = centre.length();
                cells.class(pixels, [distance - radius, distance + radius], sight)
            }
        }
    };
    let add = |mut a: [u64; 6], b: [u64; 6]| {
        (0..6).for_each(|k| a[k] += b[k]);
        a
    };
    let one = |mut counts: [u64; 6], i: usize| {
        counts[class(i) as usize] += 1;
        counts
    };
    (0..cloud.centre.len()).into_par_iter().fold(|| [0; 6], one).reduce(|| [0; 6], add)
}

/// The box around a kernel's ellipse, from -1 to 1 across the picture, y upwards: middle and half the size.
fn bounds(view: &View, frame: &Frame, centre: Vec3, radius: f32) -> [Vec2; 2] {
    let unit = Vec2::new(view.right.length(), view.up.length());
    let z = centre.dot(view.forward);
    if z < 1.05 * radius {
        return [Vec2::ZERO, Vec2::splat(4.0)];
    }
    let across = Vec2::new(centre.dot(view.right), centre.dot(view.up)) / unit;
    let p = across.length();
    let away = if p > 0.0 { across / p } else { Vec2::X };
    let margin = 0.25 * (unit.x / frame.width as f32).max(unit.y / frame.height as f32);
    let w = z * z - radius * radius;
    let first = away * (radius * (p * p + w).sqrt() / w + margin);
    let second = away.perp() * (radius / w.sqrt() + margin);
    let reach = Vec2::new(first.x.hypot(second.x), first.y.hypot(second.y));
    [away * (p * z / w) / unit, reach / unit]
}

/// First and last of the pixels whose rays run through a box.
fn pixels_of(
    [middle, reach]: [Vec2; 2],
    frame: &Frame,
    offset: [f32; 2],
) -> std::result::Result<[[u32; 2]; 2], Class> {
    let middle = middle * Vec2::new(1.0, -1.0);
    let size = Vec2::new(frame.width as f32, frame.height as f32);
    let [scale, offset] = [0.5 * size, Vec2::from(offset)];
    let first = ((middle - reach + 1.0) * scale - offset).ceil().max(Vec2::ZERO);
    let last = ((middle + reach + 1.0) * scale - offset).floor().min(size - 1.0);
    if last.min_element() < 0.0 || first.cmpgt(size - 1.0).any() {
        Err(Class::OutOfView)
    } else if first.cmpgt(last).any() {
        Err(Class::BetweenRays)
    } else {
        Ok([first.as_uvec2().to_array(), last.as_uvec2().to_array()])
    }
}
