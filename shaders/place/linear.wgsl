// Vertices where the linear interpolant of the edge's ends is iso (Lorensen & Cline).
fn fraction(owner: vec3<u32>, across: vec3<u32>, a: u32, b: u32) -> f32 {
    return crossing(bitcast<f32>(a), bitcast<f32>(b));
}
