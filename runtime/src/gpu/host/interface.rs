//! What a host says of its targets and frames, and what it is told.

use crate::detail::Fineness;
use crate::exact::Settings;
use crate::frame::FrameLight;
use crate::gpu::pipeline::SplatPath;
use crate::placement::HostCamera;
use diaphane_formats::scene::{Light, Surface};
use glam::Mat4;
use wgpu::{TextureFormat, TextureView};

/// The targets of a host's render pass.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Of the colour attachment; radiance times exposure is written as it is, so a format of floats keeps it all.
    pub colour: TextureFormat,
    /// Of the depth attachment, if the pass has one; it is neither read nor written there.
    pub depth: Option<TextureFormat>,
    /// Samples of both.
    pub sample_count: u32,
    /// How kernels are summed; `None`: whichever suits the device.
    pub path: Option<SplatPath>,
    /// Which levels of detail are fine enough.
    pub fineness: Fineness,
    /// Exact depths for lights that are marked, stand still or are inside an object, computed on the CPU in so many milliseconds a
    /// frame with so much memory for all objects; `None`: baked depths for all lights.
    pub exact: Option<Settings>,
}

impl Options {
    /// A colour attachment alone, one sample.
    pub fn new(colour: TextureFormat) -> Self {
        Self { colour, depth: None, sample_count: 1, path: None, fineness: Fineness::DEFAULT, exact: None }
    }
}

/// A host's depth buffer: a texture view with the aspect depth, one sample, of the picture's size, that can be bound; and the
/// projection that it was drawn with.
#[derive(Clone, Copy, Debug)]
pub struct HostDepth<'a> {
    /// What shaders may read.
    pub view: &'a TextureView,
    /// From the eye to clip space.
    pub projection: Mat4,
}

/// One frame of a host.
#[derive(Clone, Copy, Debug)]
pub struct HostFrame<'a> {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Where it is seen from.
    pub camera: HostCamera,
    /// Lights in the world.
    pub lights: &'a [Light],
    /// Whether each is marked exact ([`Options::exact`]); lights beyond the end are not.
    pub exact: &'a [bool],
    /// An environment as [`crate::frame::environment_lights`] makes it.
    pub environment: &'a [FrameLight],
    /// How surfaces reflect lights.
    pub surface: Surface,
    /// What hides objects.
    pub depth: Option<HostDepth<'a>>,
    /// Factor on the radiance.
    pub exposure: f32,
}

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HostReport {
    /// Objects drawn.
    pub drawn: usize,
    /// Of these, the ones between two levels of detail, which are drawn with both.
    pub fading: usize,
    /// Objects out of sight.
    pub culled: usize,
    /// Objects whose samples were lit anew.
    pub lit: usize,
    /// Tiles of all objects.
    pub tiles: usize,
    /// How often the passes ran for them: small objects of a kind are drawn together.
    pub draws: usize,
    /// Samples of the levels that were drawn.
    pub samples: u64,
    /// Lights with exact depths, summed over the objects.
    pub exact: usize,
    /// Lights that wait for theirs.
    pub waiting: usize,
    /// Samples times lights that were traced.
    pub rays: u64,
    /// Whether the last picture still holds, so that nothing was recorded.
    pub reused: bool,
}

impl super::Renderer {
    /// Which levels of detail are fine enough from the next frame on; a [`crate::detail::Governor`] tells it from the times of frames and
    /// [`HostReport::samples`].
    pub fn set_fineness(&mut self, fineness: Fineness) {
        if fineness != self.fineness {
            self.fineness = fineness;
            // The last picture holds no longer.
            self.seen = None;
        }
    }
}
