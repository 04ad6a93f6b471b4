// Resolve pass: radiance of the pieces of each pixel as seen through those in front, added to the picture. Twin of
// `reconstruct::Along` and the end of `piece_radiance`. Where sums come from, `sums_at`, follows in resolve_blended.wgsl or
// resolve_kept.wgsl.
override HETEROGENEOUS: bool = false;
override PIECES: u32 = 1u; // see gather.wgsl

@group(1) @binding(0) var<storage, read> pieces: array<vec4f>;
@group(1) @binding(1) var<storage, read> profile: array<vec4f>;
@group(1) @binding(2) var<storage, read_write> front: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> radiance: array<vec4f>;
@group(1) @binding(4) var<storage, read_write> counters: array<vec4u>;

struct Sums {
    numerator: vec3f,
    kernels: u32,
    denominator: vec3f,
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) pixel: vec3u) {
    view = views[pixel.z];
    if (any(pixel.xy >= view.tile_size)) {
        return;
    }
    let index = pixel_index(pixel.xy);
    for (var piece = 0u; piece < PIECES; piece++) {
        let ends = pieces[piece * (arrayLength(&pieces) / PIECES) + index];
        if (ends.y <= ends.x) {
            break;
        }
        let sums = sums_at(pixel.xy, index, piece);
        join(index, ends, sums.numerator, sums.denominator, sums.kernels);
    }
}
