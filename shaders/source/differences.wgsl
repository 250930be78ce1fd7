// The gradient of a field that has none of its own: central differences over `params.delta`.
fn density_gradient(p: vec3<f32>) -> vec3<f32> {
    let x = vec3<f32>(params.delta, 0.0, 0.0);
    let y = vec3<f32>(0.0, params.delta, 0.0);
    let z = vec3<f32>(0.0, 0.0, params.delta);
    return vec3<f32>(
        density(p + x) - density(p - x),
        density(p + y) - density(p - y),
        density(p + z) - density(p - z),
    );
}
