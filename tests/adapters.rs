//! Every adapter of this machine, each stage against its twin: drivers differ in denormals, contraction,
//! limits and workgroup order. To see two software drivers, name both in `VK_DRIVER_FILES`.

mod common;

use glam::Vec3;
use isoforge::compare::compare;
use isoforge::extract::{Extractor, Options, Source};
use isoforge::field::user::UserField;
use isoforge::field::{Sense, named};
use isoforge::gpu::{Gpu, adapters};
use isoforge::grid::Grid;

/// Five powers whose exponents are parameters: SwiftShader (Subzero) takes minutes to compile the gradient.
const SLOW_ON_SWIFTSHADER: [&str; 3] = ["superellipsoid", "superhyperboloid", "supertorus"];

#[test]
fn every_adapter_agrees_with_the_twins() {
    if !common::wants_gpu() {
        return;
    }
    let adapters = adapters();
    assert!(!adapters.is_empty(), "GPU tests need an adapter; ISOFORGE_TESTS=cpu leaves them out");
    let grid = Grid::from_bounds([32, 31, 33], -Vec3::ONE, Vec3::ONE).unwrap();
    let noise = common::noise(grid, 3);
    // Samples and steps between them too small for a normal number.
    let tiny = common::sampled(grid, |p| (p.length() - 0.7) * 1e-41);
    let small = common::sampled(grid, |p| (p.length() - 0.7) * 1e-36);
    let smallish = common::sampled(grid, |p| (p.length() - 0.7) * 1e-31);
    let brain = common::small_brain();
    let source = "fn density(p: vec3<f32>) -> f32 {
        var s = 0.0;
        for (var i = 0; i < 5; i++) { s += abs(fract(p.x * f32(i)) - p.y) * p.z; }
        return s;
    }";
    let user = UserField::new(source, "user.wgsl", Sense::Below).unwrap();
    let written = user.clone().as_written();

    let mut wrong = Vec::new();
    for adapter in adapters {
        let gpu = Gpu::open_adapter(&adapter).unwrap();
        println!("{} ({}, {:?})", gpu.info.name, gpu.info.driver_info, gpu.info.backend);
        let name = gpu.info.name.clone();
        let extractor = Extractor::new(gpu).unwrap();
        let mut check = |what: &str, source: Source<'_>, iso: f32| {
            let found = compare(&extractor, &source, &Options::new(iso)).unwrap();
            if !found.agrees() {
                wrong.push(format!("{name}, {what}:\n{found}"));
            }
        };
        for definition in named::ALL {
            if name.contains("SwiftShader") && SLOW_ON_SWIFTSHADER.contains(&definition.name) {
                println!("{name}: {} is left out", definition.name);
                continue;
            }
            let (field, grid) = common::named(definition.name, 32);
            check(definition.name, Source::Field(&field, grid), definition.iso);
        }
        check("a user's field", Source::Field(&user, grid), 0.3);
        check("a user's field as it is written", Source::Field(&written, grid), 0.3);
        check("noise", Source::Volume(&noise), 0.0);
        check("small samples", Source::Volume(&small), 0.0);
        check("less small samples", Source::Volume(&smallish), 0.0);
        check("small samples at another iso", Source::Volume(&small), 3.2e-38);
        check("denormal samples", Source::Volume(&tiny), 0.0);
        check("brain", Source::Volume(&brain), 10.0);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
