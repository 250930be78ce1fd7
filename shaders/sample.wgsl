// sample: the field's values at the 9³ points of each active brick of the batch.
// CPU twin: src/stage/sample/cpu.rs.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

// In one dimension: software adapters fill up the first one to their vectors' length.
@compute @workgroup_size(243)
fn sample(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    if slot >= batch_end(work.active_bricks) {
        return;
    }
    let origin = brick_origin(active_list[slot]);
    for (var i = lane; i < 729u; i += 243u) {
        // Points past the grid's end repeat the last one; no stage looks at them.
        let local = vec3<u32>(i % 9u, (i / 9u) % 9u, i / 81u);
        let point = min(origin + local, params.points - vec3<u32>(1u));
        samples[(slot - call.first_slot) * 729u + i] = density(grid_position(vec3<f32>(point), vec3<f32>(0.0)));
    }
    report_runaway();
}
