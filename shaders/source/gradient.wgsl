// Normals of a field: its own gradient at the vertex.
fn outward_vector(origin: vec3<u32>, local: vec3<u32>, across: vec3<u32>, t: f32, position: vec3<f32>) -> vec3<f32> {
    return density_gradient(position) * call.outward_sign;
}

// The same at a place within a cell.
fn outward_within(lowest: vec3<u32>, within: vec3<f32>, position: vec3<f32>) -> vec3<f32> {
    return density_gradient(position) * call.outward_sign;
}
