// The rivals' rays: what they find in the box hierarchy (shared/hierarchy.wgsl, concatenated in front) and in the density grid.
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

@group(1) @binding(2) var<storage, read> lights: array<Light>;
@group(1) @binding(3) var<storage, read> grid: array<u32>; // one slab; see shared/density.wgsl

fn voxel_bits(place: u32, slab: u32) -> u32 {
    return grid[place];
}

@group(1) @binding(4) var<uniform> settings: Settings;

override HETEROGENEOUS: bool = false;
// Nearest crossings of a ray that are kept; further ones are left out.
const CROSSINGS: u32 = 16u;

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
        return length_inside(ray, limit).x;
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
