// Compose pass: one object behind those before it. `opaque` is what they hold back, so that 0 is an empty picture.
@group(1) @binding(0) var<storage, read> radiance: array<vec4f>;
@group(1) @binding(1) var<storage, read> front: array<vec4f>;
@group(1) @binding(2) var<storage, read_write> total: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> opaque: array<vec4f>;

@compute @workgroup_size(8, 8)
fn compose(@builtin(global_invocation_id) pixel: vec3u) {
    view = views[0];
    if (any(pixel.xy >= view.tile_size)) {
        return;
    }
    let index = pixel_index(pixel.xy);
    let place = view.tile_start + pixel.xy;
    let at = place.y * view.width + place.x;
    let through = 1.0 - opaque[at].xyz;
    total[at] += vec4f(abs(view.share) * through * radiance[index].xyz, 0.0);
    if (view.share > 0.0) {
        opaque[at] = vec4f(1.0 - through * front[index].xyz, 0.0);
    }
}
