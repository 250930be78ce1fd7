// The form of shaders/source/evaluate.wgsl for grids along the world's axes: what the field takes of x and y alone is computed once
// for the nine planes of a brick, and what it takes of z alone once a plane.
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

const COUNTS_NON_FINITE = true;

var<workgroup> columns: array<DensityPlane, 81>;
var<workgroup> levels: array<DensityLevel, 9>;

// Takes and tests the brick's samples, each invocation every 64th, so that all have as much to do. Points past the grid's
// end repeat the last one; no stage looks at them. Called once a kernel, by all 64 invocations.
fn load_rows(slot: u32, origin: vec3<u32>, lane: u32, live: bool) {
    atomicStore(&brick_rows[lane], 0u);
    atomicStore(&brick_rows[min(lane + 64u, 80u)], 0u);
    if live {
        let last = params.points - vec3<u32>(1u);
        for (var i = lane; i < 81u; i += 64u) {
            let point = min(origin + vec3<u32>(i % 9u, i / 9u, 0u), last);
            columns[i] = density_plane(grid_position(vec3<f32>(point), vec3<f32>(0.0)));
        }
        // By the last ones, which have no second column.
        if lane >= 55u {
            let point = min(origin + vec3<u32>(0u, 0u, lane - 55u), last);
            levels[lane - 55u] = density_level(grid_position(vec3<f32>(point), vec3<f32>(0.0)));
        }
    }
    workgroupBarrier();
    if live {
        for (var i = lane; i < 729u; i += 64u) {
            let value = density_in_plane(columns[i % 81u], levels[i / 81u]);
            samples[(slot - call.first_slot) * 729u + i] = value;
            let flags = sample_flags(bitcast<u32>(value));
            if flags != 0u {
                atomicOr(&brick_rows[i / 9u], flags << (i % 9u));
            }
        }
    }
    workgroupBarrier();
}
