// Clip pass, only with a host's depth buffer: inside pieces end at what stands in front of their end.
@group(1) @binding(0) var<storage, read> distances: array<f32>; // world units
@group(1) @binding(1) var<storage, read_write> pieces: array<vec4f>;

const MAX_PIECES: u32 = 4u;

@compute @workgroup_size(8, 8)
fn cut_off(@builtin(global_invocation_id) pixel: vec3u) {
    view = views[pixel.z];
    if (any(pixel.xy >= view.tile_size)) {
        return;
    }
    let place = view.tile_start + pixel.xy;
    let limit = distances[place.y * view.width + place.x] * view.per_unit;
    let index = pixel_index(pixel.xy);
    let stride = arrayLength(&pieces) / MAX_PIECES;
    for (var k = 0u; k < MAX_PIECES; k++) {
        let piece = pieces[k * stride + index];
        if (piece.y > limit) {
            // What ends inside meets no boundary there.
            pieces[k * stride + index] = select(vec4f(0.0), vec4f(piece.x, limit, piece.z, 1.0), piece.x < limit);
        }
    }
}
