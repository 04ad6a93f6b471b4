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

// Corners of a hexagon around the unit circle, in the order of a triangle strip.
const HEXAGON = array<vec2f, 6>(
    vec2f(1.1547005, 0.0), vec2f(0.57735027, 1.0), vec2f(0.57735027, -1.0),
    vec2f(-0.57735027, 1.0), vec2f(-0.57735027, -1.0), vec2f(-1.1547005, 0.0));

// A corner of a hexagon around the kernel's sphere as the camera sees it, in coordinates along right and up.
//
// A sphere with radius r at distance z along the view and p across it projects to an ellipse whose axes point away
// from the picture's centre and across: with w = z * z - r * r, middle p z / w, semi-axes r sqrt(p * p + w) / w and
// r / sqrt(w). A sphere that reaches the camera's plane may be anywhere in the picture.
fn corner_around(centre: vec3f, radius: f32, corner: u32) -> vec2f {
    let unit = vec2f(length(view.right), length(view.up)); // of right and up, at distance 1
    let z = dot(centre, view.forward);
    if (z < 1.05 * radius) {
        return 4.0 * HEXAGON[corner];
    }
    let across = vec2f(dot(centre, view.right), dot(centre, view.up)) / unit;
    let p = length(across);
    var away = vec2f(1.0, 0.0);
    if (p > 0.0) {
        away = across / p;
    }
    // An eighth of a pixel for the rounding of coordinates.
    let margin = 0.25 * max(unit.x / f32(view.width), unit.y / f32(view.height));
    let w = z * z - radius * radius;
    let axes = vec2f(radius * sqrt(p * p + w) / w, radius / sqrt(w)) + margin;
    let at = vec2f(p * z / w, 0.0) + axes * HEXAGON[corner];
    return (away * at.x + vec2f(-away.y, away.x) * at.y) / unit;
}

@vertex
fn outline(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Splat {
    let sample = samples[index];
    let source = sources[index];
    let centre = sample.xyz - view.origin;
    let radius = 1.0001 * CUT_OFF_RADIUS / sample.w;
    var position = vec4f(2.0, 2.0, 0.0, 1.0);
    if (source.w > 0.0 && dot(centre, view.forward) > -radius) {
        position = tile_clip(corner_around(centre, radius, corner), 1.0);
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
    var path = Path(ends.x - tc, ends.y - ends.x, ends.x - whole.x, 1.0, 1.0);
    if (HETEROGENEOUS) {
        // Attenuation in front from the profile; inside the support it is taken as linear.
        let first = profile_at(index, ends.x - whole.x, whole.y - whole.x);
        let last = profile_at(index, ends.y - whole.x, whole.y - whole.x);
        let slope = (last - first) * (1.0 / path.length);
        path.before = first.x;
        path.density = slope.x;
        path.scattering = slope.y;
    }
    let long = a * (whole.y - whole.x) >= LEAST_WIDTHS;
    var w = vec3f(kernel_weight(a, d2, path, medium.kappa.x, long));
    if (!GREY) {
        w.y = kernel_weight(a, d2, path, medium.kappa.y, long);
        w.z = kernel_weight(a, d2, path, medium.kappa.z, long);
    }
    w *= in.source.w;
    return Sums(vec4f(in.source.xyz * w, 1.0), vec4f(w, 0.0));
}
