// Splat pass: each sample's kernel, integrated in closed form along the part of every ray that lies in the current
// inside piece, added up without sorting. Twin of `reconstruct::piece_radiance`.

@group(1) @binding(0) var<storage, read> samples: array<vec4f>; // position, sharpness
@group(1) @binding(1) var<storage, read> sources: array<vec4f>; // SOURCE a sample: v, weight; slopes
@group(1) @binding(2) var<storage, read> piece: array<vec4f>;
@group(1) @binding(3) var<storage, read> profile: array<vec4f>;
@group(1) @binding(4) var<storage, read> outlines: array<Outline>;
// Whether a sample's kernel may meet the current piece of any pixel; those that do not draw nothing.
@group(1) @binding(5) var<storage, read> shown: array<u32>;
@group(1) @binding(6) var<storage, read> batches: array<u32>; // that have such samples

const SOURCE: u32 = 4u;
const TRIANGLE_PIXELS: f32 = 9.0;
const SQUARE_PIXELS: f32 = 20.0;
const BATCH: u32 = 64u; // samples of an instance

// See outlines.wgsl.
struct Outline {
    middle: vec2f,
    first: vec2f,
    second: vec2f,
}

struct Splat {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) centre: vec4f, // as seen from the camera, sharpness
    @location(1) @interpolate(flat) source: vec4f, // v, weight
    @location(2) @interpolate(flat) slope_r: vec3f,
    @location(3) @interpolate(flat) slope_g: vec3f,
    @location(4) @interpolate(flat) slope_b: vec3f,
}

struct Sums {
    @location(0) numerator: vec4f,   // v * w * W per channel; number of kernels
    @location(1) denominator: vec4f, // w * W per channel
}

// Corners of shapes around the unit circle, in the order of a triangle strip. Few triangles waste few of the pixels that
// rasterisers shade together along edges; many lie closer around the circle.
const TRIANGLE = array<vec2f, 6>(
    vec2f(2.0, 0.0), vec2f(-1.0, 1.7320508), vec2f(-1.0, -1.7320508),
    vec2f(-1.0, -1.7320508), vec2f(-1.0, -1.7320508), vec2f(-1.0, -1.7320508));
const SQUARE = array<vec2f, 6>(
    vec2f(1.0, 1.0), vec2f(-1.0, 1.0), vec2f(1.0, -1.0), vec2f(-1.0, -1.0), vec2f(-1.0, -1.0), vec2f(-1.0, -1.0));
const HEXAGON = array<vec2f, 6>(
    vec2f(1.1547005, 0.0), vec2f(0.57735027, 1.0), vec2f(0.57735027, -1.0),
    vec2f(-0.57735027, 1.0), vec2f(-0.57735027, -1.0), vec2f(-1.1547005, 0.0));

// Vertex 6 k + c is corner c of the k-th sample of its instance.
@vertex
fn outline(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Splat {
    view = views[0];
    let index = BATCH * batches[instance] + vertex / 6u;
    if (index >= medium.samples || shown[index] == 0u) {
        return Splat(vec4f(2.0, 2.0, 0.0, 1.0), vec4f(0.0), vec4f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
    }
    let shape = outlines[index];
    let pixels = length(shape.first * 0.5 * vec2f(f32(view.width), f32(view.height)));
    let corner = vertex % 6u;
    var at = HEXAGON[corner];
    if (pixels < TRIANGLE_PIXELS) {
        at = TRIANGLE[corner];
    } else if (pixels < SQUARE_PIXELS) {
        at = SQUARE[corner];
    }
    var position = tile_clip(shape.middle + shape.first * at.x + shape.second * at.y, 1.0);
    position.z = 0.0;
    let sample = samples[index];
    let slopes = SOURCE * (view.slot * medium.samples + index) + 1u;
    return Splat(position, vec4f(sample.xyz - view.origin, sample.w), sources[slopes - 1u],
        sources[slopes].xyz, sources[slopes + 1u].xyz, sources[slopes + 2u].xyz);
}

@fragment
fn add(in: Splat) -> Sums {
    view = views[0];
    let pixel = vec2u(in.position.xy);
    let index = pixel_index(pixel);
    let whole = piece[index].xy;
    if (whole.y <= whole.x) {
        discard;
    }
    let kernel = Kernel(in.centre.xyz, in.centre.w, in.source, in.slope_r, in.slope_g, in.slope_b);
    let sums = contribution(kernel, index, ray_direction(pixel), whole);
    if (!sums.met) {
        discard;
    }
    return Sums(vec4f(sums.numerator, 1.0), vec4f(sums.denominator, 0.0));
}
