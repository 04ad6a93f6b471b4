//! State of the pixels of tiles that are drawn together.

use super::bindings::{empty_buffer, most_bound};
use super::faults::allocate;
use super::lot::Lot;
use super::splatting::SplatPath;
use super::tiles::Budget;
use crate::Result;
use crate::rendered::MAX_PIECES;
use diaphane_formats::reconstruct::PROFILE_CELLS;
use wgpu::{
    Buffer, BufferBinding, BufferUsages, Device, Extent3d, TextureDescriptor, TextureDimension,
    TextureFormat, TextureUsages, TextureView,
};

/// Format of the sums of the splat pass; half precision loses several percent in them.
pub(super) const SUM_FORMAT: TextureFormat = TextureFormat::Rgba32Float;
/// Format of the attachment that the surface pass does not write.
pub(super) const MARKER_FORMAT: TextureFormat = TextureFormat::R8Unorm;
/// Bytes of one piece's indirect arguments: a dispatch over cells of 8 × 8 pixels (three words), one over the listed tiles of
/// 16 × 16; a word behind each has bits for the views that have the piece.
pub(super) const ARGUMENTS: u64 = 32;
/// Where the dispatches are in them.
pub(super) const OVER_CELLS: u64 = 0;
pub(super) const OVER_TILES: u64 = 16;

/// Bytes of the census.
pub(super) const CENSUS: u64 = 64;

/// State of all pixels together stays below this, so that large pictures leave memory to others.
pub(super) const TOTAL: u64 = 512 << 20;

/// Bytes of a pixel in the buffers of these names.
pub(super) const CROSSINGS: u64 = 40;
pub(super) const BOUNDARY: u64 = 48;
pub(super) const RADIANCE: u64 = 16;
pub(super) const COUNTERS: u64 = 16;
const PIECE: u64 = 16;
const PIECES: u64 = PIECE * MAX_PIECES as u64;
const CELL: u64 = 16;
/// Numerator and denominator, as tiles keep them from shard to shard or slice by slice.
pub(super) const KEPT: u64 = 32;
/// Where the lists of tiles begin, and the bytes of one tile in them.
const LISTS: u64 = 256;
const LISTED: u64 = 4;
const PROFILE: u64 = 16 * (PROFILE_CELLS as u64 + 1);

/// Buffers and textures for tiles that are drawn together.
#[derive(Clone)]
pub(super) struct Targets {
    /// What they hold.
    pub lot: Lot,
    /// Pixels, padded so that each piece's part starts at a multiple of 256 bytes.
    stride: u64,
    pub crossings: Buffer,
    pub boundary: Buffer,
    pub pieces: Buffer,
    pub front: Buffer,
    pub radiance: Buffer,
    pub counters: Buffer,
    pub profile: Buffer,
    /// Indirect arguments of each piece; then for each the tiles of 16 × 16 pixels that have it, and marks that no tile is
    /// listed twice.
    pub arguments: Buffer,
    /// Tiles, padded as `stride`.
    tile_stride: u64,
    /// Least start, greatest end and greatest start of each piece in cells of 8 × 8 pixels.
    pub cells: Buffer,
    /// See [`crate::rendered::Census`]; [`CENSUS`] bytes.
    pub census: Buffer,
    /// Sums of the current pieces, where samples are several shards or slices and drawn by tiles.
    pub kept: Buffer,
    pub marker: TextureView,
    pub numerator: TextureView,
    pub denominator: TextureView,
}

/// What objects keep for a pixel beside what all do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PixelState {
    /// The boundary reflects.
    pub fresnel: bool,
    /// The density varies.
    pub heterogeneous: bool,
    /// Sums are kept from shard to shard.
    pub kept: bool,
}

impl PixelState {
    /// Enough for both.
    pub fn or(self, other: Self) -> Self {
        Self {
            fresnel: self.fresnel || other.fresnel,
            heterogeneous: self.heterogeneous || other.heterogeneous,
            kept: self.kept || other.kept,
        }
    }
}

impl PixelState {
    /// Bytes of a pixel in all buffers and textures but for sums that are kept.
    fn bytes(self) -> u64 {
        let profile = if self.heterogeneous { PROFILE } else { 0 };
        let boundary = if self.fresnel { BOUNDARY } else { 0 };
        // Three vectors of state, two textures, the marker, and what is read back.
        CROSSINGS + boundary + PIECES + profile + 3 * 16 + 2 * 16 + 1 + 2 * 16
    }

    /// Bytes of all of a lot's pixels, about.
    pub fn bytes_of(self, lot: Lot) -> u64 {
        self.bytes() * lot.pixels + KEPT * lot.sums
    }

    /// Sums that may be kept of a lot beside the rest of its state, in `total` bytes.
    pub fn room_for_sums(self, lot: Lot, total: u64) -> u64 {
        total.saturating_sub(self.bytes() * lot.pixels) / KEPT
    }
}

/// How large tiles may be.
pub(super) fn budget(device: &Device, state: PixelState, total: u64) -> Budget {
    let limits = device.limits();
    let profile = if state.heterogeneous { PROFILE } else { 0 };
    let kept = if state.kept { KEPT } else { 0 };
    Budget {
        side: limits.max_texture_dimension_2d,
        binding: most_bound(device),
        total,
        pixel_binding: profile.max(PIECES),
        pixel_total: state.bytes() + kept,
    }
}

/// Memory below which tiles are not made smaller to fit it.
pub(super) const LEAST: u64 = 1 << 20;

impl Targets {
    /// Targets for lots up to the size of `lot`, which take about `bytes`.
    ///
    /// # Errors
    /// [`crate::Error::GpuMemory`].
    pub fn allocate(
        device: &Device,
        needs: PixelState,
        lot: Lot,
        path: SplatPath,
        bytes: u64,
    ) -> Result<Self> {
        let Lot { size: [w, h], count, .. } = lot;
        let tiles = if count > 1 { format!("{count} tiles of up to ") } else { String::new() };
        let what = || format!("the state of {tiles}{w} x {h} pixels ({:.1} MB)", bytes as f64 / 1e6);
        allocate(device, what, || Ok(Self::new(device, needs, lot, path)))
    }

    fn new(device: &Device, needs: PixelState, lot: Lot, path: SplatPath) -> Self {
        let pixels = lot.pixels;
        let stride = pixels.next_multiple_of(16);
        let cell_stride = lot.cells.next_multiple_of(32);
        let tile_stride = lot.tiles.next_multiple_of(64);
        let state = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let read = state | BufferUsages::COPY_SRC;
        let buffer = |label: &str, size: u64, usage| empty_buffer(device, label, size, usage);
        // Only quads are blended.
        let blended = if path == SplatPath::Quads { lot.size } else { [1; 2] };
        let texture = |label: &str, format, [width, height]: [u32; 2]| {
            let texture = device.create_texture(&TextureDescriptor {
                label: Some(label),
                size: Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        Self {
            lot,
            stride,
            crossings: buffer("crossings", CROSSINGS * pixels, state),
            boundary: buffer("boundary", if needs.fresnel { BOUNDARY * pixels } else { 0 }, state),
            pieces: buffer("pieces", PIECES * stride, read),
            front: buffer("front", 16 * pixels, state),
            radiance: buffer("radiance", RADIANCE * pixels, read),
            counters: buffer("counters", COUNTERS * pixels, read),
            profile: buffer("profile", if needs.heterogeneous { PROFILE * stride } else { 0 }, state),
            arguments: buffer(
                "arguments",
                LISTS + 2 * MAX_PIECES as u64 * LISTED * tile_stride,
                state | BufferUsages::INDIRECT,
            ),
            tile_stride,
            cells: buffer("cells", CELL * MAX_PIECES as u64 * cell_stride, state),
            census: buffer("census", CENSUS, read),
            kept: buffer("kept", KEPT * lot.sums, state),
            marker: texture("marker", MARKER_FORMAT, lot.size),
            numerator: texture("numerator", SUM_FORMAT, blended),
            denominator: texture("denominator", SUM_FORMAT, blended),
        }
    }

    /// Piece `k` of every pixel.
    pub fn piece(&self, k: usize) -> wgpu::BindingResource<'_> {
        self.pieces(k, 1)
    }

    /// So many pieces of every pixel from the `k`th on.
    pub fn pieces(&self, k: usize, count: usize) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(BufferBinding {
            buffer: &self.pieces,
            offset: k as u64 * self.stride * PIECE,
            size: wgpu::BufferSize::new(count as u64 * self.stride * PIECE),
        })
    }

    /// The list of tiles that have piece `k`.
    pub fn tiles(&self, k: usize) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(BufferBinding {
            buffer: &self.arguments,
            offset: LISTS + k as u64 * self.tile_stride * LISTED,
            size: wgpu::BufferSize::new(self.tile_stride * LISTED),
        })
    }

    /// Distance between the pieces of a pixel in `pieces`, in pixels.
    pub fn stride(&self) -> usize {
        self.stride as usize
    }
}
