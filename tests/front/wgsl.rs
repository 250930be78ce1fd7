//! WGSL functions as expressions: against `f64` mathematics, and against a GPU that runs the text as it is.

use super::{at, on_gpu};
use crate::common::{self, Random};
use isoforge::field::user::UserField;
use isoforge::field::{Field, Points, Sense};
use isoforge::graph::interval::Interval;

pub fn field(source: &str) -> UserField {
    UserField::new(source, "user.wgsl", Sense::Below)
        .unwrap_or_else(|e| panic!("{e}\n{}", source.get(..2000).unwrap_or(source)))
}

pub fn density(body: &str) -> String {
    format!("fn density(p: vec3<f32>) -> f32 {{ {body} }}")
}

struct Case {
    name: &'static str,
    source: String,
    reference: fn([f64; 3]) -> f64,
}

fn length<const N: usize>(v: [f64; N]) -> f64 {
    v.iter().map(|a| a * a).sum::<f64>().sqrt()
}

fn case(name: &'static str, source: impl Into<String>, reference: fn([f64; 3]) -> f64) -> Case {
    Case { name, source: source.into(), reference }
}

fn cases() -> Vec<Case> {
    vec![
        case(
            "helpers, structures, constants",
            "struct Ball { centre: vec3<f32>, r: f32 }
            const R = 0.25;
            const BALLS = array<Ball, 2>(Ball(vec3(0.5, 0.0, 0.0), R), Ball(vec3<f32>(-0.5, 0.25, 0.0), 2.0 * R));
            fn ball(b: Ball, p: vec3<f32>) -> f32 { return length(p - b.centre) - b.r; }
            fn density(p: vec3<f32>) -> f32 {
                var d = 1e9;
                for (var i = 0; i < 2; i++) { d = min(d, ball(BALLS[i], p)); }
                return d;
            }",
            |[x, y, z]| (length([x - 0.5, y, z]) - 0.25).min(length([x + 0.5, y - 0.25, z]) - 0.5),
        ),
        case(
            "if, else, early return",
            density(
                "if p.x < -1.0 { return p.y; }
                var s = p.z;
                if p.y > 0.5 { s = s * 2.0; if p.z > 0.0 { return s + 3.0; } } else if p.y > 0.0 { s += 1.0; } else { s -= p.x; }
                return s;",
            ),
            |[x, y, z]| {
                if x < -1.0 {
                    y
                } else if y > 0.5 {
                    if z > 0.0 { 2.0 * z + 3.0 } else { 2.0 * z }
                } else if y > 0.0 {
                    z + 1.0
                } else {
                    z - x
                }
            },
        ),
        case(
            "switch",
            density(
                "var s = 0.0;
                switch i32(floor(p.x)) {
                    case -2: { s = p.y; }
                    case -1, 0: { if p.y > 0.0 { s = 1.0; break; } s = p.z; }
                    case 5: { return 77.0; }
                    default: { return p.z * p.z; }
                }
                return s + 10.0;",
            ),
            |[x, y, z]| match x.floor() as i32 {
                -2 => y + 10.0,
                -1 | 0 => 10.0 + if y > 0.0 { 1.0 } else { z },
                _ => z * z,
            },
        ),
        case(
            "loops with ways out",
            density(
                "var s = 0.0;
                var q = p;
                for (var i = 0; i < 8; i++) {
                    if i % 3 == 1 { continue; }
                    if q.z > 1.0 { continue; }
                    q = q * 1.25 + vec3(0.1, 0.0, -0.05);
                    if dot(q, q) > 9.0 { s += 100.0; break; }
                    s += f32(i);
                }
                return s + q.x;",
            ),
            |[mut x, mut y, mut z]| {
                let mut s = 0.0;
                for i in 0..8 {
                    if i % 3 == 1 || z > 1.0 {
                        continue;
                    }
                    (x, y, z) = (x * 1.25 + 0.1, y * 1.25, z * 1.25 - 0.05);
                    if x * x + y * y + z * z > 9.0 {
                        s += 100.0;
                        break;
                    }
                    s += f64::from(i);
                }
                s + x
            },
        ),
        case(
            "return in nested loops",
            density(
                "var i = 0u;
                while i < 4u {
                    var j = 0;
                    loop {
                        if p.x * f32(i) + p.y * f32(j) > 2.0 { return f32(i) * 10.0 + f32(j); }
                        continuing { j++; break if j >= 3; }
                    }
                    i += 1u;
                }
                return -p.z;",
            ),
            |[x, y, z]| {
                for i in 0..4 {
                    for j in 0..3 {
                        if x * f64::from(i) + y * f64::from(j) > 2.0 {
                            return f64::from(i * 10 + j);
                        }
                    }
                }
                -z
            },
        ),
        case(
            "arrays, pointers, assignments",
            "fn grow(a: ptr<function, f32>, by: f32) -> f32 { *a += by; return *a * 2.0; }
            fn fill(a: ptr<function, array<f32, 4>>, p: vec3<f32>) { for (var i = 0; i < 3; i++) { (*a)[i] = p[i]; } }
            fn density(p: vec3<f32>) -> f32 {
                var a: array<f32, 4>;
                fill(&a, p);
                var b = a[1]; a[3] = grow(&b, 0.5); a[1] = b;
                var v = vec4(0.0);
                v.y = a[1]; v[2] = a[3];
                v.x += a[u32(abs(p.z))];
                var flip = false;
                if p.x > 0.0 { flip = true; }
                let w = select(v.xyz, v.zyx, flip);
                return w.x * 2.0 + w.y + w.z - v.w;
            }",
            |[x, y, z]| {
                let a = [x, y + 0.5, z, 2.0 * (y + 0.5)];
                let v = [a[z.abs() as usize], a[1], a[3]];
                if x > 0.0 { v[2] * 2.0 + v[1] + v[0] } else { v[0] * 2.0 + v[1] + v[2] }
            },
        ),
        case(
            "early returns of functions that change what they are pointed to",
            "fn low(d: ptr<function, f32>, r: f32) { if r < 0.5 { return; } *d = r - 1.0; }
            fn tried(d: ptr<function, f32>, x: f32) -> bool {
                if x < 0.0 { return false; }
                *d += x;
                if x > 1.0 { *d *= 2.0; return false; }
                *d -= 3.0;
                return true;
            }
            fn first(d: ptr<function, f32>, p: vec3<f32>) {
                var a = p;
                for (var i = 0; i < 3; i++) {
                    if a[i] > 0.75 { *d += 10.0 * f32(i); low(d, a[i]); return; }
                    *d += 1.0;
                }
                switch i32(floor(p.y)) { case -1: { *d *= 3.0; return; } default: { *d += p.z; } }
                *d += 0.5;
            }
            fn density(p: vec3<f32>) -> f32 {
                var d = 0.25; var e = 0.0; var f = p.z;
                low(&d, length(p));
                if tried(&e, p.x) { e += 100.0; }
                first(&f, p);
                return d + e + f;
            }",
            |[x, y, z]| {
                let low = |d: f64, r: f64| if r < 0.5 { d } else { r - 1.0 };
                let e = match x {
                    x if x < 0.0 => 0.0,
                    x if x > 1.0 => 2.0 * x,
                    x => x - 3.0 + 100.0,
                };
                let mut f = z;
                let mut first = || {
                    for (i, a) in [x, y, z].into_iter().enumerate() {
                        if a > 0.75 {
                            f = low(f + 10.0 * i as f64, a);
                            return;
                        }
                        f += 1.0;
                    }
                    if y.floor() == -1.0 {
                        f *= 3.0;
                        return;
                    }
                    f += z + 0.5;
                };
                first();
                low(0.25, length([x, y, z])) + e + f
            },
        ),
        case(
            "functions of numbers",
            density(
                "return clamp(p.x, -0.5, 0.75) + mix(p.x, p.y, 0.25) + step(0.3, p.z) + smoothstep(-1.0, 1.0, p.y) + sign(p.z)
                    + floor(p.x) + 2.0 * ceil(p.y) + 3.0 * round(p.z) + fract(p.x * 2.0) + 5.0 * trunc(p.y) + sqrt(abs(p.x))
                    + inverseSqrt(1.0 + p.y * p.y) + fma(p.x, p.y, p.z) + saturate(p.z) + degrees(p.x) * 0.01 + radians(p.y)
                    + max(p.x, p.y) - min(p.y, p.z) + p.x % 0.7 + modf(p.y).fract + ldexp(p.x, 2) + sin(p.x) * cos(3.0 * p.y);",
            ),
            |[x, y, z]| {
                let t = ((y + 1.0) / 2.0).clamp(0.0, 1.0);
                x.clamp(-0.5, 0.75) + x * 0.75 + y * 0.25 + f64::from(u8::from(z >= 0.3)) + t * t * (3.0 - 2.0 * t) + z.signum()
                    + x.floor() + 2.0 * y.ceil() + 3.0 * z.round_ties_even() + (x * 2.0 - (x * 2.0).floor()) + 5.0 * y.trunc() + x.abs().sqrt()
                    + 1.0 / (1.0 + y * y).sqrt() + x * y + z + z.clamp(0.0, 1.0) + x.to_degrees() * 0.01 + y.to_radians()
                    + x.max(y) - y.min(z) + x % 0.7 + y.fract() + 4.0 * x + x.sin() * (3.0 * y).cos()
            },
        ),
        case(
            "exponentials and angles",
            density(
                "let u = 0.4 * p; let q = abs(p) + 1.0;
                return exp(u.x) + exp2(u.y) + log(q.x) + log2(q.y) + pow(q.z, 1.7) + pow(q.x, u.y) + pow(q.y, 3.0) + tan(u.z) + asin(u.x)
                    + acos(u.y) + atan(p.z) + atan2(p.y, p.x) + sinh(p.x) + cosh(p.y) + tanh(p.z) + asinh(p.x) + acosh(q.y) + atanh(u.z)
                    + exp(1.0) * pow(2.0, 0.5);",
            ),
            |[x, y, z]| {
                let [a, b, c] = [0.4 * x, 0.4 * y, 0.4 * z];
                let [q, r, s] = [x, y, z].map(|v| v.abs() + 1.0);
                a.exp() + b.exp2() + q.ln() + r.log2() + s.powf(1.7) + q.powf(b) + r.powi(3) + c.tan() + a.asin()
                    + b.acos() + z.atan() + y.atan2(x) + x.sinh() + y.cosh() + z.tanh() + x.asinh() + r.acosh() + c.atanh()
                    + 1f64.exp() * 2f64.sqrt()
            },
        ),
        case(
            "functions of vectors",
            density(
                "let n = normalize(p + vec3(0.0, 0.0, 5.0));
                let c = cross(p, vec3(1.0, 2.0, -1.0));
                let r = reflect(p, n) + refract(p, n, 0.5) * 0.1 + faceForward(n, p, vec3(1.0, 0.0, 1.0));
                return dot(c, p.zxy) + distance(p.xy, p.yz) + length(c) + r.x - r.y + 2.0 * r.z + length(p.x) + dot(n, n);",
            ),
            |[x, y, z]| {
                let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                let l = length([x, y, z + 5.0]);
                let n = [x / l, y / l, (z + 5.0) / l];
                let p = [x, y, z];
                let c = [-y - z * 2.0, z + x, x * 2.0 - y];
                let along = dot(n, p);
                let reflected = [0, 1, 2].map(|i| p[i] - 2.0 * along * n[i]);
                let k = 1.0 - 0.25 * (1.0 - along * along);
                let refracted = [0, 1, 2].map(|i| {
                    if k < 0.0 { 0.0 } else { 0.5 * p[i] - (0.5 * along + k.sqrt()) * n[i] }
                });
                let forward = if x + z < 0.0 { 1.0 } else { -1.0 };
                let r = [0, 1, 2].map(|i| reflected[i] + 0.1 * refracted[i] + forward * n[i]);
                dot(c, [z, x, y]) + length([x - y, y - z]) + length(c) + r[0] - r[1] + 2.0 * r[2] + x.abs() + 1.0
            },
        ),
        case(
            "matrices",
            density(
                "let m = mat3x3<f32>(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, p.x, 2.0);
                var t = transpose(m);
                t[2] = vec3(1.0, 1.0, 3.0);
                t[1][0] = p.y;
                let q = m * p + p * t + (m * t) * vec3(1.0, 0.0, p.z) * 0.5 + (2.0 * m - t)[0];
                let h = mat2x3<f32>(p, p.yzx) * vec2(0.5, -1.0);
                return q.x + 2.0 * q.y - q.z + determinant(t) + h.x * h.y
                    + determinant(mat4x4<f32>(1.0, p.x, 0.0, 2.0, 0.0, 1.0, p.y, 0.0, p.z, 0.0, 1.0, 0.0, 0.0, 3.0, 0.0, 1.0));",
            ),
            |[x, y, z]| {
                // Columns.
                let m = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, x, 2.0]];
                let t = [[0.0, -1.0, 0.0], [y, 0.0, x], [1.0, 1.0, 3.0]];
                let times = |m: &[[f64; 3]; 3], v: [f64; 3]| {
                    [0, 1, 2].map(|r| m[0][r] * v[0] + m[1][r] * v[1] + m[2][r] * v[2])
                };
                let before = |v: [f64; 3], m: &[[f64; 3]; 3]| m.map(|c| c[0] * v[0] + c[1] * v[1] + c[2] * v[2]);
                let p = [x, y, z];
                let (a, b) = (times(&m, p), before(p, &t));
                let mt = t.map(|column| times(&m, column));
                let c = times(&mt, [1.0, 0.0, z]);
                let q = [0, 1, 2].map(|i| a[i] + b[i] + 0.5 * c[i] + 2.0 * m[0][i] - t[0][i]);
                let det3 = |[a, b, c]: [[f64; 3]; 3]| {
                    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                        + a[2] * (b[0] * c[1] - b[1] * c[0])
                };
                let h = [0.5 * x - y, 0.5 * y - z];
                // Expanded by hand along the third row of the transposed matrix.
                let four = [[1.0, x, 0.0, 2.0], [0.0, 1.0, y, 0.0], [z, 0.0, 1.0, 0.0], [0.0, 3.0, 0.0, 1.0]];
                let minor = |skip: usize| {
                    [1, 2, 3].map(|r: usize| {
                        let row: Vec<f64> = (0..4).filter(|&c| c != skip).map(|c| four[r][c]).collect();
                        [row[0], row[1], row[2]]
                    })
                };
                let det4 = four[0][0] * det3(minor(0)) - four[0][1] * det3(minor(1)) + four[0][2] * det3(minor(2))
                    - four[0][3] * det3(minor(3));
                q[0] + 2.0 * q[1] - q[2] + det3(t) + h[0] * h[1] + det4
            },
        ),
        case(
            "integers",
            density(
                "let i = vec3<i32>(floor(p * 3.0));
                let checker = (i.x + i.y + i.z) & 1;
                let u = u32(max(p.z * 4.0, 0.0));
                var n = clamp(i.x, -1, 2);
                if checker == 1 { n = -n; }
                var s = 0.0;
                for (var k = 0; k < n + 2; k++) { s += p.y; }
                return f32(checker) + f32(i.y / 2) + 10.0 * f32(i.x % 3) + f32(u >> 1u) + f32(abs(i.z) + sign(n)) + s + f32(7 / 2 << 3u)
                    + f32(i.x * 3 - i.y != 2);",
            ),
            |[x, y, z]| {
                let [i, j, k] = [x, y, z].map(|c| (c * 3.0).floor() as i32);
                let checker = (i + j + k).rem_euclid(2);
                let n = if checker == 1 { -i.clamp(-1, 2) } else { i.clamp(-1, 2) };
                let u = (z * 4.0).max(0.0) as u32;
                let s = y * f64::from((n + 2).max(0));
                f64::from(checker + j / 2 + 10 * (i % 3) + (u >> 1) as i32 + k.abs() + n.signum() + 24) + s
                    + f64::from(u8::from(i * 3 - j != 2))
            },
        ),
        case(
            "booleans",
            density(
                "let near = p < vec3(0.5);
                let a = all(near) || (p.x > 1.0 && !(p.y > 0.0));
                var b = any(p.xy > vec2(1.0)) != a;
                b = b | (p.z > 1.5);
                let v = select(p, p.zxy, vec3<bool>(a, b, p.x == p.x));
                return v.x + 2.0 * v.y + 4.0 * v.z + f32(a) + f32(bool(p.x)) + f32(a & b);",
            ),
            |[x, y, z]| {
                let a = (x < 0.5 && y < 0.5 && z < 0.5) || (x > 1.0 && y <= 0.0);
                let b = ((x > 1.0 || y > 1.0) != a) || z > 1.5;
                let one = |b: bool| f64::from(u8::from(b));
                (if a { z } else { x }) + 2.0 * (if b { x } else { y }) + 4.0 * y + one(a) + 1.0 + one(a && b)
            },
        ),
        case(
            "a fractal that escapes",
            density(
                "var z = p; var dr = 1.0; var r = 0.0;
                for (var n: i32 = 0; n < 6; n++) {
                    r = length(z);
                    if r > 2.0 { break; }
                    dr = 2.0 * r * dr + 1.0;
                    z = vec3(z.x * z.x - z.y * z.y - z.z * z.z, 2.0 * z.x * z.y, -2.0 * z.x * z.z) + p * 0.5;
                }
                return r / dr;",
            ),
            |p| {
                let (mut z, mut dr, mut r) = (p, 1.0, 0.0);
                for _ in 0..6 {
                    r = length(z);
                    if r > 2.0 {
                        break;
                    }
                    dr = 2.0 * r * dr + 1.0;
                    let [x, y, w] = z;
                    z = [x * x - y * y - w * w + p[0] * 0.5, 2.0 * x * y + p[1] * 0.5, -2.0 * x * w + p[2] * 0.5];
                }
                r / dr
            },
        ),
        case(
            "switch in a loop, numbers that are the same everywhere",
            density(
                "var s = 0.0;
                var t = 0.1;
                for (var i = 0; t < 1.0; i++) {
                    t += 0.1;
                    switch i & 3 {
                        case 0: { continue; }
                        case 1: { s += p.x; }
                        case 2: { if p.y > t { break; } s += p.z * t; }
                        default: { if p.z > 1.0 { return s; } }
                    }
                    s *= 0.9;
                }
                return s + sqrt(16.0) * sin(0.5) + f32(u32(-1.5 + 3.0));",
            ),
            |[x, y, z]| {
                let (mut s, mut t, mut i) = (0.0, 0.1f32, 0);
                while t < 1.0 {
                    t += 0.1;
                    let case = i & 3;
                    i += 1;
                    match case {
                        0 => continue,
                        1 => s += x,
                        2 if y > f64::from(t) => {}
                        2 => s += z * f64::from(t),
                        _ if z > 1.0 => return s,
                        _ => {}
                    }
                    s *= 0.9;
                }
                s + 4.0 * 0.5f64.sin() + 1.0
            },
        ),
    ]
}

/// Random points, without those beside a jump of the reference.
fn points(reference: fn([f64; 3]) -> f64, count: usize) -> Vec<[f32; 3]> {
    let mut random = Random(5);
    let draw = |random: &mut Random| [0; 3].map(|_| random.unit() * 4.0 - 2.0);
    let is_smooth = |p: &[f32; 3]| {
        let p = p.map(f64::from);
        (0..6).all(|i| {
            let mut beside = p;
            beside[i / 2] += if i % 2 == 0 { 2e-5 } else { -2e-5 };
            (reference(beside) - reference(p)).abs() < 0.02
        })
    };
    std::iter::repeat_with(|| draw(&mut random)).filter(is_smooth).take(count).collect()
}

/// 2e-4 of the value and as much absolutely: what sums of some dozen roundings and the driver's sine need.
pub fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 2e-4 * (1.0 + b.abs())
}

#[test]
fn lowered_values_are_those_of_mathematics_and_of_the_text() {
    for Case { name, source, reference } in cases() {
        let lowered = field(&source);
        assert!(lowered.graph().is_some(), "{name}: {}", lowered.obstacle().expect("a reason"));
        let points = points(reference, 400);
        for &p in &points {
            let (found, wanted) = (f64::from(at(&lowered, p)), reference(p.map(f64::from)));
            assert!(close(found, wanted), "{name} at {p:?}: {found}, not {wanted}");
        }
        let Some(gpu) = common::gpu() else { continue };
        let written = on_gpu::values(gpu, &lowered.clone().as_written(), &points);
        let graph = on_gpu::values(gpu, &lowered, &points);
        for ((p, written), graph) in points.iter().zip(written).zip(graph) {
            let own = at(&lowered, *p);
            assert!(close(own.into(), written.into()), "{name} at {p:?}: {own}, the text gives {written}");
            assert!(close(own.into(), graph.into()), "{name} at {p:?}: {own}, on the GPU {graph}");
        }
    }
}

#[test]
fn lowered_bounds_hold_all_values() {
    let mut random = Random(8);
    for Case { name, source, .. } in cases() {
        let lowered = field(&source);
        assert!(lowered.graph().is_some(), "{name}: {}", lowered.obstacle().expect("a reason"));
        for _ in 0..60 {
            let size = 1.5 * random.unit() * random.unit();
            let low = [0; 3].map(|_| random.unit() * 3.0 - 2.0);
            let range = lowered.within(low.map(|l| Interval::new(l, l + size))).range;
            for _ in 0..20 {
                let p = low.map(|l| (l + size * random.unit()).min(l + size));
                let value = at(&lowered, p);
                assert!(range.contains(value), "{name} at {p:?}: {value} is not in {range:?}");
            }
        }
    }
    // A branch that is decided in the box is the whole.
    let half = field(&density("if p.x > 0.0 { return p.y; } return p.z / (p.x - p.x);"));
    let within = half.within([Interval::new(0.5, 1.0); 3]);
    assert!(within.range.is_bounded() && within.range.lo >= 0.49, "{:?}", within.range);
}

#[test]
fn lowered_gradients_are_exact() {
    let lowered = field(&density("if p.x > 0.0 { return p.x * p.y; } return length(p.yz);"));
    let mut out = [[0.0; 3]; 2];
    lowered
        .gradients(Points { x: &[2.0, -1.0], y: &[3.0, 3.0], z: &[4.0, 4.0] }, &mut out)
        .expect("a CPU form");
    assert_eq!(out[0], [3.0, 2.0, 0.0]);
    assert!((out[1][1] - 0.6).abs() < 1e-6 && (out[1][2] - 0.8).abs() < 1e-6 && out[1][0] == 0.0);
}
