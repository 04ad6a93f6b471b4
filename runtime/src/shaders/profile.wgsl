// Profile pass, only for media with a density grid: marches the grid along the current piece of each pixel.
// Twin of `reconstruct::Profile::march`.
const SUBSTEPS: u32 = 2u;

@group(1) @binding(0) var<storage, read> piece: array<vec4f>;
@group(1) @binding(1) var<storage, read_write> profile: array<vec4f>;
@group(1) @binding(2) var<storage, read> grid: array<u32>; // two 16-bit floats: density, its scattering part

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
