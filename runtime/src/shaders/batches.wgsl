// Batches pass: for each piece the batches of samples that may meet it, in order, and how many its draw has. Also counts what
// the view needs.
override DRAWN: bool = true; // kernels are drawn by quads

// An indirect draw for piece k at [k * DRAW]; behind DRAWS words for each piece a bit a batch; then lists of batches.
@group(1) @binding(0) var<storage, read_write> batches: array<atomic<u32>>;
@group(1) @binding(1) var<storage, read> arguments: array<u32>; // see segments.wgsl
@group(1) @binding(2) var<storage, read_write> census: array<atomic<u32>>; // see outlines.wgsl

const MAX_PIECES: u32 = 4u;
const ARGUMENTS: u32 = 8u;
const OVER_TILES: u32 = 4u;
const DRAW: u32 = 8u;
const DRAWS: u32 = 64u;
const BATCH: u32 = 64u;
const INDICES: u32 = 768u;  // of a batch: four triangles a sample
const BATCHES_DRAWN: u32 = 6u;
const BATCHES: u32 = 7u;
const TILES: u32 = 8u;
const PIECES: u32 = 12u;

// Bits in front of bit `batch` of the marks at word `first`.
fn rank(first: u32, batch: u32) -> u32 {
    var before = 0u;
    for (var word = 0u; word < batch / 32u; word++) {
        before += countOneBits(atomicLoad(&batches[first + word]));
    }
    return before + countOneBits(atomicLoad(&batches[first + batch / 32u]) & ((1u << (batch & 31u)) - 1u));
}

@compute @workgroup_size(64)
fn list(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let batch = id.y * groups.x * 64u + id.x;
    let count = (medium.samples + BATCH - 1u) / BATCH;
    // Multiples of 64 words, at least 64.
    let marks = max((count + 2047u) / 2048u, 1u) * 64u;
    let lists = max((count + 63u) / 64u, 1u) * 64u;
    for (var k = 0u; k < MAX_PIECES; k++) {
        let tiles = arguments[k * ARGUMENTS + OVER_TILES];
        if (tiles == 0u) {
            break;
        }
        if (batch == 0u && medium.first == 0u) {
            atomicAdd(&census[TILES + k], tiles);
            let views = vec2u(arguments[k * ARGUMENTS + 3u], arguments[k * ARGUMENTS + 7u]);
            atomicAdd(&census[PIECES + k], countOneBits(views.x) + countOneBits(views.y));
        }
        if (!DRAWN) {
            continue;
        }
        if (batch == 0u) {
            atomicStore(&batches[k * DRAW], INDICES);
            atomicAdd(&census[BATCHES], count);
        }
        let first = DRAWS + k * marks;
        if (batch < count && ((atomicLoad(&batches[first + batch / 32u]) >> (batch & 31u)) & 1u) == 1u) {
            atomicStore(&batches[DRAWS + MAX_PIECES * marks + k * lists + rank(first, batch)], batch);
            atomicAdd(&batches[k * DRAW + 1u], 1u);
            atomicAdd(&census[BATCHES_DRAWN], 1u);
        }
    }
}
