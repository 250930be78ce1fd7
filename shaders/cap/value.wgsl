// A field with closed borders (src/extract/cap.rs): its own values in the domain, far outside around it. The domain's constants
// are written before this.
fn value_coordinates(p: vec3<f32>) -> vec3<f32> {
    let way = p - VALUE_ORIGIN;
    return vec3<f32>(dot(VALUE_ROWS[0], way), dot(VALUE_ROWS[1], way), dot(VALUE_ROWS[2], way));
}

fn density(p: vec3<f32>) -> f32 {
    // Points of the grid are half a step or more from where that changes.
    let q = value_coordinates(p);
    if all(q >= vec3<f32>(-0.5)) && all(q <= VALUE_CELLS + 0.5) {
        return capped_density(p);
    }
    return VALUE_FAR;
}
