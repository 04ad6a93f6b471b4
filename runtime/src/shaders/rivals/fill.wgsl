// Fills the grid: light that is scattered towards the camera at each node that a march may look up, by shadow rays to every
// light. One thread a node.
@group(1) @binding(5) var<storage, read> listed: array<u32>;            // the nodes that are needed
@group(1) @binding(6) var<storage, read_write> values: array<vec4f>;

const ROW: u32 = 65536u;    // threads of a row of workgroups

@compute @workgroup_size(64)
fn fill(@builtin(global_invocation_id) id: vec3u) {
    view = views[0];
    let number = settings.first + id.y * ROW + id.x;
    if (number >= settings.end) {
        return;
    }
    let node = listed[number];
    let size = settings.grid_size;
    let at = vec3u(node % size.x, node / size.x % size.y, node / (size.x * size.y));
    let place = settings.grid_low + settings.grid_step * vec3f(at);
    let away = place - view.origin;
    let light = scattered(place, away / max(length(away), 1e-30));
    var earlier = vec4f(0.0);
    if (settings.first_light > 0u) {
        earlier = values[node];
    }
    values[node] = earlier + vec4f(light, select(0.0, 1.0, cut_short()));
}
