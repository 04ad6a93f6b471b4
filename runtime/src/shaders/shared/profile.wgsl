// Running integrals of (density, its scattering part) along the current inside piece of each pixel: value k of
// pixel i at [k * stride + i]. Twin of `reconstruct::Profile`. The including shader declares `profile`.
const PROFILE_CELLS: u32 = 32u;

fn profile_stride() -> u32 {
    return arrayLength(&profile) / (PROFILE_CELLS + 1u);
}

// From the piece's start to the distance `along` behind it, linear between the points.
fn profile_at(index: u32, along: f32, length: f32) -> vec2f {
    let s = clamp(along / (length / f32(PROFILE_CELLS)), 0.0, f32(PROFILE_CELLS));
    let i = min(u32(s), PROFILE_CELLS - 1u);
    let stride = profile_stride();
    let low = profile[i * stride + index];
    let high = profile[(i + 1u) * stride + index];
    return low + (high - low) * (s - f32(i));
}
