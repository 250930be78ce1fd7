// Sums over a workgroup with a single barrier: for software adapters, to which a barrier costs more than additions.
// `group_before` gives the same in every form (shared.wgsl, subgroup.wgsl).

struct Lane {
    @builtin(local_invocation_index) index: u32,
}

// The invocation's number in its workgroup.
fn lane_of(lane: Lane) -> u32 {
    return lane.index;
}

var<workgroup> group_values: array<Sum, GROUP>;

// The sum of the values of the invocations before this one. Called once a kernel, by all invocations.
fn group_before(lane: Lane, value: Sum) -> Sum {
    group_values[lane.index] = value;
    workgroupBarrier();
    var sum = Sum(0u);
    for (var i = 0u; i < lane.index; i++) {
        sum += group_values[i];
    }
    return sum;
}
