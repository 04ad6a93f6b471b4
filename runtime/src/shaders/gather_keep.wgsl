// What a tile gathers is kept for the next shard of the samples, and for the resolve pass after the last one. Concatenated with
// gather.wgsl where there are several shards or slices.

// Two a pixel, slice and piece: numerator and number of kernels; denominator. Floats as bits.
@group(1) @binding(5) var<storage, read_write> kept: array<vec4u>;

fn kept_at(ray: Ray, piece: u32, slice: u32) -> u32 {
    return 2u * ((piece * view.slices + slice) * view.pixels + ray.index);
}

fn begin(ray: Ray, piece: u32, slice: u32) -> Sums {
    if (medium.first == 0u || !is_inside(ray)) {
        return Sums(vec3f(0.0), 0u, vec3f(0.0));
    }
    let at = kept_at(ray, piece, slice);
    let numerator = kept[at];
    return Sums(bitcast<vec3f>(numerator.xyz), numerator.w, bitcast<vec3f>(kept[at + 1u].xyz));
}

fn finish(ray: Ray, piece: u32, slice: u32, sums: Sums) {
    if (is_inside(ray)) {
        let at = kept_at(ray, piece, slice);
        kept[at] = vec4u(bitcast<vec3u>(sums.numerator), sums.kernels);
        kept[at + 1u] = vec4u(bitcast<vec3u>(sums.denominator), 0u);
    }
}
