// Segments pass: from each pixel's sorted crossings to at most four inside pieces, where the winding number is
// positive. Twin of `visibility::inside_pieces`. Also starts the ray's counters and switches on the passes of the
// pieces that occur.
override FRESNEL: bool = false;

const SLOTS: u32 = 8u;
const STATE: u32 = 10u;
const BOUNDARY: u32 = 12u;
const MAX_PIECES: u32 = 4u;
const CELL: u32 = 8u;
const ARGUMENTS: u32 = 8u;  // of a piece: dispatch over cells of 8 x 8 pixels (3), over listed tiles (3), bits of views behind each
const OVER_TILES: u32 = 4u; // where the second begins
const LISTS: u32 = 64u;     // where the lists of tiles of each piece begin; then come a mark for every tile and piece

@group(1) @binding(0) var<storage, read> crossings: array<u32>;
@group(1) @binding(1) var<storage, read> boundary: array<f32>;
// Piece k of pixel i at [k * stride + i]: start, end, transmittance of its entry and of its exit.
@group(1) @binding(2) var<storage, read_write> pieces: array<vec4f>;
// What lies in front of the next piece: transmittance per channel, and whether the ray met a kernel.
@group(1) @binding(3) var<storage, read_write> front: array<vec4f>;
@group(1) @binding(4) var<storage, read_write> radiance: array<vec4f>;
// Rays that hit, pieces dropped, kernels, rays without a kernel.
@group(1) @binding(5) var<storage, read_write> counters: array<vec4u>;
@group(1) @binding(6) var<storage, read_write> arguments: array<atomic<u32>>;
// Least start, greatest end and greatest start of each piece over the 8 x 8 pixels of a workgroup: piece k of cell c at
// [k * stride + c].
@group(1) @binding(7) var<storage, read_write> cells: array<vec4f>;

var<workgroup> cell_start: array<atomic<u32>, 4>;
var<workgroup> cell_end: array<atomic<u32>, 4>;
var<workgroup> cell_latest: array<atomic<u32>, 4>;

fn through(index: u32, slot: u32) -> f32 {
    if (FRESNEL) {
        return 1.0 - boundary[index * BOUNDARY + slot];
    }
    return 1.0;
}

@compute @workgroup_size(8, 8)
fn segments(
    @builtin(global_invocation_id) pixel: vec3u,
    @builtin(workgroup_id) cell: vec3u,
    @builtin(num_workgroups) cell_count: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    if (local < MAX_PIECES) {
        atomicStore(&cell_start[local], 0xffffffffu);
        atomicStore(&cell_end[local], 0u);
        atomicStore(&cell_latest[local], 0u);
    }
    workgroupBarrier();
    view = views[pixel.z];
    if (all(pixel.xy < view.tile_size)) {
        cut(pixel_index(pixel.xy), cell_count);
    }
    workgroupBarrier();
    let columns = (view.tile_size.x + CELL - 1u) / CELL;
    // Cells beside the tile are those of larger tiles that are drawn together with it.
    if (local < MAX_PIECES && all(cell.xy * CELL < view.tile_size)) {
        let stride = arrayLength(&cells) / MAX_PIECES;
        let start = atomicLoad(&cell_start[local]);
        var range = vec4f(1e30, -1.0, 0.0, 0.0);
        if (start != 0xffffffffu) {
            range = vec4f(bitcast<f32>(start), bitcast<f32>(atomicLoad(&cell_end[local])),
                bitcast<f32>(atomicLoad(&cell_latest[local])), 0.0);
        }
        cells[local * stride + view.first_cell + cell.y * columns + cell.x] = range;
        if (range.x <= range.y) {
            list_tile(local, vec3u(cell.xy / 2u, cell.z), (columns + 1u) / 2u);
        }
    }
}

// Lists a tile of 16 x 16 pixels of a view that have piece k, once.
fn list_tile(k: u32, tile: vec3u, columns: u32) {
    let stride = (arrayLength(&arguments) - LISTS) / (2u * MAX_PIECES);
    let mark = LISTS + (MAX_PIECES + k) * stride + view.first_tile + tile.y * columns + tile.x;
    if (atomicExchange(&arguments[mark], 1u) == 0u) {
        let place = atomicAdd(&arguments[k * ARGUMENTS + OVER_TILES], 1u);
        atomicStore(&arguments[LISTS + k * stride + place], tile.x | (tile.y << 13u) | (tile.z << 26u));
        atomicMax(&arguments[k * ARGUMENTS + OVER_TILES + 1u], view.sharers);
        atomicMax(&arguments[k * ARGUMENTS + OVER_TILES + 2u], 1u);
        // The words behind the dispatches say which of the views have the piece.
        atomicOr(&arguments[k * ARGUMENTS + select(3u, 7u, tile.z >= 32u)], 1u << (tile.z & 31u));
    }
}

// The pieces of one pixel, and what is dispatched for them: as many groups as here.
fn cut(index: u32, groups: vec3u) {
    let stride = arrayLength(&pieces) / MAX_PIECES;
    let state = index * STATE;
    var winding = bitcast<i32>(crossings[state + SLOTS]);
    let total = crossings[state + SLOTS + 1u];
    var count = 0u;
    var dropped = 0u;
    var open = winding > 0;
    var start = 0.0;
    var entry = 1.0;
    for (var slot = 0u; slot < min(total, SLOTS); slot++) {
        let bits = ~crossings[state + slot];
        let t = bitcast<f32>(bits & 0xfffffffeu);
        winding += select(-1, 1, (bits & 1u) == 1u);
        if (!open && winding > 0) {
            open = true;
            start = t;
            entry = through(index, slot);
        } else if (open && winding <= 0) {
            open = false;
            if (t > start) {
                if (count < MAX_PIECES) {
                    pieces[count * stride + index] = vec4f(start, t, entry, through(index, slot));
                    atomicMin(&cell_start[count], bitcast<u32>(start));
                    atomicMax(&cell_end[count], bitcast<u32>(t));
                    atomicMax(&cell_latest[count], bitcast<u32>(start));
                    count++;
                } else {
                    dropped++;
                }
            }
        }
    }
    if (total > SLOTS) {
        dropped += (total - SLOTS + 1u) / 2u;
    }
    for (var k = 0u; k < MAX_PIECES; k++) {
        if (k >= count) {
            pieces[k * stride + index] = vec4f(0.0);
        } else if (atomicLoad(&arguments[k * ARGUMENTS]) == 0u) {
            atomicMax(&arguments[k * ARGUMENTS + 1u], groups.y);
            atomicMax(&arguments[k * ARGUMENTS + 2u], groups.z);
            atomicMax(&arguments[k * ARGUMENTS], groups.x);
        }
    }
    front[index] = vec4f(1.0, 1.0, 1.0, 0.0);
    let hit = select(0u, 1u, count > 0u);
    counters[index] += vec4u(hit, dropped, 0u, hit);
    if (FRESNEL && total > 0u) {
        let at = index * BOUNDARY + 8u;
        radiance[index] += vec4f(boundary[at], boundary[at + 1u], boundary[at + 2u], 0.0);
    }
}
