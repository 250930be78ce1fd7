// sample: the field's values at the 9³ points of each active brick of the batch.
// CPU twin: src/stage/sample/cpu.rs.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

@compute @workgroup_size(9, 9, 3)
fn sample(
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    if slot >= batch_end(work.active_bricks) {
        return;
    }
    let origin = brick_origin(active_list[slot]);
    for (var z = local.z; z < 9u; z += 3u) {
        // Points past the grid's end repeat the last one; no stage looks at them.
        let point = min(origin + vec3<u32>(local.xy, z), params.points - vec3<u32>(1u));
        let place = (slot - call.first_slot) * 729u + local.x + 9u * (local.y + 9u * z);
        samples[place] = density(grid_position(vec3<f32>(point)));
    }
    report_runaway();
}
