// Outlines pass: which samples a ray of every pixel may see and why it sees no others; where kernels are drawn by quads also what
// each covers in the picture, and which pieces it may meet. Once a ray, for all of the splat pass's vertices. Twin of
// `cpu::shown`.
override DRAWN: bool = true; // kernels are drawn by quads

@group(1) @binding(0) var<storage, read> samples: array<vec4f>; // position, sharpness
@group(1) @binding(1) var<storage, read> sources: array<vec4f>; // SOURCE a sample: v, weight; slopes
// Least start, greatest end and greatest start of piece k over the 8 x 8 pixels of cell c at [k * stride + c].
@group(1) @binding(2) var<storage, read> cells: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> outlines: array<Outline>;
// Whether sample i may meet piece k at [k * stride + i].
@group(1) @binding(4) var<storage, read_write> shown: array<u32>;
@group(1) @binding(5) var<storage, read_write> batches: array<atomic<u32>>; // see batches.wgsl
// Samples of each class below; batches drawn and there, summed over the pieces that occur; for each piece, tiles of 16 x 16 pixels
// that have it, and views in which it occurs.
@group(1) @binding(6) var<storage, read_write> census: array<atomic<u32>>;

// Classes of samples: without weight; nowhere in the picture; between the rays of its pixels; where no ray is inside the object;
// behind so much of it that nothing is seen; all others.
const DARK: u32 = 0u;
const OUTSIDE: u32 = 1u;
const BETWEEN: u32 = 2u;
const APART: u32 = 3u;
const HIDDEN: u32 = 4u;
const SHOWN: u32 = 5u;

const SOURCE: u32 = 4u;
const CELL: u32 = 8u;
const MOST_CELLS: u32 = 256u;
const MAX_PIECES: u32 = 4u;
const ALL_PIECES: u32 = 15u;
const BATCH: u32 = 64u;
const DRAWS: u32 = 64u;

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

// What is known of a kernel.
struct Sight {
    kind: u32,
    pieces: u32, // bit k: it may meet piece k
}

// Of a kernel with an outline, `low`..`high` away from the camera, as far as the cells know.
fn sight_of(outline: Outline, low: f32, high: f32) -> Sight {
    let reach = vec2f(
        length(vec2f(outline.first.x, outline.second.x)), length(vec2f(outline.first.y, outline.second.y)));
    let middle = outline.middle * vec2f(1.0, -1.0);
    let scale = 0.5 * vec2f(f32(view.width), f32(view.height));
    let start = vec2f(view.tile_start);
    let size = vec2f(view.tile_size);
    // Pixels whose rays run through the box around the outline, which has a margin.
    let first = max(ceil((middle - reach + 1.0) * scale - start - view.offset), vec2f(0.0));
    let last = min(floor((middle + reach + 1.0) * scale - start - view.offset), size - 1.0);
    if (any(last < vec2f(0.0)) || any(first > size - 1.0)) {
        return Sight(OUTSIDE, 0u);
    }
    if (any(first > last)) {
        return Sight(BETWEEN, 0u);
    }
    let top = vec2u(first) / CELL;
    let bottom = vec2u(last) / CELL;
    if ((bottom.x - top.x + 1u) * (bottom.y - top.y + 1u) > MOST_CELLS) {
        return Sight(SHOWN, ALL_PIECES);
    }
    let columns = (view.tile_size.x + CELL - 1u) / CELL;
    let stride = arrayLength(&cells) / MAX_PIECES;
    var met = 0u;
    var hidden = false;
    for (var y = top.y; y <= bottom.y; y++) {
        for (var x = top.x; x <= bottom.x; x++) {
            for (var k = 0u; k < MAX_PIECES; k++) {
                let range = cells[k * stride + view.first_cell + y * columns + x];
                if (range.x > range.y) {
                    // Pixels without this piece have none of the later ones.
                    break;
                }
                if (range.x < high && range.y > low) {
                    let seen = low < range.z + medium.sight;
                    met |= select(0u, 1u << k, seen);
                    hidden |= !seen;
                }
            }
        }
    }
    return Sight(select(select(APART, HIDDEN, hidden), SHOWN, met != 0u), met);
}

@compute @workgroup_size(64)
fn outline(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    view = views[id.z];
    let index = id.y * groups.x * 64u + id.x;
    if (index >= medium.samples) {
        return;
    }
    let sample = samples[index];
    let centre = sample.xyz - view.origin;
    let radius = 1.0001 * CUT_OFF_RADIUS / sample.w;
    var sight = Sight(DARK, 0u);
    if (sources[SOURCE * (view.slot * medium.samples + index)].w > 0.0) {
        sight.kind = OUTSIDE;
        if (dot(centre, view.forward) > -radius) {
            let unit = vec2f(length(view.right), length(view.up));
            let shape = ellipse_of(centre, radius, unit);
            let outline = Outline(
                shape.middle / unit,
                shape.away * shape.axes.x / unit,
                vec2f(-shape.away.y, shape.away.x) * shape.axes.y / unit);
            if (DRAWN) {
                outlines[index] = outline;
            }
            let distance = length(centre);
            sight = sight_of(outline, distance - radius, distance + radius);
        }
    }
    atomicAdd(&census[sight.kind], 1u);
    if (!DRAWN) {
        return;
    }
    let batch = index / BATCH;
    let count = (medium.samples + BATCH - 1u) / BATCH;
    let marks = max((count + 2047u) / 2048u, 1u) * 64u;
    let stride = arrayLength(&shown) / MAX_PIECES;
    for (var k = 0u; k < MAX_PIECES; k++) {
        let may_meet = (sight.pieces >> k) & 1u;
        shown[k * stride + index] = may_meet;
        if (may_meet == 1u) {
            atomicOr(&batches[DRAWS + k * marks + batch / 32u], 1u << (batch & 31u));
        }
    }
}
