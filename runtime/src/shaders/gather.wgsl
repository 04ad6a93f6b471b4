// Gather pass: the kernels along the inside pieces of every pixel of a tile, summed in registers, and what comes of
// them added to the picture: splat and resolve in one, without blending. (Where the samples are several shards sums are kept
// from one to the next; where tiles are few, several workgroups share a tile, a slice of the samples and a half of the pixels
// each. The resolve pass follows both.)
//
// A workgroup first finds the clusters of 64 samples that rays of its tile may meet, then those of their samples; the
// bits of `marks` keep them in order, so that the sums do not depend on threads. Each thread then has two pixels side by
// side in each half of the tile. Where sums begin and what becomes of them, `begin` and `finish`, follow in gather_join.wgsl or
// gather_keep.wgsl; how those that are listed are added, `add_listed`, and the entry point in gather_lanes.wgsl or
// gather_plain.wgsl.

// Position and sharpness of each sample, then a sphere around the kernels of each cluster of 64.
@group(1) @binding(0) var<storage, read> samples: array<vec4f>;
@group(1) @binding(1) var<storage, read> sources: array<vec4f>;  // SOURCE a sample: v, weight; slopes
@group(1) @binding(2) var<storage, read> tiles: array<u32>;      // column, row (13 bits each) and view of those with pixels inside
@group(1) @binding(3) var<storage, read> pieces: array<vec4f>;   // PIECES of every pixel
@group(1) @binding(4) var<storage, read> profile: array<vec4f>;

// That a workgroup goes through: where the density varies, or samples are several shards, each has a dispatch of its own.
override PIECES: u32 = 4u;
// Of a tile that are a workgroup's: it has the upper and the lower, or one of them.
override HALVES: u32 = 2u;

const SOURCE: u32 = 4u;
const SIDE: u32 = 16u;          // of a tile, pixels
const MOST_HALVES: u32 = 2u;    // upper and lower: threads have two pixels in each
const CLUSTER: u32 = 64u;       // samples of a cluster, and threads of a workgroup
const WORDS: u32 = 32u;
const ROUND: u32 = 1024u;       // bits of all words: clusters looked at together
const GROUP: u32 = 16u;         // clusters whose samples are looked at together
// Below this cosine of the half angle a cone is not used: everything is a candidate.
const LEAST_COSINE: f32 = 0.1;

// Starts and ends of pieces as bits: least start, greatest start, greatest end.
var<workgroup> bounds: array<atomic<u32>, 3>;
var<workgroup> marks: array<atomic<u32>, WORDS>;
var<workgroup> found: array<u32, ROUND>;
var<workgroup> listed: array<u32, 2 * ROUND>;
var<workgroup> count: u32;
var<workgroup> range: vec2f;

// The directions of a tile's rays, and how far away they are inside the object. Twin of `cpu::tiles::Cone`.
struct Cone {
    axis: vec3f,
    cosine: f32,
    sine: f32,
    near: f32,
    far: f32,
}

fn corner_direction(corner: vec2u) -> vec3f {
    let at = vec2f(view.tile_start + corner);
    let d = view.forward + view.right * (at.x * view.pixel.x - 1.0) + view.up * (1.0 - at.y * view.pixel.y);
    return normalize(d);
}

// Of the rays between two corners.
fn cone_of(low: vec2u, high: vec2u, near: f32, far: f32) -> Cone {
    let a = corner_direction(low);
    let b = corner_direction(vec2u(high.x, low.y));
    let c = corner_direction(vec2u(low.x, high.y));
    let d = corner_direction(high);
    let sum = a + b + c + d;
    let axis = sum / max(length(sum), 1e-30);
    let cosine = min(min(dot(a, axis), dot(b, axis)), min(dot(c, axis), dot(d, axis))) - 1e-6;
    return Cone(axis, cosine, sqrt(max(1.0 - cosine * cosine, 0.0)), near, far);
}

// Whether rays of the cone may meet a sphere around `centre`, as seen from the camera, where they are inside.
fn may_meet(cone: Cone, centre: vec3f, exact_radius: f32) -> bool {
    let distance = length(centre);
    let radius = exact_radius * 1.001 + distance * 1e-6;
    if (distance - radius > cone.far || distance + radius < cone.near) {
        return false;
    }
    if (!(cone.cosine > LEAST_COSINE)) {
        return true;
    }
    let along = dot(centre, cone.axis);
    let across = length(centre - cone.axis * along);
    return across * cone.cosine - along * cone.sine <= radius && along >= -radius;
}

fn mark(bit: u32) {
    atomicOr(&marks[bit / 32u], 1u << (bit & 31u));
}

// The greatest distance at which rays see kernels that enter the object at `start` at the latest and leave it at `end`.
fn sight(start: f32, end: f32) -> f32 {
    return min(end, start + medium.sight);
}

fn kernel_of(sample: u32) -> Kernel {
    let s = samples[sample];
    let at = SOURCE * (view.slot * medium.samples + sample);
    return Kernel(s.xyz - view.origin, s.w, sources[at],
        sources[at + 1u].xyz, sources[at + 2u].xyz, sources[at + 3u].xyz);
}

// One ray of a thread.
struct Ray {
    index: u32,
    ends: vec4f,        // of the piece, transmittances of its boundary
    direction: vec3f,
}

struct Sums {
    numerator: vec3f,
    kernels: u32,       // that the ray met
    denominator: vec3f,
}

fn sum(sums: Sums, one: Contribution) -> Sums {
    return Sums(sums.numerator + one.numerator, sums.kernels + u32(one.met), sums.denominator + one.denominator);
}

// The rays of a thread in one half, and what they gathered.
struct Pair {
    left: Ray,
    right: Ray,
}

struct PairSums {
    left: Sums,
    right: Sums,
}

fn add_kernel(before: PairSums, kernel: Kernel, rays: Pair) -> PairSums {
    return PairSums(
        sum(before.left, contribution(kernel, rays.left.index, rays.left.direction, rays.left.ends.xy)),
        sum(before.right, contribution(kernel, rays.right.index, rays.right.direction, rays.right.ends.xy)));
}

fn ray_at(pixel: vec2u, piece: u32) -> Ray {
    var ray = Ray(0u, vec4f(0.0), ray_direction(pixel));
    if (all(pixel < view.tile_size)) {
        ray.index = pixel_index(pixel);
        ray.ends = pieces[piece * (arrayLength(&pieces) / PIECES) + ray.index];
    }
    return ray;
}

// Eight threads that follow each other have 4 x 4 pixels, and so on.
fn rays_of(tile: vec2u, piece: u32, half: u32, local: u32) -> Pair {
    let x = 2u * (local & 1u) + ((local >> 1u) & 4u) + ((local >> 2u) & 8u);
    let y = ((local >> 1u) & 3u) + ((local >> 2u) & 4u) + 8u * half;
    let pixel = tile * SIDE + vec2u(x, y);
    return Pair(ray_at(pixel, piece), ray_at(pixel + vec2u(1u, 0u), piece));
}

fn is_inside(ray: Ray) -> bool {
    return ray.ends.y > ray.ends.x;
}

fn bound(ray: Ray) {
    if (is_inside(ray)) {
        atomicMin(&bounds[0], bitcast<u32>(ray.ends.x));
        atomicMax(&bounds[1], bitcast<u32>(ray.ends.x));
        atomicMax(&bounds[2], bitcast<u32>(ray.ends.y));
    }
}

// Lists those that are marked, in order, behind the first `before`; `base` is what the first bit of the thread's word
// stands for.
fn list_marked(local: u32, before: u32, base: u32) {
    if (local < WORDS) {
        var place = before;
        for (var word = 0u; word < local; word++) {
            place += countOneBits(atomicLoad(&marks[word]));
        }
        for (var bits = atomicLoad(&marks[local]); bits != 0u; bits &= bits - 1u) {
            listed[place] = base + firstTrailingBit(bits);
            place++;
        }
        if (local == WORDS - 1u) {
            count = place;
        }
    }
}

// Column and row of a workgroup's tile, whose view is from now on at hand.
fn pick_tile(group: u32) -> vec2u {
    let listed_tile = tiles[group];
    view = views[listed_tile >> 26u];
    return vec2u(listed_tile & 0x1fffu, (listed_tile >> 13u) & 0x1fffu);
}

// One of 64 threads of a tile; `sharer` says which slice of the samples and which half are its workgroup's; `lane` of
// `lanes` that can talk.
fn gather(tile: vec2u, sharer: u32, local: u32, lane: u32, lanes: u32) {
    let shares = MOST_HALVES / HALVES;
    let first_half = sharer % shares * HALVES;
    for (var piece = 0u; piece < PIECES; piece++) {
        // Where no ray has this one none has a further one.
        if (!gather_piece(tile, piece, sharer / shares, first_half, local, lane, lanes)) {
            break;
        }
    }
}

// Whether any ray has the piece.
fn gather_piece(
    tile: vec2u,
    piece: u32,
    slice: u32,
    first_half: u32,
    local: u32,
    lane: u32,
    lanes: u32,
) -> bool {
    if (local < WORDS) {
        atomicStore(&marks[local], 0u);
    }
    if (local < 3u) {
        atomicStore(&bounds[local], select(0u, 0xffffffffu, local == 0u));
    }
    workgroupBarrier();
    for (var half = 0u; half < HALVES; half++) {
        let rays = rays_of(tile, piece, first_half + half, local);
        bound(rays.left);
        bound(rays.right);
    }
    workgroupBarrier();
    if (local == 0u) {
        range = vec2f(1.0, 0.0);
        if (atomicLoad(&bounds[2]) > 0u) {
            let far = sight(bitcast<f32>(atomicLoad(&bounds[1])), bitcast<f32>(atomicLoad(&bounds[2])));
            range = vec2f(bitcast<f32>(atomicLoad(&bounds[0])), far);
        }
    }
    let reach = workgroupUniformLoad(&range);
    if (reach.y < reach.x) {
        return false;
    }
    let rows = SIDE / MOST_HALVES;
    let corner = tile * SIDE + vec2u(0u, first_half * rows);
    let cone = cone_of(corner, corner + vec2u(SIDE, HALVES * rows), reach.x, reach.y);
    var sums: array<PairSums, MOST_HALVES>;
    for (var half = 0u; half < HALVES; half++) {
        let rays = rays_of(tile, piece, first_half + half, local);
        sums[half] = PairSums(begin(rays.left, piece, slice), begin(rays.right, piece, slice));
    }
    // All tiles have as many slices; the same for all threads, as barriers want it.
    let clusters = (medium.samples + CLUSTER - 1u) / CLUSTER;
    let end_of_slice = clusters * (slice + 1u) / views[0].slices;
    for (var first = clusters * slice / views[0].slices; first < end_of_slice; first += ROUND) {
        for (var bit = local; bit < min(ROUND, end_of_slice - first); bit += CLUSTER) {
            let sphere = samples[medium.samples + first + bit];
            if (sphere.w > 0.0 && may_meet(cone, sphere.xyz - view.origin, sphere.w)) {
                mark(bit);
            }
        }
        workgroupBarrier();
        list_marked(local, 0u, first + 32u * local);
        let hits = workgroupUniformLoad(&count);
        for (var k = local; k < hits; k += CLUSTER) {
            found[k] = listed[k];
        }
        if (local < WORDS) {
            atomicStore(&marks[local], 0u);
        }
        workgroupBarrier();
        var known = 0u;
        for (var group = 0u; group < hits; group += GROUP) {
            let end = min(group + GROUP, hits);
            for (var k = group; k < end; k++) {
                let sample = found[k] * CLUSTER + local;
                if (sample < medium.samples) {
                    let kernel = samples[sample];
                    if (may_meet(cone, kernel.xyz - view.origin, CUT_OFF_RADIUS / kernel.w)) {
                        mark((k - group) * CLUSTER + local);
                    }
                }
            }
            workgroupBarrier();
            list_marked(local, known, found[min(group + local / 2u, hits - 1u)] * CLUSTER + 32u * (local & 1u));
            known = workgroupUniformLoad(&count);
            if (local < WORDS) {
                atomicStore(&marks[local], 0u);
            }
            // The next group may list as many again.
            if (end == hits || known > ROUND) {
                for (var half = 0u; half < HALVES; half++) {
                    sums[half] = add_listed(sums[half], known, lane, lanes, rays_of(tile, piece, first_half + half, local));
                }
                known = 0u;
            }
            workgroupBarrier();
        }
    }
    for (var half = 0u; half < HALVES; half++) {
        let rays = rays_of(tile, piece, first_half + half, local);
        finish(rays.left, piece, slice, sums[half].left);
        finish(rays.right, piece, slice, sums[half].right);
    }
    // The next piece begins anew with what all threads have read.
    workgroupBarrier();
    return true;
}
