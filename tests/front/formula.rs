//! Formulas: their values against an evaluator of this file, their faults, and texts of any kind.

use super::at;
use crate::common::Random;
use isoforge::field::Sense;
use isoforge::graph::GraphField;
use isoforge::graph::formula::{Fault, FormulaError, parse};
use proptest::prelude::*;
use std::time::{Duration, Instant};

fn given(parameters: &[(&str, f64)]) -> Vec<(String, f64)> {
    parameters.iter().map(|(name, value)| (name.to_string(), *value)).collect()
}

fn field(text: &str, parameters: &[(&str, f64)]) -> GraphField {
    let expr = parse(text, &given(parameters)).unwrap_or_else(|e| panic!("{e}"));
    GraphField::new(&expr, Sense::Below)
}

fn fault(text: &str) -> FormulaError {
    parse(text, &given(&[("radius", 1.0), ("R", 2.0)])).expect_err(text)
}

/// A constant beside a coordinate: Mesa would move it into the sum that gives the point.
#[test]
fn constants_stay_where_they_are() {
    let Some(extractor) = crate::common::extractor() else { return };
    let grid = isoforge::grid::Grid::from_bounds([20; 3], glam::Vec3::NEG_ONE, glam::Vec3::ONE).unwrap();
    for text in ["0 - max(x - 0.2, 0)", "min(0.1 + y, z - 0.7)", "(x + 0.3) * (z - 0.4) - y"] {
        let field = GraphField::new(&parse(text, &[]).unwrap(), Sense::Below);
        let source = isoforge::extract::Source::Field(&field, grid);
        let found =
            isoforge::compare::compare(extractor, &source, &isoforge::extract::Options::new(0.0)).unwrap();
        assert!(found.agrees(), "{text}\n{found}");
    }
}

#[test]
fn values_are_those_of_mathematics() {
    let p = [0.5, -1.25, 2.0];
    let (x, y, z) = (0.5f64, -1.25f64, 2.0f64);
    let r = 0.75f64;
    let cases: &[(&str, f64)] = &[
        ("sqrt(x^2+y^2+z^2) - r", (x * x + y * y + z * z).sqrt() - r),
        ("-x^2", -(x * x)),
        ("2^-x*4", 2f64.powf(-0.5) * 4.0),
        ("x^2^3", x.powi(8)),
        ("2^3^2*x", 512.0 * x),
        ("z^-2", 0.25),
        ("z^-2^2", 1.0 / 16.0),
        ("z^0.5", z.sqrt()),
        ("z^(3/2)", z.powf(1.5)),
        ("x - y - z", x - y - z),
        ("x / y / z", x / y / z),
        ("x - -y", x + y),
        ("+x * - y", -x * y),
        ("1e-3 + 2.5E2*x + .5 + 1.*y", 1e-3 + 125.0 + 0.5 + y),
        ("(x < 1) + 10*(x <= 0.5) + 100*(x > 0.5) + 1000*(x >= 0.5)", 1011.0),
        ("x + 1 < 2 * z", 1.0),
        ("min(x, y, z) + max(x, y, z)", y + z),
        ("min(x)", x),
        ("floor(y) + 10*ceil(y) + 100*round(y) + 1000*sign(y)", -2.0 - 10.0 - 100.0 - 1000.0),
        ("round(x) + 10*round(x+1) + 100*round(-x)", 20.0),
        ("mod(y, z)", 0.75),
        ("clamp(y, -1, 1) + clamp(z, -1, 1) + clamp(x, -1, 1)", 0.5),
        ("mix(x, z, 0.25)", 0.875),
        ("step(0.5, x) + step(0.6, x)", 1.0),
        ("smoothstep(0, 2, x)", 0.0625 * 2.5),
        ("select(x < 1, y, z) + if(x > 1, y, z)", y + z),
        ("length(x, y) - hypot(x, y) + length(x, y, z)", (x * x + y * y + z * z).sqrt()),
        ("square(abs(y))", y * y),
        ("sin(y) + cos(z*pi/3) * tau / e", y.sin() - 0.5 * std::f64::consts::TAU / std::f64::consts::E),
        ("x\n + y\t\r\n + r\n", x + y + r),
        ("λ_1*x", 0.5 * 7.0),
        ("z^0.3 + z^x + pow(z, y)", z.powf(0.3) + z.sqrt() + z.powf(y)),
        ("exp(y) + ln(z) + log2(z) + log10(z)", y.exp() + z.ln() + 1.0 + z.log10()),
        (
            "tan(y) + asin(x) + acos(x) + atan(y) + atan2(y, -x)",
            y.tan() + x.asin() + x.acos() + y.atan() + y.atan2(-x),
        ),
        ("sinh(y) + cosh(y) + tanh(y)", y.sinh() + y.cosh() + y.tanh()),
        ("trunc(y) + 10*fract(y)", 6.5),
    ];
    for (text, wanted) in cases {
        let parameters = given(&[("r", r), ("λ_1", 7.0)]);
        let expr = parse(text, &parameters).unwrap_or_else(|e| panic!("{e}"));
        let found = f64::from(at(&GraphField::new(&expr, Sense::Below), p));
        assert!((found - wanted).abs() <= 2e-6 * (1.0 + wanted.abs()), "{text}: {found}, not {wanted}");
    }
}

#[test]
fn parameters_can_be_set() {
    let mut sphere = field("length(x, y, z) - radius", &[("radius", 0.5)]);
    assert_eq!(at(&sphere, [2.0, 0.0, 0.0]), 1.5);
    sphere.set("radius", 1.0).expect("it has one");
    assert_eq!(at(&sphere, [2.0, 0.0, 0.0]), 1.0);
}

/// The byte of the fault, and words of its message.
#[test]
fn faults_show_the_place_and_the_remedy() {
    let cases: &[(&str, usize, &str)] = &[
        ("", 0, "empty"),
        ("  \n ", 4, "empty"),
        ("2x", 1, "`2*x`"),
        ("2 x", 2, "`2*x`"),
        ("x(y)", 0, "`x*(`"),
        ("(x)(y)", 3, "`)*(`"),
        ("1e", 1, "`1*e`"),
        ("x + r", 4, "did you mean `R`"),
        ("x + raduis", 4, "did you mean `radius`"),
        ("x + q", 4, "the parameters radius, R"),
        ("sqr(x)", 0, "did you mean `sqrt`"),
        ("lenght(x, y)", 0, "did you mean `length`"),
        ("flurb(x)", 0, "there are sqrt abs"),
        ("1 + sin", 4, "`sin(x)`"),
        ("sin()", 0, "takes 1"),
        ("clamp(x, 1)", 0, "2 arguments here: it takes 3"),
        ("min()", 0, "1 or more"),
        ("(x + y", 0, "not closed"),
        ("1 + sin(x", 4, "not closed"),
        ("x + y)", 5, "closes nothing"),
        ("x, y", 1, "no function's arguments"),
        ("(1,5)", 2, "as in 0.5"),
        ("x +", 3, "before the end"),
        ("x + * y", 4, "before `*`"),
        ("min(x, )", 7, "before `)`"),
        ("()", 1, "before `)`"),
        ("0 < x < 1", 6, "chained"),
        ("x = 1", 2, "compare"),
        ("x ** 2", 2, "`^`"),
        ("|x|", 0, "abs"),
        ("x²", 1, "`^2`"),
        ("x # y", 2, "`#`"),
        ("x + 1.2.3", 7, "operator"),
        ("1e999", 0, "finite"),
        ("x / 0", 2, "inf"),
        ("x / (1 - 1)", 2, "inf"),
        ("0 / 0 + x", 2, "NaN"),
        ("(-8)^0.5", 4, "NaN"),
        (".", 0, "no finite number"),
    ];
    for (text, place, words) in cases {
        let error = fault(text);
        let shown = error.to_string();
        assert_eq!(error.at, *place, "{text}: {shown}");
        assert!(shown.contains(words), "{text}: {shown}");
    }
    let shown = fault("x +\n  3*lenght(x, y)").to_string();
    assert!(shown.ends_with("\n    3*lenght(x, y)\n      ^"), "{shown}");
    let reserved = parse("x + e", &given(&[("e", 1.0)])).expect_err("a name of ours").fault;
    assert!(matches!(reserved, Fault::Reserved { .. }));
    let infinite = parse("x + r", &given(&[("r", f64::NAN)])).expect_err("no number").fault;
    assert!(matches!(infinite, Fault::Parameter { .. }));
}

/// Deep and long texts, within a time that only a linear way takes.
#[test]
fn deep_texts() {
    let start = Instant::now();
    let nested = "(".repeat(100_000) + "x" + &")".repeat(100_000);
    assert_eq!(at(&field(&nested, &[]), [3.0, 0.0, 0.0]), 3.0);
    let calls = "abs(".repeat(50_000) + "x" + &")".repeat(50_000);
    assert_eq!(at(&field(&calls, &[]), [-3.0, 0.0, 0.0]), 3.0);
    assert_eq!(at(&field(&("-".repeat(100_001) + "x"), &[]), [3.0, 0.0, 0.0]), -3.0);
    let sum = format!("x{}", " + y*1".repeat(100_000));
    assert_eq!(at(&field(&sum, &[]), [3.0, 0.0, 0.0]), 3.0);
    assert_eq!(at(&field(&("x".to_string() + &"^1".repeat(100_000)), &[]), [3.0, 0.0, 0.0]), 3.0);
    assert_eq!(at(&field(&format!("min({})", vec!["x"; 100_000].join(",")), &[]), [2.0, 0.0, 0.0]), 2.0);
    let open = fault(&"(".repeat(100_000));
    assert!(matches!(open.fault, Fault::NoValue { .. }) && open.to_string().len() < 400);
    assert!(fault(&"q".repeat(1_000_000)).to_string().len() < 600);
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(text in "\\PC{0,60}") {
        if let Err(error) = parse(&text, &[]) {
            let _ = error.to_string();
        }
    }

    #[test]
    fn any_words_are_read_or_refused(
        words in prop::collection::vec(prop::sample::select(vec![
            "x", "y", "r", "1", "2.5e-3", ".", "(", ")", ",", "+", "-", "*", "/", "^", "<", ">=", "sin(", "min(", "if(",
            "pi", "\n", " ", "²", "q",
        ]), 0..40),
    ) {
        let text = words.concat();
        match parse(&text, &given(&[("r", 0.5)])) {
            Ok(expr) => { at(&GraphField::new(&expr, Sense::Below), [0.1, 0.2, 0.3]); }
            Err(error) => { prop_assert!(error.at <= text.len() && error.to_string().contains('^')); }
        }
    }
}

/// A random expression: its text, and how tight its outermost operator binds.
struct Node {
    text: String,
    binds: u8,
    value: Bounded,
}

/// A value, and how far `f32` arithmetic may be from it; none where a comparison is too close to tell.
type Bounded = Option<(f64, f64)>;

const UNIT: f64 = 1.2e-7;

fn within(node: &Node, binds: u8) -> String {
    if node.binds < binds { format!("({})", node.text) } else { node.text.clone() }
}

fn random(r: &mut Random, depth: u32, point: [f64; 3]) -> Node {
    if depth == 0 {
        let (text, value) = match r.next() % 5 {
            n @ 0..3 => (["x", "y", "z"][n as usize].to_string(), point[n as usize]),
            3 => ("r".into(), 0.625),
            _ => {
                let value = (r.next() % 64) as f64 / 16.0;
                (format!("{value}"), value)
            }
        };
        return Node { text, binds: 9, value: Some((value, value.abs() * UNIT)) };
    }
    let inner = |r: &mut Random| {
        let depth = r.next() as u32 % depth;
        random(r, depth, point)
    };
    let (a, b) = (inner(r), inner(r));
    let both = a.value.zip(b.value);
    let rounded = |(v, e): (f64, f64)| (v, e + v.abs() * UNIT + 1e-30);
    let one = |f: &dyn Fn(f64, f64) -> (f64, f64)| a.value.map(|(a, e)| rounded(f(a, e)));
    let two = |f: &dyn Fn((f64, f64), (f64, f64)) -> (f64, f64)| both.map(|(a, b)| rounded(f(a, b)));
    let far = |(a, ea): (f64, f64), (b, eb): (f64, f64)| (a - b).abs() > 4.0 * (ea + eb);
    let call = |name: &str| format!("{name}({}, {})", a.text, b.text);
    let (text, binds, value) = match r.next() % 13 {
        0 => (format!("{} + {}", within(&a, 2), within(&b, 3)), 2, two(&|a, b| (a.0 + b.0, a.1 + b.1))),
        1 => (format!("{}-{}", within(&a, 2), within(&b, 3)), 2, two(&|a, b| (a.0 - b.0, a.1 + b.1))),
        2 => (
            format!("{}*{}", within(&a, 3), within(&b, 4)),
            3,
            two(&|a, b| (a.0 * b.0, a.0.abs() * b.1 + b.0.abs() * a.1 + a.1 * b.1)),
        ),
        3 => (
            format!("{} / (1 + square({}))", within(&a, 3), b.text),
            3,
            two(&|a, b| {
                let by = 1.0 + b.0 * b.0;
                let error = (2.0 * b.0.abs() + b.1) * b.1 + 2.0 * by * UNIT;
                (a.0 / by, a.1 + (a.0.abs() + a.1) * error)
            }),
        ),
        4 => (format!("-{}", within(&a, 4)), 4, a.value.map(|(v, e)| (-v, e))),
        5 => (
            format!("{}^3", within(&a, 6)),
            5,
            one(&|a, e| (a.powi(3), 3.0 * (a.abs() + e).powi(2) * e + a.abs().powi(3) * UNIT)),
        ),
        6 => (format!("sqrt(1 + abs({}))", a.text), 9, one(&|a, e| ((1.0 + a.abs()).sqrt(), e))),
        7 => (format!("sin({})", a.text), 9, one(&|a, e| (a.sin(), e + 3e-6 + a.abs() * 3.0 * UNIT))),
        8 => (call("min"), 9, two(&|a, b| (a.0.min(b.0), a.1.max(b.1)))),
        9 => (call("max"), 9, two(&|a, b| (a.0.max(b.0), a.1.max(b.1)))),
        10 => {
            let value = both.filter(|(a, b)| far(*a, *b)).map(|(a, b)| (f64::from(u8::from(a.0 < b.0)), 0.0));
            (format!("{} < {}", within(&a, 2), within(&b, 2)), 1, value)
        }
        11 => {
            let value = both.filter(|(a, b)| far(*a, *b)).map(|(a, b)| if a.0 >= b.0 { a } else { b });
            (format!("if({} >= {}, {}, {})", within(&a, 2), within(&b, 2), a.text, b.text), 9, value)
        }
        _ => {
            let value = a.value.filter(|(a, e)| (a - a.round()).abs() > 4.0 * e);
            (format!("floor({})", a.text), 9, value.map(|(a, _)| (a.floor(), 0.0)))
        }
    };
    Node { text, binds, value }
}

#[test]
fn random_formulas_agree_with_this_evaluator() {
    let mut r = Random(11);
    let mut compared = 0;
    for _ in 0..4000 {
        let point = [0; 3].map(|_| r.unit() * 4.0 - 2.0);
        let depth = 1 + r.next() as u32 % 7;
        let node = random(&mut r, depth, point.map(f64::from));
        let parsed = parse(&node.text, &given(&[("r", 0.625)]));
        let expr = match parsed {
            Err(FormulaError { fault: Fault::NotFinite { .. }, .. }) => continue,
            found => found.unwrap_or_else(|e| panic!("{}\n{e}", node.text)),
        };
        let found = f64::from(at(&GraphField::new(&expr, Sense::Below), point));
        if let Some((value, error)) = node.value.filter(|(v, e)| v.abs() < 1e30 && e.is_finite()) {
            assert!(
                (found - value).abs() <= 4.0 * error + 1e-6,
                "{} at {point:?}: {found}, not {value} ± {error}",
                node.text
            );
            compared += 1;
        }
    }
    assert!(compared > 3000, "{compared} compared");
}
