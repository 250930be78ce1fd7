// Sums over a workgroup by subgroup operations: for GPUs that have them, all of one size, so that each subgroup is full
// and the numbers below are those from 0 to the last. `group_before` gives the same in every form (serial.wgsl,
// shared.wgsl).

struct Lane {
    @builtin(subgroup_id) subgroup: u32,
    @builtin(subgroup_invocation_id) index: u32,
    @builtin(subgroup_size) size: u32,
}

// The invocation's number in its workgroup.
fn lane_of(lane: Lane) -> u32 {
    return lane.subgroup * lane.size + lane.index;
}

var<workgroup> subgroup_sums: array<Sum, GROUP>;

// The sum of the values of the invocations before this one. Called once a kernel, by all invocations.
fn group_before(lane: Lane, value: Sum) -> Sum {
    var sum = subgroupExclusiveAdd(value);
    if lane.index + 1u == lane.size {
        subgroup_sums[lane.subgroup] = sum + value;
    }
    workgroupBarrier();
    for (var i = 0u; i < lane.subgroup; i++) {
        sum += subgroup_sums[i];
    }
    return sum;
}
