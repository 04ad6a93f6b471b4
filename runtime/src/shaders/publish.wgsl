// Publish pass: the mean of the rays so far, a tile at a time, into a texture: radiance, and coverage in alpha.
@group(1) @binding(0) var<storage, read> radiance: array<vec4f>;
@group(1) @binding(1) var<storage, read> counters: array<vec4u>;

@vertex
fn whole(@builtin(vertex_index) corner: u32) -> @builtin(position) vec4f {
    // One triangle around the viewport.
    return vec4f(f32(corner & 1u) * 4.0 - 1.0, f32(corner >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn mean(@builtin(position) position: vec4f) -> @location(0) vec4f {
    view = views[0];
    let index = pixel_index(vec2u(position.xy) - view.tile_start);
    return vec4f(radiance[index].xyz, f32(counters[index].x)) / f32(view.rays);
}
