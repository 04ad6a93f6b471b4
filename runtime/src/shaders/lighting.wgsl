// Lighting pass: light scattered towards the camera by each sample of each object, one thread each.
//
//   v = albedo * sum over lights of p(cos) E psi boundary,   psi = exp(-ratio * decode(SH)) or exp(-extinction * m)
//
// A correction of psi boundary is on its way to exact depths or back. Baked lights that bring next to nothing beside those
// before them are skipped: fold/reach.rs states the bound.

@group(1) @binding(0) var<storage, read> centroids: array<vec4f>;   // where values hold, density there
@group(1) @binding(1) var<storage, read> weights: array<f32>;
@group(1) @binding(2) var<storage, read> depth: array<u32>;         // codes of the depth's harmonics
@group(1) @binding(3) var<storage, read> boundary: array<u32>;      // the same of the boundary; only where ior is not 1
@group(1) @binding(4) var<storage, read> lights: array<Light>;
@group(1) @binding(5) var<storage, read> exact: array<vec2u>;       // [table][sample]: density length and boundary, or a correction (f16 x 4)
@group(1) @binding(6) var<storage, read_write> values: array<vec4f>; // v, weight; between portions: sum, lights so far
@group(1) @binding(7) var<uniform> recurrence: array<vec4f, 196>;
@group(1) @binding(8) var<uniform> bands: array<Band, 14>;
// First byte of the depth's codes; its order and scale (f16); the boundary's scale and the lobe (f16 x 4).
@group(1) @binding(9) var<storage, read> packed: array<vec4u>;

override FRESNEL: bool = false;
override BOUNDARY_ORDER: u32 = 0u;
override BOUNDARY_BYTES: u32 = 0u; // of each sample's codes
override PORTION: u32 = 256u; // most lights of a dispatch

// How the codes of one band of the harmonics are read; formats/src/harmonics.rs states the layout.
struct Band {
    before: u32,   // bits in front of it
    bits: u32,     // of one code
    depth: f32,    // profile of the depth's harmonics
    boundary: f32, // of the boundary's
}

// Most coefficients of a sample.
const MOST: u32 = 196u;
const SH_MAX_ORDER: u32 = 14u;

// Coefficients of the sample at hand; those of bands that it lacks are neither written nor read.
var<private> of_depth: array<f32, MOST>;
var<private> of_boundary: array<f32, MOST>;

// A coefficient from a code of `bits` bits, two's complement: twin of `harmonics::expanded`.
fn expanded(word: u32, bits: u32, unit: f32) -> f32 {
    let q = f32(bitcast<i32>(word << (32u - bits)) >> (32u - bits));
    let u = abs(q) / f32((1u << (bits - 1u)) - 1u);
    return sign(q) * unit * u * sqrt(u);
}

// Word of a code, and the code's first bit there: code `k` of a band, of codes that start at byte `start`.
fn code_place(start: u32, band: Band, k: u32) -> vec2u {
    let at = 8u * (start & 3u) + band.before + k * band.bits;
    return vec2u((start >> 2u) + (at >> 5u), at & 31u);
}

// A word that begins with bit `shift` of `low`.
fn field(low: u32, high: u32, shift: u32) -> u32 {
    return select(low >> shift, (low >> shift) | (high << (32u - shift)), shift > 0u);
}

// A function cannot be handed a storage buffer: one loop for each.
fn decode_depth(start: u32, order: u32, scale: f32) {
    for (var l = 0u; l < order; l++) {
        let band = bands[l];
        for (var k = 0u; k < 2u * l + 1u; k++) {
            let at = code_place(start, band, k);
            let word = field(depth[at.x], depth[at.x + 1u], at.y);
            of_depth[l * l + k] = expanded(word, band.bits, scale * band.depth);
        }
    }
}

fn decode_boundary(start: u32, scale: f32) {
    for (var l = 0u; l < BOUNDARY_ORDER; l++) {
        let band = bands[l];
        for (var k = 0u; k < 2u * l + 1u; k++) {
            let at = code_place(start, band, k);
            let word = field(boundary[at.x], boundary[at.x + 1u], at.y);
            of_boundary[l * l + k] = expanded(word, band.bits, scale * band.boundary);
        }
    }
}

// Unit vectors towards lights that are looked up together: coefficients are fetched once for all of them.
struct Towards {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// Stored functions in these directions.
struct Stored {
    depth: vec4f,
    boundary: vec4f,
}

// By recurrence over the bands of every order m, as in formats/src/sh.rs. `recurrence` holds for each l * SH_MAX_ORDER + m the
// constants (a, b), or the diagonal where l = m.
fn stored(order: vec2u, d: Towards) -> Stored {
    var sum = Stored(vec4f(0.0), vec4f(0.0));
    var cos_m = vec4f(1.0);
    var sin_m = vec4f(0.0);
    let most = max(order.x, order.y);
    for (var m = 0u; m < most; m++) {
        var before = vec4f(0.0);
        var current = vec4f(recurrence[m * SH_MAX_ORDER + m].x);
        // Factors of cos and sin; where m is 0 both are the same and the sine is 0.
        var even = vec4f(0.0);
        var odd = vec4f(0.0);
        var boundary_even = vec4f(0.0);
        var boundary_odd = vec4f(0.0);
        for (var l = m; l < most; l++) {
            if (l > m) {
                let c = recurrence[l * SH_MAX_ORDER + m].xy;
                let next = c.x * (d.z * current - c.y * before);
                before = current;
                current = next;
            }
            let centre = l * (l + 1u);
            if (!FRESNEL || l < order.x) {
                even += of_depth[centre + m] * current;
                odd += of_depth[centre - m] * current;
            }
            if (FRESNEL && l < order.y) {
                boundary_even += of_boundary[centre + m] * current;
                boundary_odd += of_boundary[centre - m] * current;
            }
        }
        let scale = select(1.4142135, 1.0, m == 0u);
        sum.depth += scale * (even * cos_m + odd * sin_m);
        if (FRESNEL) {
            sum.boundary += scale * (boundary_even * cos_m + boundary_odd * sin_m);
        }
        let next = d.x * cos_m - d.y * sin_m;
        sin_m = d.x * sin_m + d.y * cos_m;
        cos_m = next;
    }
    return sum;
}

// Transmittance from the stored function of optical depth; twin of `Encoding::decode`.
fn transmittance(value: f32) -> vec3f {
    if (all(medium.ratio == vec3f(0.0))) {
        return vec3f(1.0);
    }
    if (medium.encoding == 2u) {
        return exp(-medium.ratio * max(value, 0.0));
    }
    if (value <= 0.0) {
        return vec3f(0.0);
    }
    if (medium.encoding == 0u) {
        return exp(-medium.ratio * max(-log(value), 0.0));
    }
    return exp(-medium.ratio * max(1.0 / value - medium.epsilon, 0.0));
}

fn largest(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

@compute @workgroup_size(64)
fn light_samples(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    view = views[id.z];
    let sample = id.y * groups.x * 64u + id.x;
    if (sample >= medium.samples) {
        return;
    }
    let place = view.slot * medium.total + medium.first + sample;
    let weight = weights[sample];
    if (weight <= 0.0) {
        values[place] = vec4f(0.0);
        return;
    }
    let x = centroids[sample].xyz;
    let away = view.origin - x;
    let distance = length(away);
    var towards_camera = vec3f(0.0);
    if (distance > 0.0) {
        towards_camera = away / distance;
    }
    let record = packed[sample];
    let order = vec2u(record.y & 0xffffu, BOUNDARY_ORDER);
    decode_depth(record.x, order.x, unpack2x16float(record.y).y);
    let halves = unpack2x16float(record.z);
    if (FRESNEL) {
        decode_boundary(sample * BOUNDARY_BYTES, halves.x);
    }
    let lobe = vec3f(halves.y, unpack2x16float(record.w));
    var first = 0u;
    var sum = vec3f(0.0);
    if (view.light_count > PORTION) {
        let earlier = values[place];
        first = u32(earlier.w);
        sum = earlier.xyz;
    }
    let end = min(first + PORTION, view.light_count);
    // The most that the skipped lights of this portion can bring.
    var left_out = 0.0;
    // Lights whose depths are looked up, until there are enough of them.
    var waiting = 0u;
    var towards = Towards(vec4f(0.0), vec4f(0.0), vec4f(0.0));
    var brought: array<vec3f, 4>;
    var corrections: array<vec3f, 4>;
    for (var l = first; l < end; l++) {
        let light = lights[view.first_light + l];
        let arriving = incident(light, x);
        let g = clamp(medium.mean_cosine, -light.most_cosine, light.most_cosine);
        let phase = henyey_greenstein(g, -arriving.towards, towards_camera);
        let scattered = arriving.irradiance * phase;
        var skipped = all(arriving.irradiance == vec3f(0.0));
        if (!skipped && view.negligible > 0.0 && l >= view.environment && light.table == NO_TABLE) {
            let with_this = left_out + largest(arriving.irradiance) * phase;
            if (with_this <= view.negligible * largest(sum)) {
                left_out = with_this;
                skipped = true;
            }
        }
        if (!skipped) {
            var correction = vec3f(0.0);
            var is_exact = false;
            if (light.table != NO_TABLE) {
                let known = exact[light.table * medium.total + medium.first + sample];
                is_exact = light.share >= 1.0;
                if (is_exact) {
                    let depth = bitcast<vec2f>(known);
                    sum += scattered * exp(-medium.extinction * depth.x) * depth.y;
                } else {
                    correction = light.share * vec3f(unpack2x16float(known.x), unpack2x16float(known.y).x);
                }
            }
            if (!is_exact && light.baked != 0u) {
                towards.x[waiting] = arriving.towards.x;
                towards.y[waiting] = arriving.towards.y;
                towards.z[waiting] = arriving.towards.z;
                brought[waiting] = scattered;
                corrections[waiting] = correction;
                waiting++;
            } else if (!is_exact) {
                sum += scattered * correction;
            }
        }
        if (waiting == 4u || (waiting > 0u && l + 1u == end)) {
            let value = stored(order, towards);
            let by_lobe = max(lobe.x * towards.x + lobe.y * towards.y + lobe.z * towards.z, vec4f(0.0));
            for (var k = 0u; k < waiting; k++) {
                var psi = transmittance(value.depth[k] + by_lobe[k]);
                if (FRESNEL) {
                    psi *= clamp(value.boundary[k], 0.0, 1.0);
                }
                sum += brought[k] * clamp(psi + corrections[k], vec3f(0.0), vec3f(1.0));
            }
            waiting = 0u;
        }
    }
    if (end < view.light_count) {
        values[place] = vec4f(sum, f32(end));
        return;
    }
    values[place] = vec4f(min(medium.albedo * sum, vec3f(most_source())), weight);
}
