// emit of the vertices within cells that topologically correct marching cubes needs: each the mean of the vertices around it,
// as the samples place these, and where vertices are snapped moved from there to the field's own surface (shaders/place/snapped.wgsl).
// CPU twin: src/stage/emit/cpu/centres.rs.

@compute @workgroup_size(ROW_LANES)
fn emit_centres(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    take_settings();
    let slot = listed_slot(group, groups);
    if slot == NO_SLOT {
        return;
    }
    // Of the invocation's rows, which have any. Few do, and what lavapipe executes for none of them it should once a brick.
    var rows = 0u;
    for (var row = lane; row < 64u; row += ROW_LANES) {
        rows |= u32(centres_of_row(slot, row) > 0u) << (row / ROW_LANES);
    }
    let origin = brick_origin(active_list[slot]);
    for (; rows != 0u; rows &= rows - 1u) {
        write_centres(slot, origin, lane + ROW_LANES * countTrailingZeros(rows));
    }
    report_runaway();
}

fn write_centres(slot: u32, origin: vec3<u32>, row: u32) {
    let y = row % 8u;
    let z = row / 8u;
    let case_rows = vec4<u32>(
        row_inside(slot, origin, y, z),
        row_inside(slot, origin, y + 1u, z),
        row_inside(slot, origin, y, z + 1u),
        row_inside(slot, origin, y + 1u, z + 1u),
    );
    var number = first_centre(slot, row);
    let mixed = mixed_cells(case_rows, row_shape(origin, y, z));
    for (var cells = mixed & undecided_cells(case_rows); cells != 0u; cells &= cells - 1u) {
        let cell = vec3<u32>(countTrailingZeros(cells), y, z);
        let lowest_inside = (cell_case(case_rows, cell.x) & 1u) == 1u;
        let entry = undecided_entry(slot, origin, cell);
        for (var i = 0u; i < centre_count(entry); i++) {
            let place = number - params.vertex_window;
            if place < call.vertex_capacity {
                write_vertex(place, make_centre(slot, origin, cell, around_centre(entry, i), lowest_inside));
            }
            number--;
        }
    }
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
        sum += vec3<f32>(lower) + vec3<f32>(axis) * unsnapped(bitcast<f32>(a), bitcast<f32>(b));
    }
    let lowest = origin + cell;
    let within = sum / f32(countOneBits(around));
    var position = grid_position(vec3<f32>(lowest), within);
    var vector = vec3<f32>(0.0);
    // A loop, so that the field's gradient is compiled once.
    for (var moves = u32(CENTRES_MOVE); ; moves--) {
        vector = outward_within(lowest, within, position);
        if moves == 0u {
            break;
        }
        position = domain_position(snap_within(slot, origin, cell, within, vector));
    }
    let known = has_direction(vector);
    var normal = unit(select(vec3<f32>(1.0), vector, known));
    if !known {
        normal = bitcast<vec3<f32>>(mark(0u, !lowest_inside));
        atomicStore(&work.singular, 1u);
    }
    return Vertex(position, normal);
}
