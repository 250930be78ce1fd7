//! WGSL functions that are no expressions, or long ones, or made to do harm.

use super::wgsl::{close, density, field};
use super::{at, on_gpu};
use crate::common;
use isoforge::field::user::UserField;
use isoforge::field::{Field, NoForm, Points, Sense};
use std::time::{Duration, Instant};

#[test]
fn the_reason_for_a_black_box_is_told() {
    let cases = [
        (
            "var t = p.x;\n\nloop { t += 1.0; if t < -1e9 { break; } } return t;",
            "`loop` at line 3 has no known bound",
        ),
        ("var t = p.x;\nwhile t < 1.0 { t += 0.5; } return t;", "`while` at line 2 has no known bound"),
        (
            "var t = p.x;\nfor (var i = 0; i < 10; i++) {\n while t < 1.0 { t += 0.5; } } return t;",
            "`while` at line 3 has no known bound",
        ),
        ("var t = p.x;\nwhile true { t += 1.0; } return t;", "`while` at line 2 unrolls to more than 20000"),
        (
            "var t = p.x; for (var i = 0; i < 2000; i++) {\n for (var j = 0; j < 2000; j++) { t += p.y; } } return t;",
            "`for` at line 2 unrolls to more than 20000 operations",
        ),
        ("\nlet b = bitcast<u32>(p.x); return f32(b & 255u);", "`bitcast` at line 2"),
        ("let n = i32(p.x);\nreturn f32(n ^ 3);", "integer `^` at line 2"),
        (
            "let n = i32(p.x);\nreturn f32(n * n * n * 15731);",
            "integer `*`, whose result may be large, at line 2",
        ),
        // Integers that are chosen are computed with as f32, which holds none of these.
        (
            "let h = select(3735928559u, 305419896u, p.x > 0.0);\nreturn f32(h & 255u);",
            "an integer that varies and may be large at line 2",
        ),
        (
            "var s = 16777217; if p.x > 0.0 { s = 0; }\nreturn f32(s - 16777216);",
            "an integer that varies and may be large at line 2",
        ),
        (
            "let h = select(4294967295u, 0u, p.x > 0.0);\nreturn f32(i32(h));",
            "an integer that varies and may be large at line 2",
        ),
        (
            "let h = select(16777217u, 0u, p.x > 0.0);\nif h == 16777216u { return 1.0; } return p.x;",
            "an integer that varies and may be large at line 2",
        ),
        (
            "let h = array<u32, 4>(3735928559u, 1u, 2u, 3u);\nreturn f32(h[u32(p.x)] % 7u);",
            "an integer that varies and may be large at line 2",
        ),
        ("var a: array<f32, 4>;\na[i32(p.x)] = 1.0; return a[0];", "an element whose index varies at line 2"),
        ("return f32(frexp(p.x).exp);", "`frexp` at line 1"),
        ("return f32(\n  countOneBits(u32(p.x)));", "`countOneBits` at line 2"),
        ("return unpack4x8unorm(\n u32(p.x)).x;", "`unpack4x8unorm` at line 1"),
    ];
    for (body, reason) in cases {
        let source = format!("fn density(p: vec3<f32>) -> f32 {{{body} }}");
        let written = field(&source);
        let obstacle = written.obstacle().unwrap_or_else(|| panic!("{body} is lowered")).to_string();
        assert!(obstacle.contains(reason), "{body}: {obstacle}");
        assert!(written.graph().is_none());
        let points = Points { x: &[0.0], y: &[0.0], z: &[0.0] };
        assert_eq!(written.values(points, &mut [0.0]), Err(NoForm::Cpu));
        let text = written.wgsl().expect("a GPU form");
        assert!(text.gradient.is_none() && text.interval.is_none() && text.counts_loops);
    }
}

/// Large and deep functions end soon, in one form or the other.
#[test]
fn hostile_functions() {
    let start = Instant::now();
    let chain: String =
        (1..3000).map(|i| format!("fn g{i}(a: f32) -> f32 {{ return g{}(a) + 1.0; }}\n", i - 1)).collect();
    let deep = format!("fn g0(a: f32) -> f32 {{ return a; }}\n{chain}{}", density("return g2999(p.x);"));
    assert_eq!(at(&field(&deep), [1.0, 0.0, 0.0]), 3000.0);
    let twice: String = (1..60)
        .map(|i| format!("fn g{i}(a: f32) -> f32 {{ return g{0}(a) * g{0}(a + 1.0); }}\n", i - 1))
        .collect();
    let wide = format!("fn g0(a: f32) -> f32 {{ return a; }}\n{twice}{}", density("return g59(p.x);"));
    assert!(field(&wide).obstacle().is_some());
    let doubled = density(&format!("var a = p.x; {} return a;", "a = a * a - a;".repeat(5000)));
    assert!(field(&doubled).graph().is_some());
    let branches = "if a > b { a = a - 1.0; b = 2.0 * b; } else { b = b + a; }".repeat(2000);
    let forked = density(&format!("var a = p.x; var b = p.y; {branches} return a;"));
    assert!(field(&forked).graph().is_some());
    let arrays = format!(
        "var a: array<f32, 4096>; {} return a[7];",
        "if p.x > 0.0 { a[7] = p.y; } else { for (var i = 0; i < 4096; i++) { a[i] += p.x; } }".repeat(40)
    );
    assert!(field(&density(&arrays)).obstacle().is_some());
    assert!(field(&density("var a: array<f32, 100000000>; return a[7] + p.x;")).obstacle().is_some());
    let idle = "var i = 0; loop { i = i * 1; if i > 3 { break; } } return p.x;";
    assert!(field(&density(idle)).obstacle().is_some());
    let table = "var a: array<array<f32, 64>, 64>; var b: array<f32, 4096>;
        for (var i = 0; i < 64; i++) { for (var j = 0; j < 64; j++) { a[i][j] = f32(i * j); } }
        let k = u32(p.x) & 63u; for (var i = 0; i < 4096; i++) { b[i] = a[k][k]; } return b[7];";
    assert!(field(&density(table)).obstacle().is_some());
    let zeros = "var a: array<array<array<f32, 64>, 64>, 64>; let k = u32(p.x) & 63u; var sum = 0.0;
        for (var i = 0; i < 50000; i++) { sum += a[k][k][k]; } return sum;";
    assert!(field(&density(zeros)).obstacle().is_some());
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
}

/// Drivers do not take them, but expressions do.
#[test]
fn pointers_to_parts() {
    let grow = "fn grow(a: ptr<function, f32>, by: f32) { *a += by; }\n";
    let lowered = field(&format!(
        "{grow}{}",
        density("var q = array<f32, 2>(p.x, p.y); grow(&q[1], p.z); return q[1];")
    ));
    assert_eq!(at(&lowered, [1.0, 2.0, 3.0]), 5.0);
    assert!(lowered.wgsl().is_ok());
    assert_eq!(lowered.as_written().wgsl(), Err(NoForm::Gpu));
    let body =
        "var q = array<f32, 2>(p.x, p.y);\n grow(&q[1], p.z); while q[0] < 1.0 { q[0] += 1.0; } return q[1];";
    let found = UserField::new(&format!("{grow}{}", density(body)), "user.wgsl", Sense::Below);
    let error = found.expect_err("no driver takes it");
    assert!(error.line == 3 && error.message.contains("`var` of its own"), "{error}");
}

/// Long expressions are for the CPU: drivers would compile them for minutes.
#[test]
fn long_functions_run_as_written_on_a_gpu() {
    let long = |n: u32| {
        let body =
            "var t = 0.0; for (var i = 0; i < COUNT; i++) { t += abs(p.x * f32(i) - p.y) * 0.01; } return t;";
        field(&density(&body.replace("COUNT", &n.to_string())))
    };
    let [short, middle, long] = [20, 150, 1500].map(long);
    for field in [&short, &middle, &long] {
        assert!(field.graph().is_some() && field.obstacle().is_none());
    }
    assert!(middle.too_long_for_gpu().is_none() && long.too_long_for_gpu().is_some());
    let [short, middle, text] = [&short, &middle, &long].map(|f| f.wgsl().expect("a GPU form"));
    assert!(short.gradient.is_some() && short.interval.is_some());
    assert!(middle.gradient.is_some() && middle.interval.is_some());
    assert!(text.gradient.is_none() && text.interval.is_none() && text.counts_loops);
    let Some(gpu) = common::gpu() else { return };
    let points = [[0.5, 1.0, 0.0], [-0.25, 0.75, 2.0]];
    for (p, value) in points.iter().zip(on_gpu::values(gpu, &long, &points)) {
        assert!(close(at(&long, *p).into(), value.into()), "{value}");
    }
}
