// Outlines pass: what every sample's kernel covers in the picture, and which pieces it may meet. Once a ray, for all of the
// splat pass's vertices.

@group(1) @binding(0) var<storage, read> samples: array<vec4f>; // position, sharpness
@group(1) @binding(1) var<storage, read> sources: array<vec4f>; // SOURCE a sample: v, weight; slopes
// Least start and greatest end of piece k over the 8 x 8 pixels of cell c at [k * stride + c].
@group(1) @binding(2) var<storage, read> cells: array<vec2f>;
@group(1) @binding(3) var<storage, read_write> outlines: array<Outline>;
// Whether sample i may meet piece k at [k * stride + i].
@group(1) @binding(4) var<storage, read_write> shown: array<u32>;

const SOURCE: u32 = 4u;
const CELL: u32 = 8u;
const MOST_CELLS: u32 = 64u;
const MAX_PIECES: u32 = 4u;
const ALL_PIECES: u32 = 15u;

// An ellipse in the picture: its middle and its semi-axes, from -1 to 1 across the whole picture.
struct Outline {
    middle: vec2f,
    first: vec2f,
    second: vec2f,
}

// A kernel's sphere as the camera sees it, in coordinates along the unit axes of the picture at distance 1.
//
// A sphere with radius r at distance z along the view and p across it projects to an ellipse whose axes point away
// from the picture's centre and across: with w = z * z - r * r, middle p z / w, semi-axes r sqrt(p * p + w) / w and
// r / sqrt(w).
struct Ellipse {
    middle: vec2f,
    away: vec2f,
    axes: vec2f,
}

fn ellipse_of(centre: vec3f, radius: f32, unit: vec2f) -> Ellipse {
    let z = dot(centre, view.forward);
    if (z < 1.05 * radius) {
        // It reaches the camera's plane and may be anywhere in the picture.
        return Ellipse(vec2f(0.0), vec2f(1.0, 0.0), 4.0 * unit);
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
    return Ellipse(away * (p * z / w), away, axes);
}

// The pieces (bit k: piece k) of any pixel under an outline that come within `low`..`high` of the camera, as far as the
// cells know.
fn may_meet(outline: Outline, low: f32, high: f32) -> u32 {
    let reach = vec2f(
        length(vec2f(outline.first.x, outline.second.x)), length(vec2f(outline.first.y, outline.second.y)));
    let middle = outline.middle * vec2f(1.0, -1.0);
    let scale = 0.5 * vec2f(f32(view.width), f32(view.height));
    let start = vec2f(view.tile_start);
    let size = vec2f(view.tile_size);
    // One more pixel on each side for where rays stand in their pixels.
    let first = max((middle - reach + 1.0) * scale - start - 1.0, vec2f(0.0));
    let last = min((middle + reach + 1.0) * scale - start + 1.0, size - 1.0);
    if (any(first > last)) {
        return 0u;
    }
    let top = vec2u(first) / CELL;
    let bottom = vec2u(last) / CELL;
    if ((bottom.x - top.x + 1u) * (bottom.y - top.y + 1u) > MOST_CELLS) {
        return ALL_PIECES;
    }
    let columns = (view.tile_size.x + CELL - 1u) / CELL;
    let stride = arrayLength(&cells) / MAX_PIECES;
    var met = 0u;
    for (var y = top.y; y <= bottom.y; y++) {
        for (var x = top.x; x <= bottom.x; x++) {
            for (var k = 0u; k < MAX_PIECES; k++) {
                let range = cells[k * stride + y * columns + x];
                met |= select(0u, 1u << k, range.x < high && range.y > low);
                if (range.x > range.y) {
                    // Pixels without this piece have none of the later ones.
                    break;
                }
            }
        }
    }
    return met;
}

@compute @workgroup_size(64)
fn outline(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = id.y * groups.x * 64u + id.x;
    if (index >= medium.samples) {
        return;
    }
    let sample = samples[index];
    let centre = sample.xyz - view.origin;
    let radius = 1.0001 * CUT_OFF_RADIUS / sample.w;
    var met = 0u;
    if (sources[SOURCE * index].w > 0.0 && dot(centre, view.forward) > -radius) {
        let unit = vec2f(length(view.right), length(view.up));
        let shape = ellipse_of(centre, radius, unit);
        let outline = Outline(
            shape.middle / unit,
            shape.away * shape.axes.x / unit,
            vec2f(-shape.away.y, shape.away.x) * shape.axes.y / unit);
        outlines[index] = outline;
        let distance = length(centre);
        met = may_meet(outline, distance - radius, distance + radius);
    }
    let stride = arrayLength(&shown) / MAX_PIECES;
    for (var k = 0u; k < MAX_PIECES; k++) {
        shown[k * stride + index] = (met >> k) & 1u;
    }
}
