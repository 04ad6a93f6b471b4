// What a piece emits and lets through. Twin of `reconstruct::Along`. The including shader declares
// HETEROGENEOUS and the buffers `profile`, `front`, `radiance` and `counters`.
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

// Adds what the piece `ends` of a pixel shows, given the sums over its kernels, to the picture.
fn join(index: u32, ends: vec4f, numerator: vec3f, denominator: vec3f, kernels: u32) {
    let length = ends.y - ends.x;
    var before = front[index];
    before = vec4f(before.xyz * ends.z, before.w);
    // Where nothing contributed the quotient is never used.
    let some = denominator > vec3f(0.0);
    let mean = select(vec3f(0.0), numerator / select(vec3f(1.0), denominator, some), some);
    radiance[index] += vec4f(before.xyz * emission(index, length) * mean, 0.0);
    counters[index].z += kernels;
    if (kernels > 0u && before.w == 0.0) {
        counters[index].w -= 1u;
        before.w = 1.0;
    }
    front[index] = vec4f(before.xyz * transmittance(index, length) * ends.w, before.w);
}
