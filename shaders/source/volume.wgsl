// Samples of a volume: read straight from the box of them that the slab needs, no copy a brick. In which type they lie
// there, `stored` knows.
@group(0) @binding(2) var<storage, read> source: array<u32>;

// The range table, built once a volume, has counted them.
const COUNTS_NON_FINITE = false;

fn volume_bits(point: vec3<u32>) -> u32 {
    let p = min(point, params.points - vec3<u32>(1u)) - params.source_first;
    return stored(p.x + params.source_extent.x * (p.y + params.source_extent.y * p.z));
}

// Bits of the sample at point `local` (0-8 an axis) of the brick; past the grid's end, of the last.
fn sample_bits(slot: u32, origin: vec3<u32>, local: vec3<u32>) -> u32 {
    return volume_bits(origin + local);
}

// Where row (y, z) of a brick begins; the last row again past the grid's end.
fn row_start(slot: u32, origin: vec3<u32>, y: u32, z: u32) -> u32 {
    let p = min(origin.yz + vec2<u32>(y, z), params.points.yz - vec2<u32>(1u)) - params.source_first.yz;
    return params.source_extent.x * (p.x + params.source_extent.y * p.y) - params.source_first.x;
}

// Bits of the sample at x (0-8) of that row.
fn row_bits(row: u32, origin: vec3<u32>, x: u32) -> u32 {
    return stored(row + min(origin.x + x, params.points.x - 1u));
}

// Difference along one axis per grid step: central inside, one-sided at the border.
fn volume_slope(point: vec3<u32>, axis: vec3<u32>, at: u32, last: u32) -> f32 {
    let lower = select(point, point - axis, at > 0u);
    let upper = select(point, point + axis, at < last);
    let difference = bitcast<f32>(volume_bits(upper)) - bitcast<f32>(volume_bits(lower));
    return select(difference, difference * 0.5, at > 0u && at < last);
}

fn volume_gradient(point: vec3<u32>) -> vec3<f32> {
    let last = params.points - vec3<u32>(1u);
    return vec3<f32>(
        volume_slope(point, vec3<u32>(1u, 0u, 0u), point.x, last.x),
        volume_slope(point, vec3<u32>(0u, 1u, 0u), point.y, last.y),
        volume_slope(point, vec3<u32>(0u, 0u, 1u), point.z, last.z),
    );
}

// Outward vector, not yet of unit length, at the fraction `t` of an owned edge to the point `across` (Lorensen & Cline:
// gradients at both ends, interpolated as the vertex is).
fn outward_vector(origin: vec3<u32>, local: vec3<u32>, across: vec3<u32>, t: f32, position: vec3<f32>) -> vec3<f32> {
    let a = volume_gradient(origin + local);
    let b = volume_gradient(origin + local + across);
    let g = a + (b - a) * t;
    return ((params.outward_x * g.x + params.outward_y * g.y) + params.outward_z * g.z) * call.outward_sign;
}

fn between(a: vec3<f32>, b: vec3<f32>, t: f32) -> vec3<f32> {
    return a + (b - a) * t;
}

// Gradients of two rows of a cell's corners along x, interpolated.
fn gradient_in_plane(lowest: vec3<u32>, within: vec3<f32>) -> vec3<f32> {
    let low = between(volume_gradient(lowest), volume_gradient(lowest + vec3<u32>(1u, 0u, 0u)), within.x);
    let next = lowest + vec3<u32>(0u, 1u, 0u);
    let high = between(volume_gradient(next), volume_gradient(next + vec3<u32>(1u, 0u, 0u)), within.x);
    return between(low, high, within.y);
}

// Outward vector, not yet of unit length, at a place within the cell with that lowest corner: gradients at its corners,
// interpolated as the samples are.
fn outward_within(lowest: vec3<u32>, within: vec3<f32>, position: vec3<f32>) -> vec3<f32> {
    let low = gradient_in_plane(lowest, within);
    let g = between(low, gradient_in_plane(lowest + vec3<u32>(0u, 0u, 1u), within), within.z);
    return ((params.outward_x * g.x + params.outward_y * g.y) + params.outward_z * g.z) * call.outward_sign;
}
