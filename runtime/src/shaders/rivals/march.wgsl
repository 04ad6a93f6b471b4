// Marching: a few steps along each camera ray that all emit the same towards the eye under even light, the light of each from
// shadow rays or from a grid. One thread a pixel. Twin of the marcher in tests/src/rivals.
//
//   L = albedo * sum over steps of A Σ_l p E_l psi_l,   A = integral of e^-tau kappa sigma/rho over the step
//
// A is in closed form over cells in which the medium is uniform, so that even light is exact with a single step, and no step is
// lost on what the eye does not see.

@group(1) @binding(5) var<storage, read> values: array<vec4f>;           // light scattered at the grid's nodes; 1: cut short
// Sum so far; 1 where the ray meets the object; -1 where loops were cut short.
@group(1) @binding(6) var<storage, read_write> radiance: array<vec4f>;

override GRID: bool = false;

// Where the march is: a cell, and what lies in front of it.
var<private> along: array<vec2f, PIECES>;
var<private> piece: u32;
var<private> cell: u32;
var<private> cells: u32;
var<private> before: f32;       // density length
var<private> emitted: vec3f;    // A
var<private> grey: f32;         // A of the mean extinction
// Of the cell: ray parameters, density length, scattering part of the density, grey emission.
var<private> start: f32;
var<private> span: f32;
var<private> length_here: f32;
var<private> emits: f32;
var<private> grey_here: f32;

fn mean_extinction() -> f32 {
    return (medium.kappa.x + medium.kappa.y + medium.kappa.z) / 3.0;
}

// 1 - e^-x, also of small x.
fn absorbed(x: vec3f) -> vec3f {
    return select(1.0 - exp(-x), x * (1.0 - 0.5 * x * (1.0 - x / 3.0)), x < vec3f(0.01));
}

fn enter(ray: Ray) {
    let ends = along[piece];
    cells = 1u;
    if (HETEROGENEOUS) {
        cells = lookups(ends.y - ends.x);
    }
    span = (ends.y - ends.x) / f32(cells);
    start = ends.x + f32(cell) * span;
    length_here = span;
    emits = 1.0;
    if (HETEROGENEOUS) {
        let value = density(ray.origin + ray.direction * (start + 0.5 * span));
        length_here = value.x * span;
        emits = select(0.0, value.y / value.x, value.x > 0.0);
    }
    let kappa = mean_extinction();
    grey_here = emits * exp(-kappa * before) * absorbed(vec3f(kappa * length_here)).x;
}

fn begin(ray: Ray) {
    piece = 0u;
    cell = 0u;
    before = 0.0;
    emitted = vec3f(0.0);
    grey = 0.0;
    enter(ray);
}

// A from the camera to the first `m` of the cell.
fn emission(m: f32) -> vec3f {
    return emitted + emits * exp(-medium.kappa * before) * absorbed(medium.kappa * m);
}

// Goes on to the next cell; false at the end.
fn go_on(ray: Ray, count: u32) -> bool {
    count_round();
    if (cell + 1u == cells && piece + 1u == count) {
        return false;
    }
    emitted = emission(length_here);
    grey += grey_here;
    before += length_here;
    cell++;
    if (cell == cells) {
        cell = 0u;
        piece++;
    }
    enter(ray);
    return true;
}

// Density length into the cell at which the grey emission reaches `wanted`, after going there.
fn reach(ray: Ray, count: u32, wanted: f32) -> f32 {
    while (grey + grey_here < wanted) {
        if (!go_on(ray, count)) {
            break;
        }
    }
    let kappa = mean_extinction();
    let seen = max(emits * exp(-kappa * before), 1e-37);
    let share = (wanted - grey) / seen;
    let thin = share / max(kappa, 1e-37);
    let dense = -log(max(1.0 - share, 1e-30)) / max(kappa, 1e-37);
    return clamp(select(dense, thin, kappa * length_here < 1e-4), 0.0, length_here);
}

// Trilinear between the grid's nodes.
fn looked_up(place: vec3f) -> vec4f {
    let size = settings.grid_size;
    let unit = clamp((place - settings.grid_low) / settings.grid_step, vec3f(0.0), vec3f(size - 1u));
    let low = min(vec3u(unit), size - 2u);
    let f = unit - vec3f(low);
    var sum = vec4f(0.0);
    for (var corner = 0u; corner < 8u; corner++) {
        let far = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let weight = select(1.0 - f, f, far == vec3u(1u));
        let at = low + far;
        sum += weight.x * weight.y * weight.z * values[(at.z * size.y + at.y) * size.x + at.x];
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn march(@builtin(global_invocation_id) id: vec3u) {
    view = views[0];
    let pixel = vec2u(id.x, settings.first + id.y);
    if (pixel.x >= view.width || pixel.y >= settings.end) {
        return;
    }
    // A far camera would cost the distances their precision: begin next to the object.
    let direction = ray_direction(pixel);
    let box = hierarchy[0];
    let middle = 0.5 * (box.low + box.high);
    let ahead = max(dot(middle - view.origin, direction) - distance(box.low, box.high), 0.0);
    let ray = ray_from(view.origin + direction * ahead, direction);
    let count = cut(ray, FAR);
    if (count == 0u) {
        return;
    }
    along = pieces;
    begin(ray);
    while (go_on(ray, count)) {}
    let total = grey + grey_here;
    var sum = vec3f(0.0);
    var short = false;
    if (total > 0.0) {
        let each = total / f32(settings.steps);
        begin(ray);
        var last = emission(reach(ray, count, each * f32(settings.first_step)));
        for (var step = settings.first_step; step < settings.end_step; step++) {
            let into = reach(ray, count, each * (f32(step) + 0.5));
            let place = ray.origin + direction * (start + span * into / max(length_here, 1e-37));
            let ending = emission(reach(ray, count, each * f32(step + 1u)));
            var light = vec4f(0.0);
            if (GRID) {
                light = looked_up(place);
            } else {
                light = vec4f(scattered(place, direction), 0.0);
            }
            sum += max(ending - last, vec3f(0.0)) * light.xyz;
            short = short || light.w > 0.0;
            last = ending;
        }
    }
    let index = pixel.y * view.width + pixel.x;
    let earlier = radiance[index];
    let hit = select(1.0, -1.0, short || cut_short() || earlier.w < 0.0);
    radiance[index] = vec4f(earlier.xyz + medium.albedo * sum, hit);
}
