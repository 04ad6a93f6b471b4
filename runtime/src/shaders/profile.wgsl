// Profile pass, only for media with a density grid: marches the grid along the current piece of each pixel.
// Twin of `reconstruct::Profile::march`.
const SUBSTEPS: u32 = 2u;

@group(1) @binding(0) var<storage, read> piece: array<vec4f>;
@group(1) @binding(1) var<storage, read_write> profile: array<vec4f>;
// The grid, cut along z into as many slabs as bindings ask for.
@group(1) @binding(2) var<storage, read> slab_0: array<u32>;
@group(1) @binding(3) var<storage, read> slab_1: array<u32>;
@group(1) @binding(4) var<storage, read> slab_2: array<u32>;
@group(1) @binding(5) var<storage, read> slab_3: array<u32>;
@group(1) @binding(6) var<storage, read> slab_4: array<u32>;
@group(1) @binding(7) var<storage, read> slab_5: array<u32>;

override SLABS: bool = false; // there is more than one

fn voxel_bits(place: u32, slab: u32) -> u32 {
    if (SLABS) {
        switch slab {
            case 1u: { return slab_1[place]; }
            case 2u: { return slab_2[place]; }
            case 3u: { return slab_3[place]; }
            case 4u: { return slab_4[place]; }
            case 5u: { return slab_5[place]; }
            default: {}
        }
    }
    return slab_0[place];
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) pixel: vec3u) {
    view = views[pixel.z];
    if (any(pixel.xy >= view.tile_size)) {
        return;
    }
    let index = pixel_index(pixel.xy);
    let ends = piece[index];
    if (ends.y <= ends.x) {
        return;
    }
    let direction = ray_direction(pixel.xy);
    let h = (ends.y - ends.x) / f32(PROFILE_CELLS) / f32(SUBSTEPS);
    let stride = profile_stride();
    var sum = vec3f(0.0);
    profile[index] = vec4f(0.0);
    for (var k = 0u; k < PROFILE_CELLS; k++) {
        for (var s = 0u; s < SUBSTEPS; s++) {
            let along = (f32(k * SUBSTEPS + s) + 0.5) * h;
            let value = density(view.origin + direction * (ends.x + along)) * h;
            sum += vec3f(value, value.y * along);
        }
        profile[(k + 1u) * stride + index] = vec4f(sum, 0.0);
    }
}
