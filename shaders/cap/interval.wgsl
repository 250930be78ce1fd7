// Bounds of a field with closed borders.
fn interval_coordinates(p: vec3<f32>) -> vec3<f32> {
    let way = p - INTERVAL_ORIGIN;
    return vec3<f32>(dot(INTERVAL_ROWS[0], way), dot(INTERVAL_ROWS[1], way), dot(INTERVAL_ROWS[2], way));
}

fn density_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32> {
    var low = interval_coordinates(vec3<f32>(x.x, y.x, z.x));
    var high = low;
    for (var i = 1u; i < 8u; i++) {
        let q = interval_coordinates(vec3<f32>(x[i & 1u], y[(i >> 1u) & 1u], z[i >> 2u]));
        low = min(low, q);
        high = max(high, q);
    }
    if any(low > INTERVAL_CELLS + 0.5) || any(high < vec3<f32>(-0.5)) {
        return iv_point(INTERVAL_FAR);
    }
    let own = capped_density_interval(x, y, z);
    if all(low > vec3<f32>(INTERVAL_NEAR)) && all(high < INTERVAL_CELLS - INTERVAL_NEAR) {
        return own;
    }
    return iv_hull(own, iv_point(INTERVAL_FAR));
}
