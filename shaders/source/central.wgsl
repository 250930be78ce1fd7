// The gradient of a field by central differences over `params.delta`; CPU twin: src/field/differences.rs.
fn density_gradient(p: vec3<f32>) -> vec3<f32> {
    let low = vec3<f32>(p.x - params.delta, p.y - params.delta, p.z - params.delta);
    let high = vec3<f32>(p.x + params.delta, p.y + params.delta, p.z + params.delta);
    return vec3<f32>(
        density(vec3<f32>(high.x, p.yz)) - density(vec3<f32>(low.x, p.yz)),
        density(vec3<f32>(p.x, high.y, p.z)) - density(vec3<f32>(p.x, low.y, p.z)),
        density(vec3<f32>(p.xy, high.z)) - density(vec3<f32>(p.xy, low.z)),
    );
}
