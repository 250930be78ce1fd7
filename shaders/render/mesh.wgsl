// Draws a mesh and its edges. Every function has a twin of the same name in src/render/shade.rs.

struct Frame {
    // From camera units relative to the eye to clip space.
    clip: mat4x4<f32>,
    eye: vec3<f32>,
    // Camera units per world unit.
    scale: f32,
    // Directions to the lights, world axes.
    key: vec3<f32>,
    // Shade: 0 lit, 1 normals, 2 debug.
    shade: u32,
    fill: vec3<f32>,
    // How much nearer lines are drawn, in depth units.
    line_bias: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

struct Varyings {
    @builtin(position) clip: vec4<f32>,
    // Relative to the eye, camera units, world axes.
    @location(0) ray: vec3<f32>,
    // Centroid: outside the triangle, at its rim, a normal would be made up.
    @location(1) @interpolate(perspective, centroid) normal: vec3<f32>,
    // Not zero if a corner has no usable position (x) or no usable normal (y).
    @location(2) marks: vec2<f32>,
    // Colour of the material, linear light.
    @location(3) @interpolate(perspective, centroid) base: vec3<f32>,
}

// The neutral material.
const NEUTRAL: vec3<f32> = vec3<f32>(0.42, 0.46, 0.53);

// The bits of 1e6 and of infinity: compared as integers, since compilers may assume that no NaN occurs.
const FAR_BITS: u32 = 0x49742400u;
const INFINITY_BITS: u32 = 0x7f800000u;

fn reaches(v: vec3<f32>, limit: u32) -> bool {
    let bits = bitcast<vec3<u32>>(v) & vec3<u32>(0x7fffffffu);
    return any(bits >= vec3<u32>(limit));
}

fn unit(v: vec3<f32>) -> vec3<f32> {
    let square = dot(v, v);
    if square > 0.0 {
        return v / sqrt(square);
    }
    return vec3<f32>(0.0);
}

fn vertex(position: vec3<f32>, normal: vec3<f32>, base: vec3<f32>) -> Varyings {
    var out: Varyings;
    let ray = (position - frame.eye) * frame.scale;
    let lost = reaches(ray, FAR_BITS);
    let bad = reaches(normal, INFINITY_BITS) || dot(normal, normal) == 0.0;
    out.ray = select(ray, vec3<f32>(0.0), lost);
    out.clip = select(frame.clip * vec4<f32>(ray, 1.0), vec4<f32>(0.0, 0.0, 0.0, 1.0), lost);
    out.normal = select(normal, vec3<f32>(0.0), bad);
    out.base = base;
    out.marks = vec2<f32>(select(0.0, 1.0, lost), select(0.0, 1.0, bad));
    return out;
}

@vertex
fn mesh_vertex(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Varyings {
    return vertex(position, normal, NEUTRAL);
}

@vertex
fn coloured_vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) base: vec3<f32>,
) -> Varyings {
    return vertex(position, normal, base);
}

@vertex
fn line_vertex(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Varyings {
    var out = vertex(position, normal, NEUTRAL);
    out.clip.z -= frame.line_bias * out.clip.w;
    return out;
}

fn encode_channel(linear: f32) -> f32 {
    let c = clamp(linear, 0.0, 1.0);
    if c <= 0.0031308 {
        return c * 12.92;
    }
    return 1.055 * pow(c, 1.0 / 2.4) - 0.055;
}

fn encode(linear: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(encode_channel(linear.x), encode_channel(linear.y), encode_channel(linear.z));
}

// Linear light of a material of colour `base`; normal and view are unit vectors on the viewer's side.
fn lit(base: vec3<f32>, normal: vec3<f32>, view: vec3<f32>) -> vec3<f32> {
    let ground = vec3<f32>(0.15, 0.14, 0.14);
    let sky = vec3<f32>(0.34, 0.38, 0.45);
    let key_light = vec3<f32>(1.30, 1.24, 1.15);
    let fill_light = vec3<f32>(0.16, 0.19, 0.24);
    let ambient = ground + (sky - ground) * (0.5 + 0.5 * normal.z);
    // Wrapped around and squared: no hard line where the light ends.
    let wrapped = max((dot(normal, frame.key) + 0.3) / 1.3, 0.0);
    let key = wrapped * wrapped;
    let fill = max(dot(normal, frame.fill), 0.0);
    let shine = max(dot(normal, unit(frame.key + view)), 0.0);
    // shine^32 without pow, which differs between adapters.
    let s2 = shine * shine;
    let s4 = s2 * s2;
    let s8 = s4 * s4;
    let s16 = s8 * s8;
    let edge = 1.0 - max(dot(normal, view), 0.0);
    let rim = edge * edge * edge;
    return base * (ambient + key_light * key + fill_light * fill) + vec3<f32>(0.16 * s16 * s16 + 0.05 * rim);
}

// The colour of a fragment, sRGB. `facet` is the triangle's own normal on the viewer's side.
fn colour(
    base: vec3<f32>,
    facet: vec3<f32>,
    normal: vec3<f32>,
    view: vec3<f32>,
    front: bool,
    bad: bool,
) -> vec3<f32> {
    let n = unit(normal);
    if frame.shade == 1u {
        return select(0.5 + 0.5 * n, vec3<f32>(0.0), bad);
    }
    if frame.shade == 2u {
        if !front {
            return vec3<f32>(1.0, 0.0, 1.0);
        }
        if bad {
            return vec3<f32>(1.0, 0.0, 0.0);
        }
        if dot(n, facet) < 0.0 {
            return vec3<f32>(1.0, 0.8, 0.0);
        }
        return vec3<f32>(0.45 + 0.45 * max(dot(facet, view), 0.0));
    }
    if bad {
        return encode(lit(base, facet, view));
    }
    return encode(lit(base, select(n, -n, dot(n, facet) < 0.0), view));
}

@fragment
fn mesh_fragment(in: Varyings, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let across = unit(cross(dpdx(in.ray), dpdy(in.ray)));
    if abs(in.marks.x) > 0.0 {
        discard;
    }
    let view = -unit(in.ray);
    let facet = select(across, -across, dot(across, view) < 0.0);
    return vec4<f32>(colour(in.base, facet, in.normal, view, front, abs(in.marks.y) > 0.0), 1.0);
}

// Premultiplied.
const LINE: vec4<f32> = vec4<f32>(0.03, 0.045, 0.075, 0.5);

@fragment
fn line_fragment(in: Varyings) -> @location(0) vec4<f32> {
    if abs(in.marks.x) > 0.0 {
        discard;
    }
    return LINE;
}
