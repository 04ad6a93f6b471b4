// One triangle around the viewport, with places in it: (0, 0) at the top left, (1, 1) at the bottom right.
struct Corner {
    @builtin(position) position: vec4f,
    @location(0) at: vec2f,
}

@vertex
fn whole(@builtin(vertex_index) corner: u32) -> Corner {
    let at = vec2f(f32(corner & 1u), f32(corner >> 1u)) * 2.0;
    return Corner(vec4f(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, 0.0, 1.0), at);
}
