fn position(vertex: u32) -> vec3<f32> {
    return vec3<f32>(vertices[6u * vertex], vertices[6u * vertex + 1u], vertices[6u * vertex + 2u]);
}

fn normal(vertex: u32) -> vec3<f32> {
    return vec3<f32>(vertices[6u * vertex + 3u], vertices[6u * vertex + 4u], vertices[6u * vertex + 5u]);
}
