// Display pass, for looking at only: exposure, then the display's encoding. Fills the viewport with the picture.
struct Display {
    exposure: f32,
    encode: u32,    // 1: the target stores encoded values as they are, so sRGB's curve is applied here
    unused: vec2u,
}

@group(0) @binding(0) var<uniform> display: Display;
@group(0) @binding(1) var picture: texture_2d<f32>;

fn load(at: vec2i, size: vec2i) -> vec3f {
    return textureLoad(picture, clamp(at, vec2i(0), size - 1), 0).rgb;
}

// Twin of `picture::Display::encode`.
fn srgb(x: vec3f) -> vec3f {
    return select(1.055 * pow(x, vec3f(1.0 / 2.4)) - 0.055, 12.92 * x, x <= vec3f(0.0031308));
}

@fragment
fn show(in: Corner) -> @location(0) vec4f {
    let size = vec2i(textureDimensions(picture));
    // Linear between pixel centres; on a centre where sizes agree.
    let at = in.at * vec2f(size) - 0.5;
    let low = vec2i(floor(at));
    let f = at - floor(at);
    let top = mix(load(low, size), load(low + vec2i(1, 0), size), f.x);
    let bottom = mix(load(low + vec2i(0, 1), size), load(low + vec2i(1, 1), size), f.x);
    let exposed = clamp(mix(top, bottom, f.y) * display.exposure, vec3f(0.0), vec3f(1.0));
    return vec4f(select(exposed, srgb(exposed), display.encode == 1u), 1.0);
}
