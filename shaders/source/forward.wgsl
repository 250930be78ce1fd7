// The gradient of a field by forward differences over `params.delta`; CPU twin: src/field/differences.rs.
fn density_gradient(p: vec3<f32>) -> vec3<f32> {
    // Kept from drivers' algebra: else `(p.x + d) - p.x` might become `d`.
    let high = vec3<f32>(iso_exact(p.x + params.delta), iso_exact(p.y + params.delta), iso_exact(p.z + params.delta));
    let here = density(p);
    return vec3<f32>(
        iso_exact(density(vec3<f32>(high.x, p.yz)) - here),
        iso_exact(density(vec3<f32>(p.x, high.y, p.z)) - here),
        iso_exact(density(vec3<f32>(p.xy, high.z)) - here),
    );
}
