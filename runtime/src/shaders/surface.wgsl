// Surface pass: every crossing of every ray with the mesh, sorted by distance, without depth buffer or culling.
//
// A key is a distance's bits with the lowest replaced by 1 for an entry (so that at equal distance exits come first,
// as in `visibility::inside_pieces`), then inverted: larger keys are nearer and 0 is empty. A chain of atomic maxima
// leaves the largest eight in order, whatever the order of the fragments.
const SLOTS: u32 = 8u;
const STATE: u32 = 10u; // slots, sum of signs (+1 exit, -1 entry), number of crossings

// The rasteriser decides which triangles a ray meets, so that a closed mesh has no gaps, but it rounds positions to a
// fraction of a pixel. Where a ray runs past a triangle by less than that, `meet` looks for the neighbour that it
// really meets. Distances are measured from a point of the ray next to the triangle, with the rounding of large
// coordinates carried along.

@group(1) @binding(0) var<storage, read> positions: array<f32>;
@group(1) @binding(1) var<storage, read> triangles: array<u32>;
@group(1) @binding(2) var<storage, read_write> crossings: array<atomic<u32>>;
@group(1) @binding(3) var<storage, read> neighbours: array<u32>; // across the edges 0-1, 1-2, 2-0

struct Corner {
    @invariant @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) @interpolate(flat) object: u32,
}

fn corner_position(corner: u32) -> vec3f {
    let v = 3u * triangles[corner];
    return vec3f(positions[v], positions[v + 1u], positions[v + 2u]);
}

// Vertex i begins triangle i, and flat values are those of a triangle's first vertex.
@vertex
fn corner(
    @builtin(vertex_index) triangle: u32,
    @builtin(instance_index) object: u32,
    @location(0) position: vec3f,
) -> Corner {
    view = views[object];
    let q = position - view.origin;
    let plane = vec2f(
        dot(q, view.right) / dot(view.right, view.right),
        dot(q, view.up) / dot(view.up, view.up));
    return Corner(tile_clip(plane, dot(q, view.forward)), triangle, object);
}

// x without its lower 12 bits: products of two such numbers are exact.
fn coarse(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) & 0xfffff000u);
}

// p - origin - direction * t for a coarse t, with hardly any rounding (Knuth's difference and Dekker's product).
fn from_ray(p: vec3f, direction: vec3f, t: f32) -> vec3f {
    let d = p - view.origin;
    let back = p - d;
    let lost = (p - (d + back)) + (back - view.origin);
    let high = vec3f(coarse(direction.x), coarse(direction.y), coarse(direction.z));
    return ((d - high * t) - (direction - high) * t) + lost;
}

struct Meeting {
    triangle: u32,
    t: f32,
    area: vec3f,    // outward normal times twice the area
}

// Where the ray meets the surface at or next to `first`, which the rasteriser named.
fn meet(first: u32, entry: bool, direction: vec3f) -> Meeting {
    var named = Meeting(first, 0.0, vec3f(0.0));
    var triangle = first;
    for (var step = 0u; step < 4u; step++) {
        let a = corner_position(3u * triangle);
        let b = corner_position(3u * triangle + 1u);
        let c = corner_position(3u * triangle + 2u);
        let area = cross(b - a, c - a);
        let slope = dot(area, direction);
        let near = coarse(dot(a - view.origin, direction));
        let qa = from_ray(a, direction, near);
        let qb = from_ray(b, direction, near);
        let qc = from_ray(c, direction, near);
        var t = near;
        if (slope != 0.0) {
            t += dot(area, qa) / slope;
        }
        if (step == 0u) {
            let at = vec3f(dot(qa, direction), dot(qb, direction), dot(qc, direction)) + near;
            let low = min(at.x, min(at.y, at.z));
            named = Meeting(first, max(clamp(t, low, max(at.x, max(at.y, at.z))), 1e-30), area);
        } else if (t <= 0.0) {
            break;
        }
        // Edge functions are not negative where the ray is inside; they add up to |slope|.
        let side = select(1.0, -1.0, entry);
        if (slope * side <= 0.0) {
            break;
        }
        let edges = side * vec3f(
            dot(direction, cross(qa, qb)), dot(direction, cross(qb, qc)), dot(direction, cross(qc, qa)));
        var across = 0u;
        var least = edges.x;
        if (edges.y < least) {
            across = 1u;
            least = edges.y;
        }
        if (edges.z < least) {
            across = 2u;
            least = edges.z;
        }
        if (least >= 0.0) {
            return Meeting(triangle, max(t, 1e-30), area);
        }
        triangle = neighbours[3u * triangle + across];
    }
    return named;
}

fn crossing_key(t: f32, entry: bool) -> u32 {
    return ~((bitcast<u32>(t) & 0xfffffffeu) | select(0u, 1u, entry));
}

@fragment
fn insert(in: Corner, @builtin(front_facing) entry: bool) {
    view = views[in.object];
    let pixel = vec2u(in.position.xy);
    if (any(pixel >= view.tile_size)) {
        return;
    }
    let state = pixel_index(pixel) * STATE;
    var key = crossing_key(meet(in.triangle, entry, ray_direction(pixel)).t, entry);
    for (var slot = 0u; slot < SLOTS && key != 0u; slot++) {
        key = min(key, atomicMax(&crossings[state + slot], key));
    }
    atomicAdd(&crossings[state + SLOTS], select(1u, 0xffffffffu, entry));
    atomicAdd(&crossings[state + SLOTS + 1u], 1u);
}
