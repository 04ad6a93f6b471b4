// Sums that tiles kept over the shards of the samples, slice by slice; see gather_keep.wgsl.
@group(1) @binding(5) var<storage, read> kept: array<vec4u>;

fn sums_at(pixel: vec2u, index: u32, piece: u32) -> Sums {
    var sums = Sums(vec3f(0.0), 0u, vec3f(0.0));
    for (var slice = 0u; slice < view.slices; slice++) {
        let at = 2u * ((piece * view.slices + slice) * view.pixels + index);
        let numerator = kept[at];
        sums.numerator += bitcast<vec3f>(numerator.xyz);
        sums.kernels += numerator.w;
        sums.denominator += bitcast<vec3f>(kept[at + 1u].xyz);
    }
    return sums;
}
