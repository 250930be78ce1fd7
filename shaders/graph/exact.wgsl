// What the WGSL of the field graph (src/graph/wgsl.rs) is written with.

// A sum or product as a driver cannot see through it: else one would contract `a * b + c`, another (Mesa)
// reorder `(a + b) + c`, and values would differ between drivers and from the CPU's. The last place of the
// parameters is none's: it is 0, which only we know.
fn iso_exact(v: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(v) ^ bitcast<u32>(field_parameters[1023].w));
}

// The point: drivers would move a constant of the field into the sum that it comes from.
fn iso_point(p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(iso_exact(p.x), iso_exact(p.y), iso_exact(p.z));
}

// A part of a derivative: 0 where either is 0, also where the other is infinite or NaN. So a branch that is
// not taken adds nothing, and an infinite slope along x says nothing of y.
fn iso_term(slope: f32, derivative: vec3<f32>) -> vec3<f32> {
    let d = slope * derivative;
    let nothing = vec3<bool>(slope == 0.0) | (derivative == vec3<f32>(0.0));
    return select(vec3<f32>(iso_exact(d.x), iso_exact(d.y), iso_exact(d.z)), vec3<f32>(0.0), nothing);
}

const AXIS_X = vec3<f32>(1.0, 0.0, 0.0);
const AXIS_Y = vec3<f32>(0.0, 1.0, 0.0);
const AXIS_Z = vec3<f32>(0.0, 0.0, 1.0);
