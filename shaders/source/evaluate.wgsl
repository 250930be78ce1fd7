// Samples that are taken of the field here and now, and written down for emit: the sample stage within classify, so that
// no brick's samples are read once more.
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

const COUNTS_NON_FINITE = true;

// Bits of the brick's sample number `i`. Points past the grid's end repeat the last one; no stage looks at them.
fn take_sample(slot: u32, origin: vec3<u32>, i: u32) -> u32 {
    let point = min(origin + vec3<u32>(i % 9u, (i / 9u) % 9u, i / 81u), params.points - vec3<u32>(1u));
    let value = density(grid_position(vec3<f32>(point)));
    samples[(slot - params.first_slot) * 729u + i] = value;
    return bitcast<u32>(value);
}
