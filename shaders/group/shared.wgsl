// Sums over a workgroup by doubling steps (Hillis & Steele 1986): for GPUs without subgroup operations.
// `group_before` gives the same in every form (serial.wgsl, subgroup.wgsl).

struct Lane {
    @builtin(local_invocation_index) index: u32,
}

// The invocation's number in its workgroup.
fn lane_of(lane: Lane) -> u32 {
    return lane.index;
}

var<workgroup> group_sums: array<Sum, GROUP>;

// The sum of the values of the invocations before this one. Called once a kernel, by all invocations.
fn group_before(lane: Lane, value: Sum) -> Sum {
    var sum = value;
    group_sums[lane.index] = sum;
    workgroupBarrier();
    for (var step = 1u; step < GROUP; step *= 2u) {
        sum += select(Sum(0u), group_sums[lane.index - min(lane.index, step)], lane.index >= step);
        workgroupBarrier();
        group_sums[lane.index] = sum;
        workgroupBarrier();
    }
    return sum - value;
}
