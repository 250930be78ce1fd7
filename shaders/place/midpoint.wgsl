// Vertices in the middle of their edges.
fn unsnapped(a: f32, b: f32) -> f32 {
    return select(0.5, crossing(a, b), is_beyond(a, b));
}
