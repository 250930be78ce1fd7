use super::super::kernel::parse_exact;
use super::super::settings::for_device;
use super::*;
use crate::field::differences::Normals;
use crate::field::{Field, Sense};
use crate::gpu::Form;
use crate::graph::shapes::{sphere, torus_distance};
use crate::graph::{Expr, GraphField, x, y};
use crate::stage::method::{Method, Placement};
use crate::stage::shaders::{self, Samples};
use crate::volume::Scalar;

/// What is computed of floats, and not by a function of [`functions`], that a driver may round in a way of its own.
fn left_to_the_driver(module: &Module, info: &ModuleInfo) -> Vec<String> {
    let functions = module.functions.iter().map(|(handle, f)| (f, &info[handle]));
    let entries = module.entry_points.iter().enumerate().map(|(i, e)| (&e.function, info.get_entry_point(i)));
    let is_own = |f: &Function| f.name.as_ref().is_some_and(|n| NAMES.iter().any(|own| n.starts_with(own)));
    let mut found = Vec::new();
    for (function, info) in functions.chain(entries).filter(|(f, _)| !is_own(f)) {
        for (handle, expression) in function.expressions.iter() {
            let is_float = info[handle].ty.inner_with(&module.types).scalar_kind() == Some(ScalarKind::Float);
            use {BinaryOperator as B, MathFunction as M};
            let is_exact = match expression {
                Expression::Binary { op, .. } => {
                    !matches!(op, B::Add | B::Subtract | B::Multiply | B::Divide | B::Modulo)
                }
                Expression::Math { fun, .. } => {
                    matches!(fun, M::Abs | M::Min | M::Max | M::Clamp | M::Floor | M::Ceil | M::Sign)
                }
                _ => true,
            };
            if is_float && !is_exact {
                found.push(format!("{:?}: {expression:?}", function.name));
            }
        }
    }
    found
}

/// Every kernel that computes with floats, of each form.
fn kernels() -> Vec<String> {
    let surfaces = [
        sphere(1.0).union(torus_distance(1.0, 0.3)),
        (x() * 3.0).sin() / (y() + 4.0).sqrt(),
        Expr::noise(7) + x(),
    ];
    let mut kernels = vec![shaders::normals()];
    for surface in surfaces {
        let field = GraphField::new(&surface, Sense::Below);
        let wgsl = field.wgsl().unwrap();
        kernels.extend([
            shaders::sample(&wgsl),
            shaders::bounds(&wgsl).unwrap(),
            shaders::refine_place(&wgsl),
        ]);
        for form in Form::ALL {
            kernels.extend(shaders::sample_planes(&wgsl, form));
            if shaders::classify_samples(&wgsl, Method::MarchingCubes, form) {
                kernels.extend(
                    [false, true].map(|by_planes| shaders::classify_sampling(&wgsl, form, by_planes)),
                );
            }
            for method in Method::ALL {
                for samples in
                    [Samples::Field(&wgsl), Samples::Volume(Scalar::U8), Samples::Volume(Scalar::F32)]
                {
                    kernels.push(shaders::classify(samples, method, form));
                    for placement in [Placement::Linear, Placement::Snapped { epsilon: 1e-3 }] {
                        for normals in [Normals::Exact, Normals::Forward { delta: None }] {
                            kernels.push(shaders::emit(samples, method, placement, normals, form));
                        }
                    }
                }
            }
        }
    }
    kernels.extend([
        shaders::refine_start(),
        shaders::refine_marks(),
        shaders::refine_tasks(),
        shaders::refine_cut(),
    ]);
    kernels
}

/// Operations of all widths, in every kind of block.
const EVERYWHERE: &str = "struct Params {
    nothing: u32,
}
@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(12) var<storage, read_write> samples: array<f32>;

fn two(a: vec2<f32>, b: f32) -> vec2<f32> { return sqrt(a * b + a) / (b * a - a); }

@compute @workgroup_size(1)
fn main() {
    var a = samples[0] * samples[1] + 1.0;
    { a *= a; }
    if a > 3.0 { a += 0.5; } else { a -= a * a; }
    switch i32(a) { case 1: { a /= 3.0; } default: { a = sqrt(a); } }
    loop {
        a += 0.1;
        if a > 100.0 { break; }
        continuing { a *= 1.5; break if a * a > 50.0; }
    }
    let v = vec4(two(vec2(a), a), a + a, a) * vec4(a) / a;
    let w = 2.0 * vec3(a) - v.xyz;
    samples[0] = v.w + w.x;
}
";

/// Goes red when a kind of block, or an operation, is left out in `hide_operations`.
#[test]
fn nothing_is_left_to_the_driver() {
    for source in kernels().into_iter().chain([EVERYWHERE.into()]) {
        let source = for_device(&source, true);
        let (module, info) = parse_exact(&source, false).unwrap();
        let left = left_to_the_driver(&module, &info);
        assert!(left.is_empty(), "{left:#?}");
    }
}
