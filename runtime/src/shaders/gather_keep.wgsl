// What a tile gathers is kept for the next shard of the samples, and for the resolve pass after the last one. Concatenated with
// gather.wgsl where there are several.

// Two a pixel: numerator and number of kernels; denominator. Floats as bits.
@group(1) @binding(5) var<storage, read_write> kept: array<vec4u>;

fn begin(ray: Ray) -> Sums {
    if (medium.first == 0u || !is_inside(ray)) {
        return Sums(vec3f(0.0), 0u, vec3f(0.0));
    }
    let numerator = kept[2u * ray.index];
    return Sums(bitcast<vec3f>(numerator.xyz), numerator.w, bitcast<vec3f>(kept[2u * ray.index + 1u].xyz));
}

fn finish(ray: Ray, sums: Sums) {
    if (is_inside(ray)) {
        kept[2u * ray.index] = vec4u(bitcast<vec3u>(sums.numerator), sums.kernels);
        kept[2u * ray.index + 1u] = vec4u(bitcast<vec3u>(sums.denominator), 0u);
    }
}
