// Splat pass: each sample's kernel, integrated in closed form along the part of every ray that lies in the current
// inside piece, added up without sorting. Twin of `reconstruct::piece_radiance`.
override GREY: bool = true;             // all channels have the same extinction
override HETEROGENEOUS: bool = false;   // the medium has a density profile

@group(1) @binding(0) var<storage, read> samples: array<vec4f>; // position, sharpness
@group(1) @binding(1) var<storage, read> sources: array<vec4f>; // v, weight
@group(1) @binding(2) var<storage, read> piece: array<vec4f>;
@group(1) @binding(3) var<storage, read> profile: array<vec2f>;

struct Splat {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) centre: vec4f, // as seen from the camera, sharpness
    @location(1) @interpolate(flat) source: vec4f, // v, weight
}

struct Sums {
    @location(0) numerator: vec4f,   // v * w * W per channel; number of kernels
    @location(1) denominator: vec4f, // w * W per channel
}

// Slopes of the two lines through the camera that touch a circle at (across, depth) with squared radius r2.
fn tangents(across: f32, depth: f32, r2: f32) -> vec2f {
    let spread = sqrt(r2 * max(across * across + depth * depth - r2, 0.0));
    let middle = across * depth;
    return vec2f(middle - spread, middle + spread) / (depth * depth - r2);
}

// A rectangle of the picture around the kernel's sphere: low and high corner in coordinates along right and up at
// distance 1. Empty when the sphere is behind the camera, everything when it reaches the camera's plane.
fn bounds(centre: vec3f, radius: f32) -> vec4f {
    let depth = dot(centre, view.forward);
    if (depth <= -radius) {
        return vec4f(1.0, 1.0, -1.0, -1.0);
    }
    if (depth < 1.01 * radius) {
        return vec4f(-1.0, -1.0, 1.0, 1.0) * 2.0;
    }
    let r2 = radius * radius;
    let wide = length(view.right);
    let high = length(view.up);
    let x = tangents(dot(centre, view.right) / wide, depth, r2) / wide;
    let y = tangents(dot(centre, view.up) / high, depth, r2) / high;
    return vec4f(x.x, y.x, x.y, y.y);
}

@vertex
fn quad(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Splat {
    let sample = samples[index];
    let source = sources[index];
    let centre = sample.xyz - view.origin;
    var box = bounds(centre, 1.0001 * CUT_OFF_RADIUS / sample.w);
    // Within three picture sizes, so that rasterisers keep their precision; a sixteenth of a pixel for rounding.
    let margin = 0.125 / vec2f(f32(view.width), f32(view.height));
    let empty = box.x > box.z;
    box = clamp(box, vec4f(-3.0), vec4f(3.0)) + vec4f(-margin, margin);
    let plane = select(box.xy, box.zw, vec2<bool>((corner & 1u) == 1u, (corner & 2u) == 2u));
    var position = tile_clip(plane, 1.0);
    if (source.w <= 0.0 || empty) {
        position = vec4f(2.0, 2.0, 0.0, 1.0);
    }
    position.z = 0.0;
    return Splat(position, vec4f(centre, sample.w), source);
}

@fragment
fn add(in: Splat) -> Sums {
    let pixel = vec2u(in.position.xy);
    let index = pixel_index(pixel);
    let whole = piece[index];
    if (whole.y <= whole.x) {
        discard;
    }
    let direction = ray_direction(pixel);
    let a = in.centre.w;
    let tc = dot(in.centre.xyz, direction);
    let across = in.centre.xyz - direction * tc;
    let d2 = dot(across, across);
    let h2 = CUT_OFF / (a * a) - d2;
    if (h2 <= 0.0) {
        discard;
    }
    let h = sqrt(h2);
    let ends = vec2f(max(whole.x, tc - h), min(whole.y, tc + h));
    if (ends.x >= ends.y) {
        discard;
    }
    var before = ends.x - whole.x;
    var kappa = medium.kappa;
    var scattering = 1.0;
    if (HETEROGENEOUS) {
        // Attenuation in front from the profile; inside the support it is taken as linear.
        let first = profile_at(index, ends.x - whole.x, whole.y - whole.x);
        let last = profile_at(index, ends.y - whole.x, whole.y - whole.x);
        let slope = (last - first) * (1.0 / (ends.y - ends.x));
        before = first.x;
        kappa *= slope.x;
        scattering = slope.y;
    }
    var w: vec3f;
    let decay = -medium.kappa * before;
    if (GREY) {
        w = vec3f(scattering * exp(decay.x) * kernel_integral(a, d2, tc, kappa.x, ends.x, ends.y));
    } else {
        w = scattering * exp(decay) * vec3f(
            kernel_integral(a, d2, tc, kappa.x, ends.x, ends.y),
            kernel_integral(a, d2, tc, kappa.y, ends.x, ends.y),
            kernel_integral(a, d2, tc, kappa.z, ends.x, ends.y));
    }
    w *= in.source.w;
    return Sums(vec4f(in.source.xyz * w, 1.0), vec4f(w, 0.0));
}
