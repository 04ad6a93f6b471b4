// Sums that tiles kept over the shards of the samples; see gather_keep.wgsl.
@group(1) @binding(5) var<storage, read> kept: array<vec4u>;

fn sums_at(pixel: vec2u, index: u32) -> Sums {
    let numerator = kept[2u * index];
    return Sums(bitcast<vec3f>(numerator.xyz), numerator.w, bitcast<vec3f>(kept[2u * index + 1u].xyz));
}
