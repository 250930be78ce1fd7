// The gradient of a field by forward differences over `params.delta`; CPU twin: src/field/differences.rs.
fn density_gradient(p: vec3<f32>) -> vec3<f32> {
    let high = vec3<f32>(p.x + params.delta, p.y + params.delta, p.z + params.delta);
    let here = density(p);
    return vec3<f32>(
        density(vec3<f32>(high.x, p.yz)) - here,
        density(vec3<f32>(p.x, high.y, p.z)) - here,
        density(vec3<f32>(p.xy, high.z)) - here,
    );
}
