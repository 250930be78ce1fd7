// scan: exclusive prefix sums of pairs of counters, in place, the total behind the last.
//
// Reduce, then scan (three dispatches): deterministic, and no workgroup waits for another. A run of
// 64 items is summed by one invocation with no barrier; software adapters pay dearly for barriers.
// CPU twin: src/stage/scan/cpu.rs.

@group(0) @binding(9) var<storage, read_write> counts: array<vec2<u32>>;
@group(0) @binding(11) var<storage, read_write> partials: array<vec2<u32>>;

// Whether the items are the slab's bricks (marks of cull) or its active bricks (counts of classify).
override over_bricks: bool;

const RUN = 64u;

fn length() -> u32 {
    return select(work.active_bricks, params.slab_bricks, over_bricks);
}

@compute @workgroup_size(64)
fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    let end = min((id.x + 1u) * RUN, length());
    if id.x * RUN < end {
        var sum = vec2<u32>(0u);
        for (var i = id.x * RUN; i < end; i++) {
            sum += counts[i];
        }
        partials[id.x] = sum;
    }
}

var<workgroup> chunks: array<vec2<u32>, 64>;

// One workgroup: every invocation sums a chunk of the partial sums, the first scans the chunks.
@compute @workgroup_size(64)
fn scan_partials(@builtin(local_invocation_index) lane: u32) {
    let n = (length() + RUN - 1u) / RUN;
    let chunk = (n + 63u) / 64u;
    let first = min(lane * chunk, n);
    let end = min(first + chunk, n);
    var sum = vec2<u32>(0u);
    for (var i = first; i < end; i++) {
        sum += partials[i];
    }
    chunks[lane] = sum;
    workgroupBarrier();
    var before = vec2<u32>(0u);
    for (var i = 0u; i < lane; i++) {
        before += chunks[i];
    }
    for (var i = first; i < end; i++) {
        let item = partials[i];
        partials[i] = before;
        before += item;
    }
}

@compute @workgroup_size(64)
fn apply(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = length();
    let end = min((id.x + 1u) * RUN, n);
    if id.x * RUN < end {
        var before = partials[id.x];
        for (var i = id.x * RUN; i < end; i++) {
            let item = counts[i];
            counts[i] = before;
            before += item;
        }
        if end == n {
            counts[n] = before;
        }
    } else if id.x == 0u {
        // Nothing to scan: the total is still there for those who read it.
        counts[0] = vec2<u32>(0u);
    }
}
