// Rays through the boundary's box hierarchy, for the rivals alone: every crossing counts, so that there is nothing to order
// and no stack. Nodes lie depth first; `skip` is where a ray goes on that misses a box or is done with a leaf.
struct Node {
    low: vec3f,
    skip: u32,
    high: vec3f,
    leaf: u32,      // 16 times the first triangle plus their number; 0: not a leaf
}

// Mirrors `Settings` in gpu/rivals/uniforms.rs.
struct Settings {
    grid_low: vec3f,    // the grid's first node
    nodes: u32,         // of the hierarchy
    grid_step: vec3f,   // between its nodes
    steps: u32,         // of a camera ray
    grid_size: vec3u,   // its nodes along x, y, z
    first: u32,         // row of the picture, or listed node of the grid, at which this dispatch begins
    end: u32,           // the one after its last
    stride: f32,        // between two lookups of the density, mesh units; only with a density grid
    first_step: u32,    // of those that this dispatch takes, and the one after their last
    end_step: u32,
    first_light: u32,   // the same of the lights
    end_light: u32,
}

@group(1) @binding(0) var<storage, read> hierarchy: array<Node>;
// Three a triangle: position; bit k of the first one's w says that edge k runs from the lower to the higher vertex.
@group(1) @binding(1) var<storage, read> corners: array<vec4f>;
@group(1) @binding(2) var<storage, read> lights: array<Light>;
@group(1) @binding(3) var<storage, read> grid: array<u32>; // one slab; see shared/density.wgsl

fn voxel_bits(place: u32, slab: u32) -> u32 {
    return grid[place];
}

@group(1) @binding(4) var<uniform> settings: Settings;

override HETEROGENEOUS: bool = false;
// Whether the driver ends all loops of a thread after 65,535 rounds, as Mesa's software adapter does.
override WATCHED: bool = false;

var<private> rounds: u32;

fn count_round() {
    if (WATCHED) {
        rounds++;
    }
}

// Whether loops may have ended early. Nested ones take a few rounds more than are counted.
fn cut_short() -> bool {
    return WATCHED && rounds > 40000u;
}

const FAR: f32 = 1e30;
// Nearest crossings of a ray that are kept; further ones are left out.
const CROSSINGS: u32 = 16u;

// A ray with a frame of its own, in which it runs along z.
struct Ray {
    origin: vec3f,
    direction: vec3f,
    inverse: vec3f,
    u: vec3f,
    v: vec3f,
}

// Duff and others 2017, Building an orthonormal basis, revisited: u, v, w are right-handed.
fn ray_from(origin: vec3f, w: vec3f) -> Ray {
    let side = select(-1.0, 1.0, w.z >= 0.0);
    let a = -1.0 / (side + w.z);
    let b = w.x * w.y * a;
    let u = vec3f(1.0 + side * w.x * w.x * a, side * b, -side * w.x);
    let v = vec3f(b, side + w.y * w.y * a, -w.y);
    let parallel = abs(w) < vec3f(1e-20);
    return Ray(origin, w, 1.0 / select(w, vec3f(1e-20), parallel), u, v);
}

fn meets(low: vec3f, high: vec3f, ray: Ray) -> bool {
    let a = (low - ray.origin) * ray.inverse;
    let b = (high - ray.origin) * ray.inverse;
    let near = min(a, b);
    let far = max(a, b);
    let leave = min(far.x, min(far.y, far.z));
    return max(max(near.x, near.y), max(near.z, 0.0)) <= leave * 1.000001;
}

// Twice the signed area of an edge's triangle with the ray, and whether the ray is to its left. Both triangles at an edge
// evaluate the same expression, so that a ray through it crosses exactly one of them.
fn edge(p: vec3f, q: vec3f, forward: bool) -> vec2f {
    let s = select(q, p, forward);
    let r = select(p, q, forward);
    let value = s.x * r.y - s.y * r.x;
    return vec2f(select(-value, value, forward), select(0.0, 1.0, (value >= 0.0) == forward));
}

fn in_frame(p: vec3f, ray: Ray) -> vec3f {
    let d = p - ray.origin;
    return vec3f(dot(d, ray.u), dot(d, ray.v), dot(d, ray.direction));
}

// Distance and sign (+1 leaves the object, -1 enters) of a ray's crossing with a triangle; sign 0 without one.
fn crossing(triangle: u32, ray: Ray) -> vec2f {
    let first = corners[3u * triangle];
    let forward = bitcast<u32>(first.w);
    let a = in_frame(first.xyz, ray);
    let b = in_frame(corners[3u * triangle + 1u].xyz, ray);
    let c = in_frame(corners[3u * triangle + 2u].xyz, ray);
    let ab = edge(a, b, (forward & 1u) != 0u);
    let bc = edge(b, c, (forward & 2u) != 0u);
    let ca = edge(c, a, (forward & 4u) != 0u);
    let lefts = ab.y + bc.y + ca.y;
    let sum = ab.x + bc.x + ca.x;
    if ((lefts > 0.0 && lefts < 3.0) || sum == 0.0) {
        return vec2f(0.0);
    }
    return vec2f((bc.x * a.z + ca.x * b.z + ab.x * c.z) / sum, select(-1.0, 1.0, lefts > 0.0));
}

// Length of the ray inside the object up to `limit`: the signed sum of its crossings. Shells do not overlap.
fn length_inside(ray: Ray, limit: f32) -> f32 {
    var sum = 0.0;
    var at = 0u;
    while (at < settings.nodes) {
        count_round();
        let node = hierarchy[at];
        let hit = meets(node.low, node.high, ray);
        if (hit) {
            for (var k = 0u; k < (node.leaf & 15u); k++) {
                count_round();
                let c = crossing((node.leaf >> 4u) + k, ray);
                if (c.x > 0.0) {
                    sum += c.y * min(c.x, limit);
                }
            }
        }
        at = select(node.skip, at + 1u, hit && node.leaf == 0u);
    }
    return max(sum, 0.0);
}

// Inside pieces of a ray, in order.
const PIECES: u32 = CROSSINGS / 2u;
var<private> pieces: array<vec2f, PIECES>;
var<private> sorted: array<vec2f, CROSSINGS>;

// Finds the inside pieces of a ray up to `limit` and returns their number: where the winding number is positive.
fn cut(ray: Ray, limit: f32) -> u32 {
    var found = 0u;
    var winding = 0.0;
    var at = 0u;
    while (at < settings.nodes) {
        count_round();
        let node = hierarchy[at];
        let hit = meets(node.low, node.high, ray);
        if (hit) {
            for (var k = 0u; k < (node.leaf & 15u); k++) {
                count_round();
                let c = crossing((node.leaf >> 4u) + k, ray);
                if (c.y == 0.0 || c.x <= 0.0) {
                    continue;
                }
                winding += c.y;
                // Exits before entries at the same distance.
                var place = min(found, CROSSINGS - 1u);
                if (found == CROSSINGS && c.x >= sorted[place].x) {
                    continue;
                }
                while (place > 0u && (sorted[place - 1u].x > c.x || (sorted[place - 1u].x == c.x && sorted[place - 1u].y < c.y))) {
                    sorted[place] = sorted[place - 1u];
                    place--;
                }
                sorted[place] = c;
                found = min(found + 1u, CROSSINGS);
            }
        }
        at = select(node.skip, at + 1u, hit && node.leaf == 0u);
    }
    var count = 0u;
    var start = select(FAR, 0.0, winding > 0.0);
    for (var k = 0u; k < found && count < PIECES; k++) {
        let before = winding;
        winding -= sorted[k].y;
        if (before <= 0.0 && winding > 0.0) {
            start = sorted[k].x;
        } else if (before > 0.0 && winding <= 0.0 && min(sorted[k].x, limit) > start) {
            pieces[count] = vec2f(start, min(sorted[k].x, limit));
            count++;
        }
    }
    return count;
}

// Lookups of the density along a stretch.
fn lookups(length: f32) -> u32 {
    return u32(clamp(ceil(length / settings.stride), 1.0, 4096.0));
}

// Integral of the density (of 1 where it is uniform) over the ray's inside pieces up to `limit`.
fn density_length(origin: vec3f, direction: vec3f, limit: f32) -> f32 {
    let ray = ray_from(origin, direction);
    if (!HETEROGENEOUS) {
        return length_inside(ray, limit);
    }
    let count = cut(ray, limit);
    var sum = 0.0;
    for (var k = 0u; k < count; k++) {
        let n = lookups(pieces[k].y - pieces[k].x);
        let h = (pieces[k].y - pieces[k].x) / f32(n);
        for (var i = 0u; i < n; i++) {
            count_round();
            sum += h * density(origin + direction * (pieces[k].x + (f32(i) + 0.5) * h)).x;
        }
    }
    return sum;
}

// Light that arrives at a point from this dispatch's lights and is scattered towards the camera, without the albedo. `direction` is that
// of the camera's ray.
fn scattered(place: vec3f, direction: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var l = settings.first_light; l < settings.end_light; l++) {
        let light = lights[l];
        let arriving = incident(light, place);
        if (all(arriving.irradiance == vec3f(0.0))) {
            continue;
        }
        let limit = select(distance(light.position, place), FAR, light.kind == 1u);
        let m = density_length(place, arriving.towards, limit);
        let g = clamp(medium.mean_cosine, -light.most_cosine, light.most_cosine);
        let phase = henyey_greenstein(g, -arriving.towards, -direction);
        sum += arriving.irradiance * phase * exp(-medium.kappa * m);
    }
    return sum;
}
