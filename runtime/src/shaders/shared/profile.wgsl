// Running integrals of (density, its scattering part, that times the distance from the piece's start, 0) along the
// current inside piece of each pixel: value k of pixel i at [k * stride + i]. Twin of `reconstruct::Profile`. The
// including shader declares `profile`.
const PROFILE_CELLS: u32 = 32u;

fn profile_stride() -> u32 {
    return arrayLength(&profile) / (PROFILE_CELLS + 1u);
}

// From the piece's start to the distance `along` behind it; the density is taken as even between the points.
fn profile_at(index: u32, along: f32, length: f32) -> vec3f {
    let cell = length / f32(PROFILE_CELLS);
    let s = clamp(along / cell, 0.0, f32(PROFILE_CELLS));
    let i = min(u32(s), PROFILE_CELLS - 1u);
    let stride = profile_stride();
    let low = profile[i * stride + index].xyz;
    let change = profile[(i + 1u) * stride + index].xyz - low;
    let f = s - f32(i);
    return low + change * f - vec3f(0.0, 0.0, 0.5 * change.y * f * (1.0 - f) * cell);
}
