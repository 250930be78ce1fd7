// Vectors at unit length, and what stands in a vertex's normal until it has one; twins: `unit` and `mark` in
// src/stage/normals/cpu.rs.

// 2⁻¹¹⁰: a gradient below it has no direction that every driver agrees on.
const LEAST_GRADIENT = 0x1p-110f;
// What the words of a mark are, but for the code of its edge and the sum of neighbours: as floats they lie
// far above 1, so that no normal is taken for one.
const MARK = 0x60000000u;

fn largest(v: vec3<f32>) -> f32 {
    return max(abs(v.x), max(abs(v.y), abs(v.z)));
}

fn has_direction(v: vec3<f32>) -> bool {
    return largest(v) >= LEAST_GRADIENT && is_finite(bitcast<u32>(v.x)) && is_finite(bitcast<u32>(v.y)) && is_finite(bitcast<u32>(v.z));
}

// A vector that has a direction, at unit length. Scaling first keeps the squares from overflowing and
// underflowing.
fn unit(v: vec3<f32>) -> vec3<f32> {
    let scaled = v / largest(v);
    let unit = scaled / sqrt((scaled.x * scaled.x + scaled.y * scaled.y) + scaled.z * scaled.z);
    // +0 for -0: drivers differ in what they make of a product with 0.
    return select(unit, vec3<f32>(0.0), unit == vec3<f32>(0.0));
}

// The mark of a vertex on an edge along `axis`, which leaves the solid forwards or backwards.
fn mark(axis: u32, backwards: bool) -> vec3<u32> {
    return vec3<u32>(MARK + axis + select(0u, 4u, backwards), MARK, MARK);
}

// By the first word; sums of neighbours stay within this range.
fn is_marked(word: u32) -> bool {
    return word >= 0x50000000u && word < 0x70000000u;
}
