// Depths pass: exact optical depths from samples to one light, a thread each. Twin of `exact::DepthTracer` for media of even density
// whose shells do not overlap.
struct Request {
    place: vec3f,       // of the light, or the way it travels where it is far away
    far: u32,           // 1: directional
    first: u32,         // sample
    count: u32,
    density: f32,
    unused: u32,
}

@group(1) @binding(2) var<storage, read> places: array<vec4f>; // of the samples' values
@group(1) @binding(3) var<uniform> request: Request;
// Density length, what the boundary lets through; below 0 where the driver may have ended the walk early.
@group(1) @binding(4) var<storage, read_write> depths: array<vec2f>;

@compute @workgroup_size(64)
fn trace(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= request.count) {
        return;
    }
    let x = places[request.first + id.x].xyz;
    var towards = -request.place;
    var limit = FAR;
    if (request.far == 0u) {
        let d = request.place - x;
        limit = length(d);
        towards = select(vec3f(0.0, 1.0, 0.0), d, limit > 0.0);
    }
    let found = length_inside(ray_from(x, towards / length(towards)), limit);
    depths[id.x] = select(vec2f(found.x * request.density, found.y), vec2f(-1.0), cut_short());
}
