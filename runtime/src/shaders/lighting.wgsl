// Lighting pass: light scattered towards the camera by each sample, one thread a sample.
//
//   v = albedo * sum over lights of p(cos) E psi boundary,   psi = exp(-ratio * decode(SH)) or exp(-extinction * m)

@group(1) @binding(0) var<storage, read> centroids: array<vec4f>;   // where values hold, largest slope
@group(1) @binding(1) var<storage, read> weights: array<f32>;
@group(1) @binding(2) var<storage, read> depth: array<f32>;         // order * order coefficients a sample
@group(1) @binding(3) var<storage, read> boundary: array<f32>;      // as depth; only where ior is not 1
@group(1) @binding(4) var<storage, read> lights: array<Light>;
@group(1) @binding(5) var<storage, read> exact: array<vec2f>;       // [table][sample]: density length, boundary
@group(1) @binding(6) var<storage, read_write> values: array<vec4f>; // v, weight
@group(1) @binding(7) var<uniform> recurrence: array<vec4f, 100>;

override FRESNEL: bool = false;

// Stored functions of optical depth and of the boundary in one direction.
fn stored(sample: u32, d: vec3f) -> vec2f {
    let base = sample * medium.order * medium.order;
    var sum = vec2f(0.0);
    var cos_m = 1.0;
    var sin_m = 0.0;
    for (var m = 0u; m < medium.order; m++) {
        let scale = select(1.4142135, 1.0, m == 0u);
        var walk = sh_start(m, cos_m, sin_m);
        for (var l = m; l < medium.order; l++) {
            if (l > m) {
                walk = sh_next(walk, l, m, d.z);
            }
            let centre = base + l * (l + 1u);
            let even = scale * walk.current * cos_m;
            sum.x += depth[centre + m] * even;
            if (FRESNEL) {
                sum.y += boundary[centre + m] * even;
            }
            if (m > 0u) {
                let odd = scale * walk.current * sin_m;
                sum.x += depth[centre - m] * odd;
                if (FRESNEL) {
                    sum.y += boundary[centre - m] * odd;
                }
            }
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
    if (value <= 0.0) {
        return vec3f(0.0);
    }
    if (medium.encoding == 0u) {
        return exp(-medium.ratio * max(-log(value), 0.0));
    }
    return exp(-medium.ratio * max(1.0 / value - medium.epsilon, 0.0));
}

@compute @workgroup_size(64)
fn light_samples(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let sample = id.y * groups.x * 64u + id.x;
    if (sample >= medium.samples) {
        return;
    }
    let weight = weights[sample];
    if (weight <= 0.0) {
        values[sample] = vec4f(0.0);
        return;
    }
    let x = centroids[sample].xyz;
    let away = view.origin - x;
    let distance = length(away);
    var towards_camera = vec3f(0.0);
    if (distance > 0.0) {
        towards_camera = away / distance;
    }
    var sum = vec3f(0.0);
    for (var l = 0u; l < view.light_count; l++) {
        let light = lights[l];
        let arriving = incident(light, x);
        if (all(arriving.irradiance == vec3f(0.0))) {
            continue;
        }
        var psi: vec3f;
        if (light.table != NO_TABLE) {
            let known = exact[light.table * medium.samples + sample];
            psi = exp(-medium.extinction * known.x) * known.y;
        } else {
            let value = stored(sample, arriving.towards);
            psi = transmittance(value.x);
            if (FRESNEL) {
                psi *= clamp(value.y, 0.0, 1.0);
            }
        }
        let phase = henyey_greenstein(medium.mean_cosine, -dot(arriving.towards, towards_camera));
        sum += arriving.irradiance * psi * phase;
    }
    values[sample] = vec4f(medium.albedo * sum, weight);
}
