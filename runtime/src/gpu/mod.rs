//! The wgpu renderer: one module in `passes` and one shader for each pass, in this order:
//!
//! ```text
//! lighting                     once a frame: samples × lights -> source of every sample
//! surface [boundary] segments  each sub-pixel ray: mesh -> sorted crossings -> up to four inside pieces
//! outlines batches             each sub-pixel ray: which samples a piece may show, listed by 64 and counted
//! [profile] gather             each piece: kernels along it, summed and normalised, tile by tile -> picture
//!           or splat resolve   the same by blended quads ([`SplatPath`])
//! ```
//!
//! [`GpuRenderer`] owns its device and reads pictures back; [`PictureRenderer`] records the same passes into a command buffer,
//! with two more for a window: publish (mean of the rays so far) and display (exposure). [`Renderer`] draws many objects into
//! a host program's frame, with passes that clip at its depth buffer, compose objects front to back and overlay its picture. Boundary
//! runs where `ior` is not 1, profile where the medium has a density grid. Later pieces of rays are drawn indirectly and cost next to
//! nothing where no ray has them.
//!
//! A pass runs for a [`lot`] of tiles at once: their views are an array, and the state of each lies behind that of the one before.
//! Passes over samples run once for each [`shard`], the mesh is drawn in [`mesh`] parts, and the density grid is cut into [`slabs`].
//! [`rivals`] draws the same light in other ways; [`GpuDepths`] traces exact depths. Sums are kept in 32-bit floats and added in the
//! order of the samples: the same adapter draws the same bits every time.

mod arrived;
mod asset;
mod bindings;
mod census;
mod corners;
mod depths;
mod device;
mod faults;
mod frame;
mod headless;
mod hierarchy;
mod host;
mod lot;
mod mesh;
mod neighbours;
mod packed;
mod passes;
mod picture;
mod pipeline;
mod readback;
pub mod rivals;
mod shaders;
mod shard;
mod slabs;
mod splatting;
mod targets;
mod tiles;
mod timers;
mod uniforms;

pub use depths::GpuDepths;
pub use device::{GpuDevice, instance};
pub use faults::{guarded, is_guarded, wait};
pub use headless::GpuRenderer;
pub use host::{AssetId, HostDepth, HostFrame, HostReport, InstanceId, Options, Renderer};
pub use picture::{PictureRenderer, Request, Statistics};
pub use readback::texture as read_texture;
pub use splatting::SplatPath;
