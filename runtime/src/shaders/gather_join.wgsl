// What a tile gathers joins the picture at once. Concatenated with gather.wgsl where the samples are one shard and one slice.
@group(1) @binding(5) var<storage, read_write> front: array<vec4f>;
@group(1) @binding(6) var<storage, read_write> radiance: array<vec4f>;
@group(1) @binding(7) var<storage, read_write> counters: array<vec4u>;

fn begin(ray: Ray, piece: u32, slice: u32) -> Sums {
    return Sums(vec3f(0.0), 0u, vec3f(0.0));
}

fn finish(ray: Ray, piece: u32, slice: u32, sums: Sums) {
    if (is_inside(ray)) {
        join(ray.index, ray.ends, sums.numerator, sums.denominator, sums.kernels);
    }
}
