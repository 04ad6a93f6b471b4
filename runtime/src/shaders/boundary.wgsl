// Boundary pass, only where the index of refraction is not 1: the same fragments as the surface pass find their own
// crossing among the sorted ones, leave its Fresnel reflectance there, and the first entry its highlight.
// Concatenated after surface.wgsl. The highlight is the twin of `cpu::surface::highlight`.
const BOUNDARY: u32 = 12u; // eight reflectances, highlight (rgb), unused

@group(1) @binding(4) var<storage, read> normals: array<f32>;
@group(1) @binding(5) var<storage, read> lights: array<Light>;
@group(1) @binding(6) var<storage, read_write> boundary: array<f32>;

@fragment
fn reflect_at(in: Corner, @builtin(front_facing) entry: bool) {
    view = views[in.object];
    let pixel = vec2u(in.position.xy);
    if (any(pixel >= view.tile_size)) {
        return;
    }
    let index = pixel_index(pixel);
    let direction = ray_direction(pixel);
    let meeting = meet(in.triangle, entry, direction);
    let own = crossing_key(meeting.t, entry);
    // Two programs may round the same distance differently: take the nearest key of the same kind.
    var best = SLOTS;
    var least = 64u;
    for (var slot = 0u; slot < SLOTS; slot++) {
        let key = atomicLoad(&crossings[index * STATE + slot]);
        let apart = max(key, own) - min(key, own);
        if (key != 0u && (key & 1u) == (own & 1u) && apart < least) {
            best = slot;
            least = apart;
        }
    }
    if (best == SLOTS) {
        return;
    }
    let geometric = meeting.area / max(length(meeting.area), 1e-30);
    boundary[index * BOUNDARY + best] = 1.0 - fresnel_transmittance(dot(direction, geometric), medium.ior);
    let outside = bitcast<i32>(atomicLoad(&crossings[index * STATE + SLOTS])) <= 0;
    if (best == 0u && entry && outside && view.specular > 0.0) {
        let colour = highlight(meeting, geometric, direction);
        boundary[index * BOUNDARY + 8u] = colour.x;
        boundary[index * BOUNDARY + 9u] = colour.y;
        boundary[index * BOUNDARY + 10u] = colour.z;
    }
}

fn corner_normal(corner: u32) -> vec3f {
    return vec3f(normals[3u * corner], normals[3u * corner + 1u], normals[3u * corner + 2u]);
}

fn highlight(meeting: Meeting, geometric: vec3f, direction: vec3f) -> vec3f {
    let towards_camera = -direction;
    let point = view.origin + direction * meeting.t;
    let first = 3u * meeting.triangle;
    let a = corner_position(first);
    let b = corner_position(first + 1u);
    let c = corner_position(first + 2u);
    let inverse = 1.0 / max(dot(meeting.area, meeting.area), 1e-37);
    let u = dot(cross(c - b, point - b), meeting.area) * inverse;
    let v = dot(cross(a - c, point - c), meeting.area) * inverse;
    let smooth_sum = corner_normal(first) * u + corner_normal(first + 1u) * v + corner_normal(first + 2u) * (1.0 - u - v);
    var n = smooth_sum / max(length(smooth_sum), 1e-30);
    if (!(dot(n, towards_camera) > 0.0)) {
        n = geometric;
    }
    var sum = vec3f(0.0);
    for (var l = 0u; l < view.scene_lights; l++) {
        let arriving = incident(lights[view.first_light + view.first_scene_light + l], point);
        let cosine = dot(n, arriving.towards);
        if (cosine <= 0.0 || dot(geometric, arriving.towards) <= 0.0) {
            continue;
        }
        let halfway_sum = towards_camera + arriving.towards;
        let halfway = halfway_sum / max(length(halfway_sum), 1e-30);
        let nh = dot(n, halfway);
        let lh = dot(arriving.towards, halfway);
        let across = cross(n, halfway);
        let base = dot(across, across) + view.alpha * view.alpha * nh * nh;
        let lobe = view.alpha * view.alpha / (3.14159265 * max(base * base, 1e-20));
        let reflectance = 1.0 - fresnel_transmittance(lh, medium.ior);
        sum += arriving.irradiance * (cosine * reflectance * lobe / (4.0 * max(lh * lh, 0.01)));
    }
    return sum * view.specular;
}
