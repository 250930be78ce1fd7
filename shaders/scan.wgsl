// scan: exclusive prefix sums of three counters at once, the total behind the last. What is scanned, `item`, and where the
// sums go, `put` and `put_total`, are those of shaders/scan/bricks.wgsl, counts.wgsl or map.wgsl.
//
// Reduce, then scan (three dispatches): deterministic, and no workgroup waits for another. An invocation sums RUN items,
// many on software adapters, which pay dearly for barriers, and one on GPUs (src/gpu/form.rs).
// CPU twin: src/stage/scan/cpu.rs.

@group(0) @binding(11) var<storage, read_write> partials: array<Sum>;

// The items of an invocation: the first, and the one behind the last.
fn run_of(lane: Lane, group: vec3<u32>, groups: vec3<u32>) -> vec2<u32> {
    let n = item_count();
    let first = min(((group.y * groups.x + group.x) * GROUP + lane_of(lane)) * RUN, n);
    return vec2<u32>(first, min(first + RUN, n));
}

fn sum_of(run: vec2<u32>) -> Sum {
    var sum = Sum();
    for (var i = run.x; i < run.y; i++) {
        sum += item(i);
    }
    return sum;
}

@compute @workgroup_size(GROUP)
fn reduce(
    lane: Lane,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let sum = sum_of(run_of(lane, group, groups));
    let before = group_before(lane, sum);
    let number = group.y * groups.x + group.x;
    if lane_of(lane) + 1u == GROUP && number * GROUP * RUN < item_count() {
        partials[number] = before + sum;
    }
}

// One workgroup: every invocation sums a chunk of the partial sums.
@compute @workgroup_size(GROUP)
fn scan_partials(lane: Lane) {
    let n = (item_count() + GROUP * RUN - 1u) / (GROUP * RUN);
    let chunk = (n + GROUP - 1u) / GROUP;
    let first = min(lane_of(lane) * chunk, n);
    let end = min(first + chunk, n);
    var sum = Sum();
    for (var i = first; i < end; i++) {
        sum += partials[i];
    }
    var before = group_before(lane, sum);
    for (var i = first; i < end; i++) {
        let of_group = partials[i];
        partials[i] = before;
        before += of_group;
    }
}

@compute @workgroup_size(GROUP)
fn apply(
    lane: Lane,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let run = run_of(lane, group, groups);
    let in_group = group_before(lane, sum_of(run));
    let n = item_count();
    let number = group.y * groups.x + group.x;
    var before = in_group;
    if number * GROUP * RUN < n {
        before += partials[number];
    }
    for (var i = run.x; i < run.y; i++) {
        let own = item(i);
        put(i, own, before);
        before += own;
    }
    // Where there is nothing to scan, the total is still there for those who read it.
    if (run.y == n && run.x < n) || (n == 0u && number == 0u && lane_of(lane) == 0u) {
        put_total(n, before);
    }
}
