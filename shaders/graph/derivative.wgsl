// What the WGSL of the field graph's gradients (src/graph/wgsl.rs) is written with.

// A part of a derivative: 0 where either is 0, also where the other is infinite or NaN. So a branch that is
// not taken adds nothing, and an infinite slope along x says nothing of y.
fn iso_term(slope: f32, derivative: vec3<f32>) -> vec3<f32> {
    let nothing = vec3<bool>(slope == 0.0) | (derivative == vec3<f32>(0.0));
    return select(slope * derivative, vec3<f32>(0.0), nothing);
}

const AXIS_X = vec3<f32>(1.0, 0.0, 0.0);
const AXIS_Y = vec3<f32>(0.0, 1.0, 0.0);
const AXIS_Z = vec3<f32>(0.0, 0.0, 1.0);
