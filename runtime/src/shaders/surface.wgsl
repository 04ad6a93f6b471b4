// Surface pass: every crossing of every ray with the mesh, sorted by distance, without depth buffer or culling.
//
// A key is a distance's bits with the lowest replaced by 1 for an entry (so that at equal distance exits come first,
// as in `visibility::inside_pieces`), then inverted: larger keys are nearer and 0 is empty. A chain of atomic maxima
// leaves the largest eight in order, whatever the order of the fragments.
const SLOTS: u32 = 8u;
const STATE: u32 = 10u; // slots, sum of signs (+1 exit, -1 entry), number of crossings

@group(1) @binding(0) var<storage, read> positions: array<f32>;
@group(1) @binding(1) var<storage, read> triangles: array<u32>;
@group(1) @binding(2) var<storage, read_write> crossings: array<atomic<u32>>;

struct Corner {
    @invariant @builtin(position) position: vec4f,
    // The triangle's corners as seen from the camera.
    @location(0) @interpolate(flat) a: vec3f,
    @location(1) @interpolate(flat) b: vec3f,
    @location(2) @interpolate(flat) c: vec3f,
    @location(3) @interpolate(flat) triangle: u32,
}

fn corner_position(corner: u32) -> vec3f {
    let v = 3u * triangles[corner];
    return vec3f(positions[v], positions[v + 1u], positions[v + 2u]) - view.origin;
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = index / 3u;
    let q = corner_position(index);
    let plane = vec2f(
        dot(q, view.right) / dot(view.right, view.right),
        dot(q, view.up) / dot(view.up, view.up));
    return Corner(
        tile_clip(plane, dot(q, view.forward)),
        corner_position(3u * triangle), corner_position(3u * triangle + 1u), corner_position(3u * triangle + 2u),
        triangle);
}

// Where the ray meets the triangle's plane, within the range of the triangle itself.
fn distance_to(in: Corner, direction: vec3f) -> f32 {
    let n = cross(in.b - in.a, in.c - in.a);
    let at = vec3f(dot(in.a, direction), dot(in.b, direction), dot(in.c, direction));
    let low = min(at.x, min(at.y, at.z));
    let high = max(at.x, max(at.y, at.z));
    let slope = dot(n, direction);
    var t = 0.5 * (low + high);
    if (slope != 0.0) {
        // From the foot of the first corner: the difference is small where the triangle is.
        t = at.x + dot(n, in.a - direction * at.x) / slope;
    }
    return max(clamp(t, low, high), 1e-30);
}

fn crossing_key(t: f32, entry: bool) -> u32 {
    return ~((bitcast<u32>(t) & 0xfffffffeu) | select(0u, 1u, entry));
}

@fragment
fn insert(in: Corner, @builtin(front_facing) entry: bool) {
    let pixel = vec2u(in.position.xy);
    let state = pixel_index(pixel) * STATE;
    var key = crossing_key(distance_to(in, ray_direction(pixel)), entry);
    for (var slot = 0u; slot < SLOTS && key != 0u; slot++) {
        key = min(key, atomicMax(&crossings[state + slot], key));
    }
    atomicAdd(&crossings[state + SLOTS], select(1u, 0xffffffffu, entry));
    atomicAdd(&crossings[state + SLOTS + 1u], 1u);
}
