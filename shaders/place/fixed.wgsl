// Vertices that stay where the samples put them.
const CENTRES_MOVE = false;

fn fraction(owner: vec3<u32>, across: vec3<u32>, a: u32, b: u32) -> f32 {
    return unsnapped(bitcast<f32>(a), bitcast<f32>(b));
}

fn snap_within(slot: u32, origin: vec3<u32>, cell: vec3<u32>, within: vec3<f32>, outward: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(origin + cell) + within;
}
