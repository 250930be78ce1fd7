// emit of the vertices within cells that topologically correct marching cubes needs: each the mean of the vertices around it. One
// invocation a row. CPU twin: src/stage/emit/cpu/centres.rs.

@compute @workgroup_size(64)
fn emit_centres(
    @builtin(local_invocation_index) row: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let slot = slot_of(group, groups);
    if slot >= batch_end(work.own_active) || centres_of_row(slot, row) == 0u {
        return;
    }
    let origin = brick_origin(active_list[slot]);
    let y = row % 8u;
    let z = row / 8u;
    let case_rows = vec4<u32>(
        row_inside(slot, origin, y, z),
        row_inside(slot, origin, y + 1u, z),
        row_inside(slot, origin, y, z + 1u),
        row_inside(slot, origin, y + 1u, z + 1u),
    );
    var number = first_centre(slot, row);
    for (var mixed = mixed_cells(case_rows, row_shape(origin, y, z)); mixed != 0u; mixed &= mixed - 1u) {
        let cell = vec3<u32>(countTrailingZeros(mixed), y, z);
        let case_byte = cell_case(case_rows, cell.x);
        let entry = cell_entry(slot, origin, cell, case_byte);
        for (var i = 0u; i < centre_count(entry); i++) {
            let place = number - params.vertex_window;
            if place < call.vertex_capacity {
                write_vertex(place, make_centre(slot, origin, cell, around_centre(entry, i), (case_byte & 1u) == 1u));
            }
            number--;
        }
    }
    report_runaway();
}

fn row_inside(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> u32 {
    var bits = 0u;
    for (var x = 0u; x < 9u; x++) {
        bits |= u32(is_inside(sample_bits(slot, origin, vec3<u32>(x, y, z)))) << x;
    }
    return bits;
}

fn make_centre(slot: u32, origin: vec3<u32>, cell: vec3<u32>, around: u32, lowest_inside: bool) -> Vertex {
    var sum = vec3<f32>(0.0);
    for (var edges = around; edges != 0u; edges &= edges - 1u) {
        let edge = countTrailingZeros(edges);
        let lower = lower_corner(edge);
        let axis = along(edge >> 2u);
        let a = sample_bits(slot, origin, cell + lower);
        let b = sample_bits(slot, origin, cell + lower + axis);
        sum += vec3<f32>(lower) + vec3<f32>(axis) * crossing(bitcast<f32>(a), bitcast<f32>(b));
    }
    let within = sum / f32(countOneBits(around));
    let position = grid_position(vec3<f32>(origin + cell) + within);
    let vector = outward_within(origin + cell, within, position);
    let known = has_direction(vector);
    var normal = unit(select(vec3<f32>(1.0), vector, known));
    if !known {
        normal = bitcast<vec3<f32>>(mark(0u, !lowest_inside));
        atomicStore(&work.singular, 1u);
    }
    return Vertex(position, normal);
}
