// Vertices where the linear interpolant of the edge's ends is iso (Lorensen & Cline).
fn unsnapped(a: f32, b: f32) -> f32 {
    return crossing(a, b);
}
