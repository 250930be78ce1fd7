// Samples that classify takes of the field itself, and writes down for emit: the sample stage within classify, so that no brick's
// samples are read once more, and those of bricks without surface never written. What a column has, `Column`, `begin_column` and
// `in_column`, are those of evaluate/points.wgsl or planes.wgsl.
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

const COUNTS_NON_FINITE = true;

// The brick's samples, until it is known whether emit will ask for them.
var<workgroup> taken: array<f32, 729>;

// Takes and tests the brick's samples. Points past the grid's end repeat the last one; no stage looks at them. Called once a kernel, by
// all invocations.
fn load_columns(slot: u32, origin: vec3<u32>, at: u32, live: bool) {
    load_levels(origin, at, live);
    if live && at < 81u {
        let column = begin_column(grid_point(origin, vec3<u32>(at % 9u, at / 9u, 0u)));
        var flags = 0u;
        for (var z = 0u; z < 9u; z++) {
            let value = in_column(column, origin, z);
            taken[at + 81u * z] = value;
            flags |= sample_flags(bitcast<u32>(value)) << z;
        }
        brick_columns[at] = flags;
    }
    workgroupBarrier();
}

// A point of the brick, or the grid's last one.
fn grid_point(origin: vec3<u32>, local: vec3<u32>) -> vec3<u32> {
    return min(origin + local, params.points - vec3<u32>(1u));
}

fn world_of(point: vec3<u32>) -> vec3<f32> {
    return grid_position(vec3<f32>(point), vec3<f32>(0.0));
}

// Called by all invocations, of a brick that has surface.
fn keep_samples(slot: u32, at: u32) {
    let first = (slot - call.first_slot) * 729u;
    for (var i = at; i < 729u; i += GROUP) {
        samples[first + i] = taken[i];
    }
}
