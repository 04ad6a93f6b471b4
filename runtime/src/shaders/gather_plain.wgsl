// Adds listed kernels to the sums of rays where lanes cannot talk. Concatenated after gather.wgsl.
fn add_listed(before: PairSums, count: u32, lane: u32, lanes: u32, rays: Pair) -> PairSums {
    var sums = before;
    for (var k = 0u; k < count; k++) {
        let kernel = kernel_of(listed[k]);
        sums = add_kernel(sums, kernel, rays);
    }
    return sums;
}

@compute @workgroup_size(64)
fn gather_plainly(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    gather(pick_tile(group.x), group.y, local, 0u, 1u);
}
