// sample, where the grid's axes are the world's: what the field takes of x and y alone is computed once for the nine planes
// of a brick. The other form: sample.wgsl, with the same CPU twin. How many invocations a workgroup has, LANES, says the form.

@group(0) @binding(6) var<storage, read> active_list: array<u32>;
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

@compute @workgroup_size(LANES)
fn sample(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let slot = slot_of(group, groups);
    if slot >= batch_end(work.active_bricks) {
        return;
    }
    let origin = brick_origin(active_list[slot]);
    // Points past the grid's end repeat the last one; no stage looks at them.
    let last = params.points - vec3<u32>(1u);
    for (var i = lane; i < 81u; i += LANES) {
        let in_plane = grid_position(vec3<f32>(min(origin + vec3<u32>(i % 9u, i / 9u, 0u), last)), vec3<f32>(0.0));
        let plane = density_plane(in_plane);
        let place = (slot - call.first_slot) * 729u + i;
        for (var z = 0u; z < 9u; z++) {
            let point = vec3<u32>(0u, 0u, min(origin.z + z, last.z));
            let level = density_level(grid_position(vec3<f32>(point), vec3<f32>(0.0)));
            samples[place + 81u * z] = density_in_plane(plane, level);
        }
    }
    report_runaway();
}
