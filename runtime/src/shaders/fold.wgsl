// Fold pass, only where lights are folded: adds what all of them together send towards the camera to each sample's value.
// Twin of `cpu::lighting::from_folded`; crate::fold states the formulas.

@group(1) @binding(0) var<storage, read> centroids: array<vec4f>;
@group(1) @binding(1) var<storage, read> linear: array<u32>;      // of all samples: [sample][channel][coefficient], two f16 a word
// Of each object: coefficients, vectors, channels (bits; 0 where none is folded); then F and, where the phase function minds the camera, its three changes.
@group(1) @binding(2) var<storage, read> ambient: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> values: array<vec4f>;

fn vector(v: u32, k: u32, count: u32) -> vec3f {
    return ambient[view.first_ambient + 1u + v * count + k].xyz;
}

@compute @workgroup_size(64)
fn fold_lights(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    view = views[id.z];
    let sample = id.y * groups.x * 64u + id.x;
    if (sample >= medium.samples) {
        return;
    }
    let place = view.slot * medium.total + medium.first + sample;
    let before = values[place];
    let header = bitcast<vec4u>(ambient[view.first_ambient]);
    let count = header.x;
    if (before.w <= 0.0 || count == 0u) {
        return;
    }
    let turned = header.y > 1u;
    var deviation = vec3f(0.0);
    if (turned) {
        let away = view.origin - centroids[sample].xyz;
        deviation = away / max(length(away), 1e-30) - view.origin / max(length(view.origin), 1e-30);
    }
    let words = count / 2u;
    let start = (medium.first + sample) * header.z * words;
    var sum = vec3f(0.0);
    for (var word = 0u; word < words; word++) {
        let red = unpack2x16float(linear[start + word]);
        var green = red;
        var blue = red;
        if (header.z > 1u) {
            green = unpack2x16float(linear[start + words + word]);
            blue = unpack2x16float(linear[start + 2u * words + word]);
        }
        for (var half = 0u; half < 2u; half++) {
            let k = 2u * word + half;
            var light = vector(0u, k, count);
            if (turned) {
                light += vector(1u, k, count) * deviation.x + vector(2u, k, count) * deviation.y
                    + vector(3u, k, count) * deviation.z;
            }
            sum += light * vec3f(red[half], green[half], blue[half]);
        }
    }
    // Corrections of folded lights may be negative.
    values[place] = vec4f(max(before.xyz + medium.albedo * max(sum, vec3f(0.0)), vec3f(0.0)), before.w);
}
