// Slopes pass: how each sample's source varies around it, from its neighbours' values. Twin of formats/src/slopes.rs,
// which states the formulas.

@group(1) @binding(0) var<storage, read> samples: array<vec4f>;   // position, sharpness
@group(1) @binding(1) var<storage, read> centroids: array<vec4f>; // where values hold, density there
@group(1) @binding(2) var<storage, read> spokes: array<vec4f>;    // NEIGHBOURS a sample: gradient, index (bits)
@group(1) @binding(3) var<storage, read> values: array<vec4f>;    // of all samples: v at the centroid, weight
// SOURCE a sample: v at the kernel's centre and weight, then the slope of each channel.
@group(1) @binding(4) var<storage, read_write> sources: array<vec4f>;

const NEIGHBOURS: u32 = 14u;
const SOURCE: u32 = 4u;
const LIMIT: f32 = 6.0;
const MOST_RATIO: f32 = 6.0;
const MOST_EXPONENT: f32 = 4.0;

@compute @workgroup_size(64)
fn find_slopes(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    view = views[id.z];
    let sample = id.y * groups.x * 64u + id.x;
    if (sample >= medium.samples) {
        return;
    }
    let object = view.slot * medium.total;
    let own = values[object + medium.first + sample];
    let place = SOURCE * (view.slot * medium.samples + sample);
    let centroid = centroids[sample];
    let kernel = samples[sample];
    let to_centre = kernel.xyz - centroid.xyz;
    let variance = medium.cell_variance / (kernel.w * kernel.w);
    let means = view.means * medium.means;
    let limit = min(LIMIT * min(medium.most_extinction * centroid.w, 1e30), medium.steepest * kernel.w);
    var value = own.xyz;
    for (var c = 0u; c < 3u; c++) {
        var slope = vec3f(0.0);
        if (own[c] > 0.0) {
            for (var k = 0u; k < NEIGHBOURS; k++) {
                let spoke = spokes[sample * NEIGHBOURS + k];
                let ratio = values[object + bitcast<u32>(spoke.w)][c] / own[c];
                var logarithm = -MOST_RATIO;
                if (ratio > 0.0) {
                    logarithm = clamp(log(ratio), -MOST_RATIO, MOST_RATIO);
                }
                slope += spoke.xyz * logarithm;
            }
            let size = length(slope);
            if (size > limit) {
                slope *= limit / size;
            }
            let along = dot(slope, to_centre);
            let spread = max(variance * dot(slope, slope) - along * along, 0.0);
            value[c] *= exp(clamp(along - 0.5 * means[c] * spread, -MOST_EXPONENT, MOST_EXPONENT));
        }
        sources[place + 1u + c] = vec4f(slope, 0.0);
    }
    sources[place] = vec4f(value, own.w);
}
