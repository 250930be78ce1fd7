// A vertex that is to be placed: where from, how far it may move, a step outwards that may reach the surface (0 if
// nothing is known), and bits of the axes along which it does not move.
struct Task {
    start: vec3<f32>,
    radius: f32,
    hint: vec3<f32>,
    fixed: u32,
}

// 1 for each axis along which the vertex moves, else 0.
fn free_axes(fixed: u32) -> vec3<f32> {
    return vec3<f32>((vec3<u32>(fixed) & vec3<u32>(1u, 2u, 4u)) == vec3<u32>(0u));
}
