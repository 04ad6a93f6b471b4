// Resolve pass: radiance of the current piece of each pixel as seen through the pieces in front, added to the
// picture. Twin of `reconstruct::Along` and the end of `piece_radiance`.
override HETEROGENEOUS: bool = false;

@group(1) @binding(0) var<storage, read> piece: array<vec4f>;
@group(1) @binding(1) var<storage, read> profile: array<vec4f>;
@group(1) @binding(2) var<storage, read_write> front: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> radiance: array<vec4f>;
@group(1) @binding(4) var<storage, read_write> counters: array<vec4u>;
@group(1) @binding(5) var numerators: texture_2d<f32>;
@group(1) @binding(6) var denominators: texture_2d<f32>;

// Emission of a unit source along the piece, per channel.
fn emission(index: u32, length: f32) -> vec3f {
    if (!HETEROGENEOUS) {
        let y = medium.kappa * length;
        return y * decay_mean3(y);
    }
    let stride = profile_stride();
    var sum = vec3f(0.0);
    var low = profile[index];
    for (var k = 0u; k < PROFILE_CELLS; k++) {
        let high = profile[(k + 1u) * stride + index];
        let mean = decay_mean3(medium.kappa * (high.x - low.x));
        sum += exp(-medium.kappa * low.x) * (medium.kappa * (high.y - low.y)) * mean;
        low = high;
    }
    return sum;
}

fn transmittance(index: u32, length: f32) -> vec3f {
    if (HETEROGENEOUS) {
        return exp(-medium.kappa * profile[PROFILE_CELLS * profile_stride() + index].x);
    }
    return exp(-medium.kappa * length);
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) pixel: vec3u) {
    if (any(pixel.xy >= view.tile_size)) {
        return;
    }
    let index = pixel_index(pixel.xy);
    let ends = piece[index];
    let length = ends.y - ends.x;
    if (length <= 0.0) {
        return;
    }
    let numerator = textureLoad(numerators, pixel.xy, 0);
    let denominator = textureLoad(denominators, pixel.xy, 0).xyz;
    var before = front[index];
    before = vec4f(before.xyz * ends.z, before.w);
    // Where nothing contributed the quotient is never used.
    let some = denominator > vec3f(0.0);
    let mean = select(vec3f(0.0), numerator.xyz / select(vec3f(1.0), denominator, some), some);
    radiance[index] += vec4f(before.xyz * emission(index, length) * mean, 0.0);
    counters[index].z += u32(numerator.w);
    if (numerator.w > 0.0 && before.w == 0.0) {
        counters[index].w -= 1u;
        before.w = 1.0;
    }
    front[index] = vec4f(before.xyz * transmittance(index, length) * ends.w, before.w);
}
