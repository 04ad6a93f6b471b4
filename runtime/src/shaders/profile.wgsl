// Profile pass, only for media with a density grid: marches the grid along the current piece of each pixel.
// Twin of `reconstruct::Profile::march` and `asset::DensityGrid::value`.
const SUBSTEPS: u32 = 2u;

@group(1) @binding(0) var<storage, read> piece: array<vec4f>;
@group(1) @binding(1) var<storage, read_write> profile: array<vec4f>;
@group(1) @binding(2) var<storage, read> grid: array<u32>; // two 16-bit floats: density, its scattering part

fn voxel(x: u32, y: u32, z: u32) -> vec2f {
    return unpack2x16float(grid[(z * medium.grid_size.y + y) * medium.grid_size.x + x]);
}

fn density(p: vec3f) -> vec2f {
    let n = vec3f(medium.grid_size);
    let unit = (p - medium.grid_min) / (medium.grid_max - medium.grid_min);
    let s = clamp(unit * n - 0.5, vec3f(0.0), n - 1.0);
    let low = vec3u(s);
    let high = min(low + 1u, medium.grid_size - 1u);
    let f = s - vec3f(low);
    let y0 = lerp(lerp(voxel(low.x, low.y, low.z), voxel(high.x, low.y, low.z), f.x),
                  lerp(voxel(low.x, high.y, low.z), voxel(high.x, high.y, low.z), f.x), f.y);
    let y1 = lerp(lerp(voxel(low.x, low.y, high.z), voxel(high.x, low.y, high.z), f.x),
                  lerp(voxel(low.x, high.y, high.z), voxel(high.x, high.y, high.z), f.x), f.y);
    return lerp(y0, y1, f.z);
}

fn lerp(a: vec2f, b: vec2f, f: f32) -> vec2f {
    return a + (b - a) * f;
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) pixel: vec3u) {
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
