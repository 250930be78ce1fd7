//! The caller's own device: what it must have, its loss, and wrong calls.

use super::{bytes, on_cpu, read};
use crate::common;
use isoforge::extract::{ExtractError, Extractor, Method, Options, Source};
use isoforge::field::{Closure, Field, NoForm, Points, Sense, Wgsl, user::UserField};
use isoforge::gpu::{Gpu, GpuError, GpuMesh, adapters};
use isoforge::graph::{Expr, GraphField, x};
use isoforge::grid::Grid;
use wgpu::BufferUsages as U;

/// The limits that are asked for are enough. Goes red when a kernel takes more.
#[test]
fn the_required_limits_are_enough() {
    let Some(gpu) = common::own_device(|_| Gpu::required_limits()) else { return };
    let extractor = Extractor::new(gpu).unwrap();
    let (torus, grid) = common::named("torus", 20);
    let volume = common::small_brain();
    for (source, iso) in [(Source::Field(&torus, grid), 0.0), (Source::Volume(&volume), 10.0)] {
        for method in Method::ALL {
            let options = Options { method, ..Options::new(iso) };
            let found = read(&extractor, &extractor.extract(&source, &options).unwrap());
            let twin = on_cpu(&source, &options);
            assert_eq!(found.triangles, twin.triangles);
            assert!(!extractor.gpu().is_software() || bytes(&found) == bytes(&twin));
        }
    }
}

/// Each limit that is too low is named before anything is compiled, with what to do. (With 64 workgroups a dimension
/// there was an empty mesh.)
#[test]
fn limits_that_are_too_low() {
    type Lower = fn(wgpu::Limits) -> wgpu::Limits;
    let cases: [(&str, Lower); 6] = [
        ("max_storage_buffers_per_shader_stage", |_| wgpu::Limits::downlevel_defaults()),
        ("max_uniform_buffer_binding_size", |l| wgpu::Limits { max_uniform_buffer_binding_size: 1024, ..l }),
        ("max_compute_workgroups_per_dimension", |l| wgpu::Limits {
            max_compute_workgroups_per_dimension: 64,
            ..l
        }),
        ("max_compute_workgroup_storage_size", |l| wgpu::Limits {
            max_compute_workgroup_storage_size: 1024,
            ..l
        }),
        ("max_compute_invocations_per_workgroup", |l| wgpu::Limits {
            max_compute_invocations_per_workgroup: 64,
            ..l
        }),
        ("max_compute_workgroup_size_x", |l| wgpu::Limits { max_compute_workgroup_size_x: 64, ..l }),
    ];
    for (name, lower) in cases {
        let Some(gpu) = common::own_device(lower) else { return };
        let error = Extractor::new(gpu).err().unwrap();
        let ExtractError::Gpu(GpuError::Limits { name: found, has, needs }) = &error else {
            panic!("{error:?}")
        };
        assert!(*found == name && has < needs, "{error}");
        assert!(error.to_string().contains("Gpu::required_limits()"), "{error}");
    }
}

/// Goes red (the first hears nothing) when each `Gpu` of a device sets the callback for itself.
#[test]
fn every_handle_of_a_device_hears_of_its_loss() {
    let Some(first) = common::own_device(|all| all) else { return };
    let second = Gpu::from_device(first.device.clone(), first.queue.clone(), first.info.clone());
    assert!(first.check().is_ok() && second.check().is_ok());
    first.device.destroy();
    assert!(matches!(first.wait(), Err(GpuError::Lost(_))));
    assert!(matches!(second.wait(), Err(GpuError::Lost(_))));
    // Other devices are not, and who has a callback of their own says so.
    let Some(other) = common::own_device(|all| all) else { return };
    assert!(other.wait().is_ok());
    let told = other.clone();
    other.device.set_device_lost_callback(move |_, _| told.note_lost("the cable"));
    other.device.destroy();
    assert!(matches!(other.wait(), Err(GpuError::Lost(why)) if why == "the cable"));
}

/// A device is dropped with the last that holds it: nothing of the crate keeps it.
#[test]
fn devices_are_let_go() {
    let Some(gpu) = common::own_device(|all| all) else { return };
    let flag = std::sync::Arc::new(());
    let held = flag.clone();
    gpu.device.on_uncaptured_error(std::sync::Arc::new(move |_| drop(held.clone())));
    assert_eq!(std::sync::Arc::strong_count(&flag), 2);
    drop(gpu);
    assert_eq!(std::sync::Arc::strong_count(&flag), 1);
}

/// Goes red when the parameters are counted after compiling: the compiler refuses the places that there are not.
#[test]
fn too_many_parameters() {
    let Some(extractor) = common::extractor() else { return };
    let grid = common::named("sphere", 4).1;
    let sum = (0..4100).map(|i| Expr::parameter(&format!("p{i}"), 0.0) * x()).reduce(|a, b| a + b).unwrap();
    let field = GraphField::new(&sum, Sense::Below);
    let source = Source::Field(&field, grid);
    let found = extractor.extract(&source, &Options::new(0.0));
    assert!(matches!(found, Err(ExtractError::TooManyParameters { given: 4100 })), "{found:?}");
    let found = extractor.prepare(&source, u64::MAX);
    assert!(matches!(found, Err(ExtractError::TooManyParameters { given: 4100 })));
}

#[test]
fn wrong_calls_are_said_to_be_wrong() {
    let Some(gpu) = common::gpu() else { return };
    let buffer = gpu.buffer("a test's", 64, U::COPY_SRC | U::COPY_DST).unwrap();
    for count in [u64::MAX, u64::MAX / 2, 1 << 40, 65] {
        let found = gpu.read::<u8>(&buffer, count);
        assert!(matches!(found, Err(GpuError::Range { has: 64, .. })), "{count}: {found:?}");
    }
    assert!(matches!(
        gpu.read::<[u32; 4]>(&buffer, u64::MAX / 8),
        Err(GpuError::Range { needed: u64::MAX, .. })
    ));
    gpu.write(&buffer, &[7; 64]).unwrap();
    assert_eq!(gpu.read::<u8>(&buffer, 63).unwrap(), [7; 63]);
    assert!(matches!(gpu.write(&buffer, &[0; 3]), Err(GpuError::Unaligned(3))));
    assert!(matches!(gpu.write(&buffer, &[0; 68]), Err(GpuError::Range { needed: 68, has: 64, .. })));
    // What belongs to another device.
    let adapter = adapters().into_iter().next().unwrap();
    let [one, other] = [(); 2].map(|()| Gpu::open_adapter(&adapter).unwrap());
    let mesh = GpuMesh::with_capacity(&other, 3, 1).unwrap();
    let error = mesh.read(&one).unwrap_err();
    assert!(error.to_string().contains("not of its device"), "{error}");
    // Room for more than there is.
    let error = GpuMesh::with_capacity(gpu, u32::MAX, u32::MAX).unwrap_err();
    assert!(error.to_string().contains("a mesh of less capacity"), "{error}");
}

/// A field of the caller's own, as WGSL alone.
#[derive(Debug)]
struct Own(&'static str);

impl Field for Own {
    fn sense(&self) -> Sense {
        Sense::Below
    }

    fn values(&self, _: Points<'_>, _: &mut [f32]) -> Result<(), NoForm> {
        Err(NoForm::Cpu)
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        Ok(Wgsl {
            value: self.0.into(),
            gradient: None,
            interval: None,
            planes: None,
            data: Default::default(),
            parameters: Vec::new(),
            counts_loops: false,
        })
    }
}

/// Goes red when they are said to be a defect of the crate.
#[test]
fn own_wgsl_that_does_not_compile() {
    let Some(extractor) = common::extractor() else { return };
    let grid = common::named("sphere", 4).1;
    let cases = [
        ("fn density(p: vec3<f32>) -> f32 { return lenght(p); }", "lenght"),
        ("fn density(p: vec3<f32>) -> f32 { return p; }", "return"),
        (
            "fn iso_exp(p: f32) -> f32 { return p; } fn density(p: vec3<f32>) -> f32 { return p.x; }",
            "iso_exp",
        ),
        ("fn other(p: vec3<f32>) -> f32 { return p.x; }", "density"),
    ];
    for (text, why) in cases {
        let error = extractor.extract(&Source::Field(&Own(text), grid), &Options::new(0.5)).unwrap_err();
        let ExtractError::Gpu(GpuError::FieldWgsl(told)) = &error else { panic!("{error:?}") };
        assert!(told.contains(why) && !error.to_string().contains("defect"), "{error}");
    }
    let right = Own("fn density(p: vec3<f32>) -> f32 { return length(p); }");
    assert!(extractor.extract(&Source::Field(&right, grid), &Options::new(0.5)).is_ok());
}

/// The texts of the library name the library, not the program's flags.
#[test]
fn remedies_are_the_library_s() {
    let grid = Grid::from_bounds([8; 3], glam::Vec3::NEG_ONE, glam::Vec3::ONE).unwrap();
    let closure = Closure::new(Sense::Below, |p: glam::Vec3| p.x);
    let loops = "fn density(p: vec3<f32>) -> f32 { var t = p.x; while t < 0.0 { t += 1.0; } return t; }";
    let loops = UserField::new(loops, "loops", Sense::Below).unwrap();
    let small = Options { memory_budget: 1, ..Options::new(0.0) };
    let cpu = |field: &dyn Field, options| {
        isoforge::extract::extract_on_cpu(&Source::Field(field, grid), options, &|_| {})
            .unwrap_err()
            .to_string()
    };
    let mut texts = vec![
        (cpu(&loops, &Options::new(0.0)), "`Extractor`"),
        (cpu(&closure, &small), "`Options::memory_budget`"),
    ];
    if let Some(extractor) = common::extractor() {
        let error = extractor.extract(&Source::Field(&closure, grid), &Options::new(0.0)).unwrap_err();
        texts.push((error.to_string(), "`Closure::with_wgsl`"));
    }
    for (text, remedy) in texts {
        assert!(text.contains(remedy) && !text.contains("--"), "{text}");
    }
}

/// Goes red when another type's name is all that is said.
#[test]
fn only_f32() {
    for source in [
        "fn density(p: vec3<f32>) -> f64 { return f64(p.x); }",
        "fn density(p: vec3<f32>) -> f32 { let a = f64(p.x); return f32(a); }",
        "enable f16;\nfn density(p: vec3<f32>) -> f32 { return f32(f16(p.x)); }",
        "fn density(p: vec3<f32>) -> f32 { return f32(f16(p.x)); }",
    ] {
        let error = UserField::new(source, "a.wgsl", Sense::Below).unwrap_err();
        assert!(error.message.contains("only floats are `f32`"), "{error}");
    }
}
