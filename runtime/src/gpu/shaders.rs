//! The shaders' source: one file for each pass, with the shared snippets that it uses in front.

use wgpu::{Device, ShaderModule, ShaderModuleDescriptor, ShaderSource};

macro_rules! source {
    ($($file:literal),*) => { concat!($(include_str!(concat!("../shaders/", $file, ".wgsl")), "\n"),*) };
}

pub(super) const SURFACE: &str = source!("shared/view", "surface");
pub(super) const BOUNDARY: &str =
    source!("shared/view", "shared/medium", "shared/light", "shared/fresnel", "surface", "boundary");
pub(super) const SEGMENTS: &str = source!("shared/view", "shared/medium", "segments");
pub(super) const PROFILE: &str =
    source!("shared/view", "shared/medium", "shared/profile", "shared/density", "profile");
pub(super) const LIGHTING: &str =
    source!("shared/view", "shared/medium", "shared/light", "shared/phase", "lighting");
pub(super) const FOLD: &str = source!("shared/view", "shared/medium", "fold");
pub(super) const SLOPES: &str = source!("shared/view", "shared/medium", "slopes");
pub(super) const OUTLINES: &str = source!("shared/view", "shared/medium", "shared/kernel", "outlines");
pub(super) const BATCHES: &str = source!("shared/view", "shared/medium", "batches");
pub(super) const SPLAT: &str = source!(
    "shared/view",
    "shared/medium",
    "shared/kernel",
    "shared/profile",
    "shared/contribution",
    "splat"
);
macro_rules! resolve {
    ($end:literal) => {
        source!(
            "shared/view",
            "shared/medium",
            "shared/kernel",
            "shared/profile",
            "shared/emission",
            "resolve",
            $end
        )
    };
}

pub(super) const RESOLVE_BLENDED: &str = resolve!("resolve_blended");
pub(super) const RESOLVE_KEPT: &str = resolve!("resolve_kept");

macro_rules! gather {
    ($($end:literal),*) => {
        source!(
            "shared/view",
            "shared/medium",
            "shared/kernel",
            "shared/profile",
            "shared/contribution",
            "gather",
            $($end),*
        )
    };
}

/// Where lanes of a subgroup can talk, and where they cannot.
pub(super) const GATHER_BY_LANES: &str = gather!("shared/emission", "gather_join", "gather_lanes");
pub(super) const GATHER_PLAINLY: &str = gather!("shared/emission", "gather_join", "gather_plain");
/// The same where sums are kept from shard to shard or slice by slice.
pub(super) const KEEP_BY_LANES: &str = gather!("gather_keep", "gather_lanes");
pub(super) const KEEP_PLAINLY: &str = gather!("gather_keep", "gather_plain");

pub(super) const LIMITS: &str = source!("limits");
pub(super) const CLIP: &str = source!("shared/view", "clip");
pub(super) const COMPOSE: &str = source!("shared/view", "compose");
pub(super) const OVERLAY: &str = source!("shared/whole", "overlay");
macro_rules! rival {
    ($end:literal) => {
        source!(
            "shared/view",
            "shared/medium",
            "shared/light",
            "shared/phase",
            "shared/density",
            "shared/fresnel",
            "shared/hierarchy",
            "rivals/rays",
            $end
        )
    };
}
pub(super) const RIVAL_MARCH: &str = rival!("rivals/march");
pub(super) const RIVAL_FILL: &str = rival!("rivals/fill");
pub(super) const DEPTHS: &str =
    source!("shared/view", "shared/medium", "shared/fresnel", "shared/hierarchy", "depths");
pub(super) const PUBLISH: &str = source!("shared/view", "publish");
pub(super) const DISPLAY: &str = source!("shared/whole", "display");

/// Compiles a shader.
pub(super) fn module(device: &Device, label: &str, source: &'static str) -> ShaderModule {
    device.create_shader_module(ShaderModuleDescriptor {
        label: Some(label),
        source: ShaderSource::Wgsl(source.into()),
    })
}
