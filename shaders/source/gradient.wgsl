// Normals of a field: its own gradient at the vertex.
fn outward_vector(origin: vec3<u32>, local: vec3<u32>, axis: vec3<u32>, t: f32, position: vec3<f32>) -> vec3<f32> {
    // +0 for −0: a driver that leaves out `0 + v` or `0 * v` has another zero than one that does not.
    let bits = bitcast<vec3<u32>>(density_gradient(position) * params.outward_sign);
    let zero = (bits << vec3<u32>(1u)) == vec3<u32>(0u);
    return bitcast<vec3<f32>>(select(bits, vec3<u32>(0u), zero));
}
