// Limits pass, only with a host's depth buffer: how far every pixel of the picture sees, world units.
struct Limits {
    size: vec2u,
    unused: vec2u,
    inverse: mat4x4f,   // of the projection
}

@group(0) @binding(0) var<uniform> limits: Limits;
@group(0) @binding(1) var depth: texture_depth_2d;
@group(0) @binding(2) var<storage, read_write> distances: array<f32>;

const NOWHERE: f32 = 1e30;

@compute @workgroup_size(8, 8)
fn measure(@builtin(global_invocation_id) pixel: vec3u) {
    if (any(pixel.xy >= limits.size)) {
        return;
    }
    let at = (vec2f(pixel.xy) + 0.5) / vec2f(limits.size);
    let z = textureLoad(depth, vec2i(pixel.xy), 0);
    let eye = limits.inverse * vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, z, 1.0);
    // The far plane may lie at infinity.
    let distance = length(eye.xyz) / max(abs(eye.w), 1e-30);
    distances[pixel.y * limits.size.x + pixel.x] = min(distance, NOWHERE);
}
