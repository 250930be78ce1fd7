// Samples that are taken of the field here and now, and written down for emit: the sample stage within classify, so that
// no brick's samples are read once more.
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

const COUNTS_NON_FINITE = true;

// Each invocation takes every 64th. Points past the grid's end repeat the last one; no stage looks at them.
fn test_samples(slot: u32, origin: vec3<u32>, lane: u32) {
    for (var i = lane; i < 729u; i += 64u) {
        let point = min(origin + vec3<u32>(i % 9u, (i / 9u) % 9u, i / 81u), params.points - vec3<u32>(1u));
        let value = density(grid_position(vec3<f32>(point)));
        samples[(slot - params.first_slot) * 729u + i] = value;
        note_sample(i, bitcast<u32>(value));
    }
}
