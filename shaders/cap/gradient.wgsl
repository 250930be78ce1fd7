// The gradient of a field with closed borders: out of the domain where a vertex lies on its border.
fn gradient_coordinates(p: vec3<f32>) -> vec3<f32> {
    let way = p - GRADIENT_ORIGIN;
    return vec3<f32>(dot(GRADIENT_ROWS[0], way), dot(GRADIENT_ROWS[1], way), dot(GRADIENT_ROWS[2], way));
}

fn density_gradient(p: vec3<f32>) -> vec3<f32> {
    let q = gradient_coordinates(p);
    var of_cap = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        if q[k] < GRADIENT_NEAR {
            of_cap -= GRADIENT_OUT[k];
        }
        if q[k] > GRADIENT_CELLS[k] - GRADIENT_NEAR {
            of_cap += GRADIENT_OUT[k];
        }
    }
    if any(of_cap != vec3<f32>(0.0)) {
        return of_cap;
    }
    return capped_density_gradient(p);
}
