// Rays through the boundary's box hierarchy: every crossing counts, so that there is nothing to order and no stack. Nodes lie depth
// first; `skip` is where a ray goes on that misses a box or is done with a leaf. Mirrors gpu/hierarchy.rs.
struct Node {
    low: vec3f,
    skip: u32,
    high: vec3f,
    leaf: u32,      // 16 times the first triangle plus their number; 0: not a leaf
}

@group(1) @binding(0) var<storage, read> hierarchy: array<Node>;
// Three a triangle: position; bit k of the first one's w says that edge k runs from the lower to the higher vertex.
@group(1) @binding(1) var<storage, read> corners: array<vec4f>;

override FRESNEL: bool = false; // the boundary refracts
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

// Cosine between the ray and a triangle's normal, up to its sign.
fn cosine_at(triangle: u32, ray: Ray) -> f32 {
    let a = corners[3u * triangle].xyz;
    let normal = cross(corners[3u * triangle + 1u].xyz - a, corners[3u * triangle + 2u].xyz - a);
    return dot(normal, ray.direction) / max(length(normal), 1e-37);
}

// Length of the ray inside the object up to `limit`, the signed sum of its crossings, and what its boundary lets through there.
// Shells do not overlap.
fn length_inside(ray: Ray, limit: f32) -> vec2f {
    var sum = 0.0;
    var through = 1.0;
    var at = 0u;
    while (at < arrayLength(&hierarchy)) {
        count_round();
        let node = hierarchy[at];
        let hit = meets(node.low, node.high, ray);
        if (hit) {
            for (var k = 0u; k < (node.leaf & 15u); k++) {
                count_round();
                let c = crossing((node.leaf >> 4u) + k, ray);
                if (c.x > 0.0) {
                    sum += c.y * min(c.x, limit);
                    if (FRESNEL && c.x < limit) {
                        through *= fresnel_transmittance(cosine_at((node.leaf >> 4u) + k, ray), medium.ior);
                    }
                }
            }
        }
        at = select(node.skip, at + 1u, hit && node.leaf == 0u);
    }
    return vec2f(max(sum, 0.0), through);
}
