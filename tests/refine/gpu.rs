//! On the GPU: the bytes of the CPU's refiner.

use crate::common::{self, Random, named, small_brain};
use crate::tools::*;
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::user::UserField;
use isoforge::field::{Closure, Field, NoForm, Points, Sense, Surface, Wgsl};
use isoforge::gpu::GpuMesh;
use isoforge::graph::blobs::{Blobs, Component, Kernel};
use isoforge::graph::volume::{Gradient, Interpolation, Lookup, VolumeLeaf};
use isoforge::graph::{Expr, GraphField, shapes::*};
use isoforge::mesh::{Mesh, Vertex};
use isoforge::refine::{RefineError, RefineReport, Settings, refine};
use std::sync::Arc;

/// Both, if there is a GPU: on a software adapter all bytes and all counts must agree, else about.
fn both(name: &str, surface: &Surface<'_>, mesh: &Mesh, settings: &Settings) -> Option<RefineReport> {
    let extractor = common::extractor()?;
    let gpu = extractor.gpu();
    let (wanted, of_cpu) = refine(surface, mesh, settings, &|_| {}).expect("a mesh");
    let given = GpuMesh::upload(gpu, mesh).expect("a mesh");
    let (found, of_gpu) = extractor.refine(surface, &given, settings, &|_| {}).expect("a mesh");
    let found = found.read(gpu).expect("a mesh");
    if !gpu.is_software() {
        let apart = wanted.triangles.len().abs_diff(found.triangles.len());
        assert!(apart <= 4 + wanted.triangles.len() / 100, "{name}: {apart} triangles apart");
        return Some(of_gpu);
    }
    let untimed = |report: &RefineReport| RefineReport { seconds: 0.0, ..report.clone() };
    assert_eq!(untimed(&of_gpu), untimed(&of_cpu), "{name}");
    if wanted.triangles.is_empty() {
        // Reading gives no vertices then.
        assert!(found.triangles.is_empty(), "{name}");
        return Some(of_gpu);
    }
    let first = found.vertices.iter().zip(&wanted.vertices).position(|(a, b)| bytes(a) != bytes(b));
    assert_eq!(first.map(|i| (i, found.vertices[i], wanted.vertices[i])), None, "{name}: the first vertex");
    let first = found.triangles.iter().zip(&wanted.triangles).position(|(a, b)| a != b);
    assert_eq!(
        first.map(|i| (i, found.triangles[i], wanted.triangles[i])),
        None,
        "{name}: the first triangle"
    );
    assert_eq!(found.vertices.len(), wanted.vertices.len(), "{name}");
    assert_eq!(found.triangles.len(), wanted.triangles.len(), "{name}");
    assert_eq!(given.read(gpu).expect("a mesh"), *mesh, "{name}: what was given stays as it is");
    Some(of_gpu)
}

fn bytes(vertex: &isoforge::mesh::Vertex) -> &[u8] {
    bytemuck::bytes_of(vertex)
}

/// Goes red when `sort_fans` sorts the other way, when of equal edges `longer` takes the higher number (marks.wgsl), and
/// when a face of the border holds nothing (tasks.wgsl).
#[test]
fn named_fields() {
    for (name, n) in [("torus", 24), ("gyroid", 24), ("sphere", 5), ("cube", 9), ("octahedron", 16)] {
        let (field, grid) = named(name, n);
        let s = start(&field, field.definition().iso, grid);
        for (flatness, depth) in [(0.8, 3), (0.95, 4), (0.999, 3), (1.0, 2), (0.95, 0)] {
            let settings = Settings { flatness, depth, ..s.settings };
            both(&format!("{name}, {flatness}, {depth}"), &s.surface, &s.mesh, &settings);
        }
    }
}

/// Sharp seams, thin sheets, stretched solids, blobs; small and large steps, ε of any size.
/// Goes red when `is_flat` looks at one plane alone, when `close` stops short (marks.wgsl), without `towards_crease` and its
/// limit along the edge (tasks.wgsl), when a search goes beyond its ball, never bisects or takes longer steps than it may
/// (search.wgsl), when not the farthest midpoint is taken back, when a quadrilateral is cut along the other diagonal or a
/// part wound the other way round (cut.wgsl), and where sums and products are left to the driver (src/gpu/exact.rs).
#[test]
fn solids() {
    let fields = [
        ("kugeldiff", graph(&kugeldiff())),
        ("figure", graph(&figure())),
        ("cube", graph(&box_([-0.7; 3], [0.7; 3]).rotate([0.3, 1.0, 0.2], 0.11).unwrap())),
        ("shell", graph(&sphere(1.0).difference(sphere(0.95)))),
        ("steep", graph(&(kugeldiff() * f64::exp2(98.0)))),
        ("flat", graph(&(kugeldiff() * f64::exp2(-98.0)))),
    ];
    for (name, field) in &fields {
        let s = start(field, 0.0, cube(24, 1.5));
        for (flatness, epsilon, step, depth) in [
            (0.95, 1e-4, None, 4),
            (0.9, 1e-6, None, 2),
            (0.99, 1e-2, Some(0.01), 2),
            (0.95, f32::MIN_POSITIVE, Some(1e-3), 1),
            (-0.5, 1e-3, None, 3),
        ] {
            let settings = Settings { flatness, epsilon, step, depth, ..s.settings };
            both(&format!("{name}, {flatness}, {epsilon}, {step:?}"), &s.surface, &s.mesh, &settings);
        }
        // Without a border, an open one moves.
        both(&format!("{name}, no border"), &s.surface, &s.mesh, &Settings { border: None, ..s.settings });
    }
}

/// Random solids, of whose vertices some do not converge and some are taken back.
#[test]
fn random_solids() {
    let mut random = Random(11);
    let (mut taken_back, mut not_converged, mut for_shape) = (0, 0, 0);
    for i in 0..8 {
        let mut place = || [0; 3].map(|_| f64::from(random.unit()) * 1.2 - 0.6);
        let parts: Vec<Expr> = (0..6)
            .map(|k| {
                let at = place();
                let turned = at[0] + 0.3;
                let size = 0.3 + 0.3 * at[1].abs();
                let solid = if k % 2 == 0 { sphere(size) } else { box_([-size; 3], [size; 3]) };
                solid.rotate([0.3, 0.4, 1.0], turned).unwrap().translate(at)
            })
            .collect();
        let solid =
            parts.into_iter().reduce(|a, b| if i % 2 == 0 { a.union(b) } else { a.difference(b) }).unwrap();
        let field = graph(&solid);
        let s = start(&field, 0.0, cube(18, 1.1));
        let settings = Settings { depth: 4, flatness: 0.97, ..s.settings };
        if let Some(report) = both(&format!("solid {i}"), &s.surface, &s.mesh, &settings) {
            taken_back += report.taken_back;
            not_converged += report.not_converged;
            for_shape += report.levels.iter().map(|l| l.for_shape).sum::<u64>();
        }
    }
    let all = [taken_back, not_converged, for_shape];
    assert!(all.iter().all(|&n| n > 0) || common::extractor().is_none(), "every way is gone: {all:?}");
}

/// Volumes are refined as their interpolant, whose gradients are differences of samples.
/// Goes red when a search along a line goes to one side alone (search.wgsl), when the side that is inside is ignored
/// (place.wgsl), and when the second of two diagonals is taken though only the first faces outwards (cut.wgsl).
#[test]
fn volumes() {
    let volume = Arc::new(small_brain());
    for gradient in [Gradient::Central(Interpolation::Trilinear), Gradient::Exact] {
        let leaf = VolumeLeaf::new(volume.clone(), Lookup { gradient, ..Lookup::default() }).unwrap();
        let field = GraphField::new(&leaf.expr(), Sense::Above);
        let grid = *volume.grid();
        for iso in [30.0, 60.0] {
            let (mesh, _) = extract_on_cpu(&Source::Volume(&volume), &Options::new(iso), &|_| {}).unwrap();
            assert!(mesh.check().boundary_edges > 0 || iso > 30.0);
            let surface = Surface::new(&field, iso, Sense::Above, 1e-2).unwrap();
            let settings = Settings { epsilon: 1e-3, depth: 3, ..Settings::default().on(&grid) };
            both(&format!("brain, {iso}, {gradient:?}"), &surface, &mesh, &settings);
        }
    }
}

/// Sums of blobs, which loop over lists.
#[test]
fn blobs() {
    let mut random = Random(5);
    let components: Vec<Component> = (0..200)
        .map(|_| Component {
            position: [0; 3].map(|_| random.unit() * 1.6 - 0.8),
            radius: 0.15 + 0.2 * random.unit(),
            weight: if random.unit() < 0.2 { -1.0 } else { 1.0 },
        })
        .collect();
    for kernel in [Kernel::SoftObject, Kernel::Blobby { least: 0.01 }] {
        let blobs = Blobs::new(kernel, components.clone()).unwrap();
        let field = GraphField::new(&blobs.expr(), Sense::Above);
        let s = start(&field, 0.5, cube(20, 1.2));
        assert!(s.mesh.triangles.len() > 500);
        both("blobs", &s.surface, &s.mesh, &Settings { depth: 3, ..s.settings });
    }
}

/// A field without a gradient of its own, written for both.
#[derive(Debug)]
struct Written {
    sense: Sense,
    value: fn(f32, f32, f32) -> f32,
    wgsl: String,
}

impl Field for Written {
    fn sense(&self) -> Sense {
        self.sense
    }
    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        points.map(out, self.value);
        Ok(())
    }
    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        Ok(Wgsl {
            value: self.wgsl.as_str().into(),
            gradient: None,
            interval: None,
            planes: None,
            data: Arc::default(),
            parameters: vec![1.0],
            counts_loops: false,
        })
    }
}

/// Central differences stand in for a gradient; NaN and infinite values are outside.
/// Goes red when what is not finite counts as inside, and when differences are not brought to length (place.wgsl).
#[test]
fn without_a_gradient() {
    let wgsl = "fn density(p: vec3<f32>) -> f32 {
        let q = p * p;
        if p.x > 0.7 { return bitcast<f32>(0x7fc00000u); }
        if p.x < -0.8 { return bitcast<f32>(0xff800000u); }
        return ((q.x + q.y) + q.z) - 1.0;
    }";
    let value = |x: f32, y: f32, z: f32| match x {
        x if x > 0.7 => f32::NAN,
        x if x < -0.8 => f32::NEG_INFINITY,
        _ => (x * x + y * y) + z * z - 1.0,
    };
    for sense in [Sense::Below, Sense::Above] {
        let field = Written { sense, value, wgsl: wgsl.into() };
        let s = start(&field, 0.0, cube(16, 1.5));
        both(
            "ball without a gradient",
            &s.surface,
            &s.mesh,
            &Settings { depth: 3, flatness: 0.99, ..s.settings },
        );
    }
}

/// Meshes of the other methods, with sharp features and vertices of many triangles; and such as no method makes:
/// triangles that name a vertex twice, are there twice, or meet three at an edge, vertices that none uses, of a huge size.
#[test]
fn other_meshes() {
    let field = graph(&kugeldiff());
    let s = start(&field, 0.0, cube(20, 1.5));
    let grid = cube(20, 1.5);
    let (sharp, _) = isoforge::sharp::extract(&s.surface, &grid, u64::MAX, &|_| {}).unwrap();
    both("sharp", &s.surface, &sharp, &s.settings);
    let settings = isoforge::octree::Settings::new(&grid);
    let (dmc, _) = isoforge::octree::extract(&s.surface, &grid, &settings, &|_| {}).unwrap();
    both("dmc", &s.surface, &dmc, &s.settings);

    let mut odd = s.mesh.clone();
    odd.triangles.insert(7, [3, 3, 4]);
    odd.triangles.push([9, 8, 8]);
    odd.triangles.push(odd.triangles[0]);
    odd.vertices.push(odd.vertices[0]);
    odd.triangles[0][0] = odd.vertices.len() as u32 - 1;
    odd.vertices.push(Vertex { position: [9.0; 3], normal: [0.0, 0.0, 0.5] });
    let report = both("odd", &s.surface, &odd, &s.settings);
    assert!(report.is_none_or(|report| report.improper == 2));

    let vertex = |p: [f32; 3]| Vertex { position: p, normal: [0.0, 0.0, 1.0] };
    let huge = Mesh {
        vertices: vec![vertex([3e38, 0.0, 0.0]), vertex([0.0, -3e38, 0.0]), vertex([-3e38, 0.0, 3e38])],
        triangles: vec![[0, 1, 2]],
    };
    both("huge", &s.surface, &huge, &s.settings);
    both("empty", &s.surface, &Mesh::default(), &s.settings);
    let improper = Mesh { triangles: vec![[1, 1, 2]], ..huge };
    both("improper alone", &s.surface, &improper, &s.settings);
}

/// What is refused is refused with the words of the CPU; what only the GPU refuses says that it does.
#[test]
fn errors() {
    let Some(extractor) = common::extractor() else { return };
    let ball = graph(&sphere(1.0));
    let s = start(&ball, 0.0, cube(8, 1.5));
    let error = |mesh: &Mesh, settings: &Settings| {
        let given = GpuMesh::upload(extractor.gpu(), mesh).unwrap();
        extractor.refine(&s.surface, &given, settings, &|_| {}).unwrap_err()
    };
    let as_on_the_cpu = |mesh: &Mesh, settings: Settings| {
        let wanted = refine(&s.surface, mesh, &settings, &|_| {}).unwrap_err();
        let found = error(mesh, &settings);
        assert!(!found.is_of_gpu(), "{found}");
        assert_eq!(found.to_string(), wanted.to_string());
    };
    as_on_the_cpu(&s.mesh, Settings { flatness: 2.0, ..s.settings });
    as_on_the_cpu(&s.mesh, Settings { most_triangles: 3, ..s.settings });
    let few = s.mesh.triangles.len() as u64;
    as_on_the_cpu(&s.mesh, Settings { most_triangles: few, flatness: 1.0, ..s.settings });
    as_on_the_cpu(&s.mesh, Settings { most_triangles: 5 * few, flatness: 1.0, ..s.settings });
    let mut bad = s.mesh.clone();
    (bad.triangles[5][1], bad.triangles[9][0]) = (1 << 30, 1 << 29);
    as_on_the_cpu(&bad, s.settings);
    let mut bad = s.mesh.clone();
    (bad.vertices[7].position[2], bad.vertices[8].position[0]) = (f32::NAN, f32::INFINITY);
    as_on_the_cpu(&bad, s.settings);

    let mut plain = s.mesh.clone();
    plain.vertices[11].normal = [0.0; 3];
    let found = error(&plain, &s.settings);
    assert!(found.is_of_gpu() && matches!(found, RefineError::NoNormal { vertex: 11 }), "{found}");
    // A fan around vertex 0.
    let rim = |i: u32| {
        let (sin, cos) = (i as f32 * 0.02).sin_cos();
        Vertex { position: [sin, cos, 0.0], normal: [0.0, 0.0, 1.0] }
    };
    let fan = |n: u32| Mesh {
        vertices: (0..=n).map(rim).collect(),
        triangles: (1..n).map(|i| [0, i, i + 1]).collect(),
    };
    both("a fan", &s.surface, &fan(160), &s.settings);
    let found = error(&fan(200), &s.settings);
    assert!(found.is_of_gpu() && matches!(found, RefineError::Crowded), "{found}");
    let rust = Closure::new(Sense::Below, |p: Vec3| p.length() - 1.0);
    let t = start(&rust, 0.0, cube(8, 1.5));
    let given = GpuMesh::upload(extractor.gpu(), &t.mesh).unwrap();
    let found = extractor.refine(&t.surface, &given, &t.settings, &|_| {}).unwrap_err();
    assert!(found.is_of_gpu() && found.to_string().contains("no WGSL"), "{found}");
}

/// A field whose loops would be ended in silence by a software adapter is not taken for refined.
/// Goes red without the loop at the end of `place` (shaders/refine/place.wgsl).
#[test]
fn long_loops() {
    let Some(extractor) = common::extractor() else { return };
    let run = |loops: u32| {
        let wgsl = format!(
            "fn density(p: vec3<f32>) -> f32 {{
                var n = bitcast<u32>(p.x);
                for (var i = 0u; i < {loops}u; i++) {{ n = (n * 1664525u + 1013904223u) ^ (n >> 3u); }}
                return dot(p, p) - field_parameters[0].x + select(0.0, 1.0, n == 77u);
            }}"
        );
        let value = |x: f32, y: f32, z: f32| ((x * x + y * y) + z * z) - 1.0;
        let field = Written { sense: Sense::Below, value, wgsl };
        let s = start(&field, 0.0, cube(6, 1.5));
        let given = GpuMesh::upload(extractor.gpu(), &s.mesh).unwrap();
        extractor.refine(&s.surface, &given, &Settings { depth: 1, ..s.settings }, &|_| {})
    };
    assert!(run(100).is_ok());
    if extractor.gpu().info.driver == "llvmpipe" {
        for loops in [6000, 12_000, 40_000] {
            assert!(matches!(run(loops), Err(RefineError::CutShort)), "{loops}");
        }
    }
}

/// What only a GPU evaluates is refined there.
#[test]
fn of_the_gpu_alone() {
    let Some(extractor) = common::extractor() else { return };
    let wgsl = "fn density(p: vec3<f32>) -> f32 {
        var d = length(p);
        while d > 2.0 { d -= 0.125; }
        return d - 1.0;
    }";
    let field = UserField::new(wgsl, "ball", Sense::Below).unwrap();
    let grid = cube(12, 1.5);
    let extraction = extractor.extract(&Source::Field(&field, grid), &Options::new(0.0)).unwrap();
    let surface = Surface::on_gpu(&field, 0.0, Sense::Below, 1e-3);
    assert!(Surface::new(&field, 0.0, Sense::Below, 1e-3).is_err(), "the CPU has it, too");
    let settings = Settings { flatness: 0.98, ..Settings::default().on(&grid) };
    let (mesh, report) = extractor.refine(&surface, &extraction.mesh, &settings, &|_| {}).unwrap();
    let mesh = mesh.read(extractor.gpu()).unwrap();
    assert!(report.levels.len() > 1 && report.not_converged + report.taken_back == 0, "{report:?}");
    assert!(mesh.vertices.iter().all(|v| (v.at().length() - 1.0).abs() < 2e-4));
    assert_eq!(mesh.check().boundary_edges, 0);
}
