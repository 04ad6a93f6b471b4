// Overlay pass: the composed picture over a host's colours, which it attenuates channel by channel before it adds to them.
struct Overlay {
    size: vec2u,
    exposure: f32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> overlay: Overlay;
@group(0) @binding(1) var<storage, read> total: array<vec4f>;
@group(0) @binding(2) var<storage, read> opaque: array<vec4f>;

fn place(at: vec2f) -> u32 {
    let pixel = min(vec2u(at * vec2f(overlay.size)), overlay.size - 1u);
    return pixel.y * overlay.size.x + pixel.x;
}

@fragment
fn attenuate(in: Corner) -> @location(0) vec4f {
    return vec4f(1.0 - opaque[place(in.at)].xyz, 1.0);
}

@fragment
fn shine(in: Corner) -> @location(0) vec4f {
    let index = place(in.at);
    let held = opaque[index].xyz;
    return vec4f(total[index].xyz * overlay.exposure, (held.x + held.y + held.z) / 3.0);
}
