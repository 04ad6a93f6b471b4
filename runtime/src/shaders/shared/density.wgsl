// Density and its scattering part at a point, trilinear between voxels. Twin of `asset::DensityGrid::value`. The including
// shader declares `voxel_bits`: a voxel, two 16-bit floats, by its number in its slab and the slab's.
fn voxel(x: u32, y: u32, z: u32) -> vec2f {
    let slab = z / medium.grid_layers;
    let layer = z - slab * medium.grid_layers;
    return unpack2x16float(voxel_bits((layer * medium.grid_size.y + y) * medium.grid_size.x + x, slab));
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
