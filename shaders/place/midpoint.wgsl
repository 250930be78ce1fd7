// Vertices in the middle of their edges.
fn fraction(owner: vec3<u32>, across: vec3<u32>, a: u32, b: u32) -> f32 {
    let ends = vec2<f32>(bitcast<f32>(a), bitcast<f32>(b));
    return select(0.5, crossing(ends.x, ends.y), is_beyond(ends.x, ends.y));
}
