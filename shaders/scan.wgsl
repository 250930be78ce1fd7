// scan: exclusive prefix sums of pairs of counters, the total behind the last. What is scanned, `item`, and where the
// sums go, `put`, are those of shaders/scan/counts.wgsl or map.wgsl.
//
// Reduce, then scan (three dispatches): deterministic, and no workgroup waits for another. A run of
// 64 items is summed by one invocation with no barrier; software adapters pay dearly for barriers.
// CPU twin: src/stage/scan/cpu.rs.

@group(0) @binding(11) var<storage, read_write> partials: array<vec2<u32>>;

const RUN = 64u;

@compute @workgroup_size(64)
fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    let end = min((id.x + 1u) * RUN, item_count());
    if id.x * RUN < end {
        var sum = vec2<u32>(0u);
        for (var i = id.x * RUN; i < end; i++) {
            sum += item(i);
        }
        partials[id.x] = sum;
    }
}

var<workgroup> chunks: array<vec2<u32>, 64>;

// One workgroup: every invocation sums a chunk of the partial sums, the first scans the chunks.
@compute @workgroup_size(64)
fn scan_partials(@builtin(local_invocation_index) lane: u32) {
    let n = (item_count() + RUN - 1u) / RUN;
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
        let sum_of_run = partials[i];
        partials[i] = before;
        before += sum_of_run;
    }
}

@compute @workgroup_size(64)
fn apply(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = item_count();
    let end = min((id.x + 1u) * RUN, n);
    if id.x * RUN < end {
        var before = partials[id.x];
        for (var i = id.x * RUN; i < end; i++) {
            let own = item(i);
            put(i, before);
            before += own;
        }
        if end == n {
            put(n, before);
        }
    } else if id.x == 0u {
        // Nothing to scan: the total is still there for those who read it.
        put(0u, vec2<u32>(0u));
    }
}
