// Adds listed kernels to the sums of rays where lanes can talk: each loads one kernel, sees whether rays of its subgroup
// may meet it, and hands it to the others. Concatenated after gather.wgsl.
fn add_listed(before: PairSums, count: u32, lane: u32, lanes: u32, rays: Pair) -> PairSums {
    let left = is_inside(rays.left);
    let right = is_inside(rays.right);
    let starts = vec2f(rays.left.ends.x, rays.right.ends.x);
    let start = subgroupMin(min(select(1e30, starts.x, left), select(1e30, starts.y, right)));
    let latest = subgroupMax(max(select(0.0, starts.x, left), select(0.0, starts.y, right)));
    let end = subgroupMax(max(rays.left.ends.y, rays.right.ends.y));
    if (end <= 0.0) {
        return before;
    }
    let middle = subgroupAdd(rays.left.direction + rays.right.direction);
    let axis = middle / max(length(middle), 1e-30);
    let cosine = subgroupMin(min(dot(rays.left.direction, axis), dot(rays.right.direction, axis))) - 1e-6;
    let cone = Cone(axis, cosine, sqrt(max(1.0 - cosine * cosine, 0.0)), start, sight(latest, end));
    var sums = before;
    // A subgroup may be wider than the workgroup.
    let together = min(lanes, CLUSTER);
    for (var base = 0u; base < count; base += together) {
        let own = kernel_of(listed[min(base + lane, count - 1u)]);
        let meets = base + lane < count && own.source.w > 0.0 && may_meet(cone, own.centre, CUT_OFF_RADIUS / own.a);
        let votes = subgroupBallot(meets);
        for (var word = 0u; 32u * word < together; word++) {
            for (var bits = votes[word]; bits != 0u; bits &= bits - 1u) {
                let k = 32u * word + firstTrailingBit(bits);
                let kernel = Kernel(subgroupShuffle(own.centre, k), subgroupShuffle(own.a, k),
                    subgroupShuffle(own.source, k), subgroupShuffle(own.slope_r, k),
                    subgroupShuffle(own.slope_g, k), subgroupShuffle(own.slope_b, k));
                sums = add_kernel(sums, kernel, rays);
            }
        }
    }
    return sums;
}

@compute @workgroup_size(64)
fn gather_by_lanes(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(subgroup_invocation_id) lane: u32,
    @builtin(subgroup_size) lanes: u32,
) {
    gather(pick_tile(group.x), group.y, local, lane, lanes);
}
