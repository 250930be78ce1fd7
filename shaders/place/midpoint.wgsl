// Vertices in the middle of their edges.
fn fraction(owner: vec3<u32>, across: vec3<u32>, a: u32, b: u32) -> f32 {
    return 0.5;
}
