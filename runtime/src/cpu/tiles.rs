//! Which kernels the rays of a square of pixels may meet.
//!
//! All rays of a square lie in a cone around its mean direction u with half angle θ. A kernel of radius R around c
//! (relative to the camera) can be missed by none of them only if
//!
//!   d cos θ - (c·u) sin θ ≤ R  and  c·u ≥ -R,   d = |c - (c·u) u|
//!
//! (the first is a lower bound of the distance to the cone; d by the vector, which does not cancel far away). Blocks
//! of [`BLOCK`]² pixels look at all kernels, tiles of [`TILE`]² at those of their block; what is left is copied
//! together so that each ray runs through contiguous memory.

use crate::frame::{Frame, View};
use crate::placement::SQUARE;
use diaphane_formats::hits::{Hit, Hits, LANES, Lanes};
use diaphane_formats::kernel::{CUT_OFF, CUT_OFF_RADIUS};
use diaphane_formats::reconstruct::Cloud;
use diaphane_formats::slopes::Source;
use glam::Vec3;

/// Side of a block of tiles, pixels.
pub const BLOCK: u32 = SQUARE;

/// Side of a tile, pixels.
pub const TILE: u32 = 4;

/// Below this cosine of the half angle a cone is not used: everything is a candidate.
const LEAST_COSINE: f32 = 0.1;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// First column and row.
    pub low: [u32; 2],
    /// Column and row after the last.
    pub high: [u32; 2],
}

impl Rect {
    /// The whole picture.
    pub fn all(frame: &Frame) -> Self {
        Self { low: [0, 0], high: [frame.width, frame.height] }
    }

    /// Squares of `side` pixels that cover this rectangle, row by row; those at the end may be narrower.
    pub fn split(self, side: u32) -> Vec<Self> {
        let starts = |k: usize| (self.low[k]..self.high[k]).step_by(side as usize);
        let end = |k: usize, start: u32| start.saturating_add(side).min(self.high[k]);
        starts(1)
            .flat_map(|y| starts(0).map(move |x| Self { low: [x, y], high: [end(0, x), end(1, y)] }))
            .collect()
    }

    /// Columns.
    pub fn width(&self) -> usize {
        (self.high[0] - self.low[0]) as usize
    }
}

/// The directions of a rectangle's rays.
struct Cone {
    axis: Vec3,
    cosine: f32,
    sine: f32,
}

impl Cone {
    fn new(view: &View, frame: &Frame, rect: Rect) -> Self {
        let [left, right] = [rect.low[0] as f32, rect.high[0] as f32];
        let [top, bottom] = [rect.low[1] as f32, rect.high[1] as f32];
        let corners = [(left, top), (right, top), (left, bottom), (right, bottom)]
            .map(|(x, y)| view.direction(x, y, frame.width, frame.height));
        let axis = corners.iter().sum::<Vec3>().normalize_or_zero();
        let cosine = corners.iter().map(|c| c.dot(axis)).fold(1.0, f32::min);
        // Widened by more than the rounding of directions.
        let cosine = cosine - 1e-6;
        Self { axis, cosine, sine: (1.0 - cosine * cosine).max(0.0).sqrt() }
    }

    fn may_meet(&self, centre: Vec3, radius: f32) -> bool {
        if self.cosine <= LEAST_COSINE || self.cosine.is_nan() {
            return true;
        }
        let along = centre.dot(self.axis);
        let across = (centre - self.axis * along).length();
        across * self.cosine - along * self.sine <= radius && along >= -radius
    }
}

/// A kernel relative to the camera.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    centre: Vec3,
    /// Slightly larger than the support, so that rounding never loses one.
    radius: f32,
    index: u32,
}

/// The kernels with weight, relative to the camera.
pub fn kernels(cloud: &Cloud, camera: Vec3) -> Vec<Kernel> {
    let kernel = |i: usize| {
        let centre = cloud.centre[i] - camera;
        let radius = CUT_OFF_RADIUS / cloud.sharpness[i] * 1.001 + centre.length() * 1e-6;
        Kernel { centre, radius, index: i as u32 }
    };
    (0..cloud.centre.len()).filter(|&i| cloud.weight[i] > 0.0).map(kernel).collect()
}

/// Those of `kernels` that rays of `rect` may meet between two distances, into `out` (cleared).
pub fn select(kernels: &[Kernel], frame: &Frame, rect: Rect, [near, far]: [f32; 2], out: &mut Vec<Kernel>) {
    let cone = Cone::new(&frame.view, frame, rect);
    out.clear();
    let in_range = |k: &Kernel| {
        let distance = k.centre.length();
        distance - k.radius <= far && distance + k.radius >= near
    };
    out.extend(kernels.iter().filter(|k| in_range(k) && cone.may_meet(k.centre, k.radius)));
}

#[derive(Clone, Copy)]
struct Chunk {
    centre: [Lanes; 3],
    /// C / a²: squared radius of the support, -1 for padding.
    support2: Lanes,
    a: Lanes,
    weight: Lanes,
    index: [u32; LANES],
}

impl Chunk {
    const EMPTY: Self = Self {
        centre: [[0.0; LANES]; 3],
        support2: [-1.0; LANES],
        a: [1.0; LANES],
        weight: [0.0; LANES],
        index: [0; LANES],
    };
}

/// The kernels of a tile, side by side.
#[derive(Default)]
pub struct Candidates {
    chunks: Vec<Chunk>,
}

impl Candidates {
    /// Copies the kernels of a tile together.
    pub fn fill(&mut self, kernels: &[Kernel], cloud: &Cloud) {
        self.chunks.clear();
        for group in kernels.chunks(LANES) {
            let mut chunk = Chunk::EMPTY;
            for (lane, kernel) in group.iter().enumerate() {
                let i = kernel.index as usize;
                let a = cloud.sharpness[i];
                for c in 0..3 {
                    chunk.centre[c][lane] = kernel.centre[c];
                }
                chunk.support2[lane] = CUT_OFF / (a * a);
                chunk.a[lane] = a;
                chunk.weight[lane] = cloud.weight[i];
                chunk.index[lane] = kernel.index;
            }
            self.chunks.push(chunk);
        }
    }

    /// Number of kernels, padding included.
    pub fn len(&self) -> usize {
        self.chunks.len() * LANES
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.chunks.is_empty()
    }

    /// The kernels whose support the line through the camera along `direction` (unit) meets, into `hits` (cleared).
    pub fn along(&self, direction: Vec3, sources: &[Source], hits: &mut Hits) {
        hits.clear();
        for chunk in &self.chunks {
            let mut inside = [0.0; LANES];
            let [x, y, z] = &chunk.centre;
            for k in 0..LANES {
                let t = x[k] * direction.x + y[k] * direction.y + z[k] * direction.z;
                let (px, py, pz) = (x[k] - direction.x * t, y[k] - direction.y * t, z[k] - direction.z * t);
                inside[k] = chunk.support2[k] - (px * px + py * py + pz * pz);
            }
            for k in 0..LANES {
                if inside[k] > 0.0 {
                    let centre = Vec3::new(x[k], y[k], z[k]);
                    let source = &sources[chunk.index[k] as usize];
                    if let Some(hit) = Hit::new(centre, direction, chunk.a[k], chunk.weight[k], source) {
                        hits.push(hit);
                    }
                }
            }
        }
    }
}
