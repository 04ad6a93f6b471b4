// Splat pass: each sample's kernel, integrated in closed form along the part of every ray that lies in the current
// inside piece, added up without sorting. Twin of `reconstruct::piece_radiance`.

@group(1) @binding(0) var<storage, read> samples: array<vec4f>; // position, sharpness
@group(1) @binding(1) var<storage, read> sources: array<vec4f>; // SOURCE a sample: v, weight; slopes
@group(1) @binding(2) var<storage, read> piece: array<vec4f>;
@group(1) @binding(3) var<storage, read> profile: array<vec4f>;
// Least start and greatest end of the current piece over 8 x 8 pixels: kernels that no ray meets draw nothing.
@group(1) @binding(4) var<storage, read> cells: array<vec2f>;

const SOURCE: u32 = 4u;
const CELL: u32 = 8u;
const MOST_CELLS: u32 = 64u;

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

// Corners of a hexagon around the unit circle, in the order of a triangle strip.
const HEXAGON = array<vec2f, 6>(
    vec2f(1.1547005, 0.0), vec2f(0.57735027, 1.0), vec2f(0.57735027, -1.0),
    vec2f(-0.57735027, 1.0), vec2f(-0.57735027, -1.0), vec2f(-1.1547005, 0.0));

// A kernel's sphere as the camera sees it, in coordinates along the unit axes of the picture at distance 1.
//
// A sphere with radius r at distance z along the view and p across it projects to an ellipse whose axes point away
// from the picture's centre and across: with w = z * z - r * r, middle p z / w, semi-axes r sqrt(p * p + w) / w and
// r / sqrt(w).
struct Outline {
    middle: vec2f,
    away: vec2f,
    axes: vec2f,
}

fn outline_of(centre: vec3f, radius: f32, unit: vec2f) -> Outline {
    let z = dot(centre, view.forward);
    if (z < 1.05 * radius) {
        // It reaches the camera's plane and may be anywhere in the picture.
        return Outline(vec2f(0.0), vec2f(1.0, 0.0), 4.0 * unit);
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
    return Outline(away * (p * z / w), away, axes);
}

// Whether the current piece of any pixel under an outline comes within `low`..`high` of the camera, as far as the
// cells know.
fn may_meet(outline: Outline, unit: vec2f, low: f32, high: f32) -> bool {
    let reach = vec2f(length(outline.axes * outline.away), length(outline.axes * outline.away.yx)) / unit;
    let middle = outline.middle / unit * vec2f(1.0, -1.0);
    let scale = 0.5 * vec2f(f32(view.width), f32(view.height));
    let start = vec2f(view.tile_start);
    let size = vec2f(view.tile_size);
    // One more pixel on each side for where rays stand in their pixels.
    let first = max((middle - reach + 1.0) * scale - start - 1.0, vec2f(0.0));
    let last = min((middle + reach + 1.0) * scale - start + 1.0, size - 1.0);
    if (any(first > last)) {
        return false;
    }
    let top = vec2u(first) / CELL;
    let bottom = vec2u(last) / CELL;
    if ((bottom.x - top.x + 1u) * (bottom.y - top.y + 1u) > MOST_CELLS) {
        return true;
    }
    let columns = (view.tile_size.x + CELL - 1u) / CELL;
    for (var y = top.y; y <= bottom.y; y++) {
        for (var x = top.x; x <= bottom.x; x++) {
            let range = cells[y * columns + x];
            if (range.x < high && range.y > low) {
                return true;
            }
        }
    }
    return false;
}

@vertex
fn outline(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Splat {
    let sample = samples[index];
    let source = sources[SOURCE * index];
    let centre = sample.xyz - view.origin;
    let radius = 1.0001 * CUT_OFF_RADIUS / sample.w;
    var position = vec4f(2.0, 2.0, 0.0, 1.0);
    if (source.w > 0.0 && dot(centre, view.forward) > -radius) {
        let unit = vec2f(length(view.right), length(view.up));
        let shape = outline_of(centre, radius, unit);
        let distance = length(centre);
        if (may_meet(shape, unit, distance - radius, distance + radius)) {
            let at = shape.axes * HEXAGON[corner];
            let turned = shape.away * at.x + vec2f(-shape.away.y, shape.away.x) * at.y;
            position = tile_clip((shape.middle + turned) / unit, 1.0);
        }
    }
    position.z = 0.0;
    let slopes = SOURCE * index + 1u;
    return Splat(position, vec4f(centre, sample.w), source,
        sources[slopes].xyz, sources[slopes + 1u].xyz, sources[slopes + 2u].xyz);
}

@fragment
fn add(in: Splat) -> Sums {
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
