// Arithmetic of floats with the CPU's bits on every driver: src/gpu/exact.rs puts these functions in place of + - * / and sqrt.
// Drivers may contract `a * b + c`, reorder sums, divide to 2.5 units in the last place and take roots to more. So results pass an
// operation on words that no driver sees through, and quotients and roots are rounded to the nearest float (nearest.wgsl).

fn iso_hidden_1(v: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(v) ^ params.nothing);
}

fn iso_hidden_2(v: vec2<f32>) -> vec2<f32> {
    return bitcast<vec2<f32>>(bitcast<vec2<u32>>(v) ^ vec2<u32>(params.nothing));
}

fn iso_hidden_3(v: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(v) ^ vec3<u32>(params.nothing));
}

fn iso_hidden_4(v: vec4<f32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(bitcast<vec4<u32>>(v) ^ vec4<u32>(params.nothing));
}

fn iso_exact_sum_1(a: f32, b: f32) -> f32 { return iso_hidden_1(a + b); }
fn iso_exact_sum_2(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> { return iso_hidden_2(a + b); }
fn iso_exact_sum_3(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> { return iso_hidden_3(a + b); }
fn iso_exact_sum_4(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> { return iso_hidden_4(a + b); }

fn iso_exact_difference_1(a: f32, b: f32) -> f32 { return iso_hidden_1(a - b); }
fn iso_exact_difference_2(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> { return iso_hidden_2(a - b); }
fn iso_exact_difference_3(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> { return iso_hidden_3(a - b); }
fn iso_exact_difference_4(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> { return iso_hidden_4(a - b); }

fn iso_exact_product_1(a: f32, b: f32) -> f32 { return iso_hidden_1(a * b); }
fn iso_exact_product_2(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> { return iso_hidden_2(a * b); }
fn iso_exact_product_3(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> { return iso_hidden_3(a * b); }
fn iso_exact_product_4(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> { return iso_hidden_4(a * b); }

// Of a vector and a number.
fn iso_exact_multiple_2(a: vec2<f32>, b: f32) -> vec2<f32> { return iso_hidden_2(a * b); }
fn iso_exact_multiple_3(a: vec3<f32>, b: f32) -> vec3<f32> { return iso_hidden_3(a * b); }
fn iso_exact_multiple_4(a: vec4<f32>, b: f32) -> vec4<f32> { return iso_hidden_4(a * b); }

fn iso_exact_quotient_1(a: f32, b: f32) -> f32 {
    return iso_hidden_1(iso_nearest_quotient(a, b, a / b));
}

fn iso_exact_root_1(v: f32) -> f32 {
    return iso_hidden_1(iso_nearest_root(v, sqrt(v)));
}

fn iso_exact_quotient_2(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(iso_exact_quotient_1(a.x, b.x), iso_exact_quotient_1(a.y, b.y));
}

fn iso_exact_root_2(v: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(iso_exact_root_1(v.x), iso_exact_root_1(v.y));
}

fn iso_exact_quotient_3(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(iso_exact_quotient_1(a.x, b.x), iso_exact_quotient_1(a.y, b.y), iso_exact_quotient_1(a.z, b.z));
}

fn iso_exact_root_3(v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(iso_exact_root_1(v.x), iso_exact_root_1(v.y), iso_exact_root_1(v.z));
}

fn iso_exact_quotient_4(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(iso_exact_quotient_1(a.x, b.x), iso_exact_quotient_1(a.y, b.y), iso_exact_quotient_1(a.z, b.z), iso_exact_quotient_1(a.w, b.w));
}

fn iso_exact_root_4(v: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(iso_exact_root_1(v.x), iso_exact_root_1(v.y), iso_exact_root_1(v.z), iso_exact_root_1(v.w));
}
