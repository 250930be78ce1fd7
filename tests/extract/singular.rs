//! Vertices whose gradient has no direction get the average of their neighbours' normals: apexes of cones, lines
//! where a surface meets itself, flat parts of a field.

use super::{bytes, on_cpu, read, same_everywhere};
use crate::common;
use glam::{DVec3, Vec3};
use isoforge::extract::{
    ExtractError, Extractor, Normals, Options, Report, Source, extract_on_cpu, stage_index,
};
use isoforge::field::{Field, Sense};
use isoforge::gpu::GpuMesh;
use isoforge::graph::{GraphField, formula};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;

fn field(text: &str) -> GraphField {
    GraphField::new(&formula::parse(text, &[]).unwrap(), Sense::Below)
}

fn cube(n: u32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::splat(-1.0), Vec3::splat(1.0)).unwrap()
}

/// A grid with the origin in the middle of a cell.
fn beside(n: u32) -> Grid {
    Grid::from_bounds([n; 3], Vec3::splat(-1.013), Vec3::splat(1.0)).unwrap()
}

fn good_normals(name: &str, mesh: &Mesh) {
    for vertex in &mesh.vertices {
        let length = vertex.normal.map(f64::from).map(|n| n * n).iter().sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-5, "{name}: {vertex:?}");
    }
}

/// The mean of the normals of the other corners of the triangles at `vertex`, leaving out `singular` ones.
fn mean_around(mesh: &Mesh, vertex: u32, singular: &[u32]) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for triangle in mesh.triangles.iter().filter(|t| t.contains(&vertex)) {
        for corner in triangle.iter().filter(|c| !singular.contains(c)) {
            sum += Vec3::from(mesh.vertices[*corner as usize].normal).as_dvec3();
        }
    }
    sum
}

fn at_origin(mesh: &Mesh) -> Vec<u32> {
    let all = (0u32..).zip(&mesh.vertices);
    all.filter(|(_, v)| v.at().length() < 1e-6).map(|(i, _)| i).collect()
}

/// Cones about z, about (1, 1, 1) and another axis, and half a one, with the apex on a point of the grid and not.
///
/// Goes red when `add_neighbours` (`src/stage/normals/cpu.rs`) leaves out the triangle's last corner, and when `average`
/// takes the edge's direction at once.
#[test]
fn the_apex_of_a_cone() {
    let tilted = "(x - 0.3*z)^2 + 2*y^2 - (z + 0.2*x)^2";
    let cones = [
        "x^2 + y^2 - z^2",
        tilted,
        "0.6*(x^2 + y^2 + z^2) - (x + y + z)^2",
        "max(0.6*(x^2 + y^2 + z^2) - (x + y + z)^2, 0 - x - y - z)",
    ];
    for text in cones {
        let cone = field(text);
        for n in [2, 16, 30] {
            let source = Source::Field(&cone, cube(n));
            let mesh = on_cpu(&source, &Options::new(0.0));
            good_normals(text, &mesh);
            let apexes = at_origin(&mesh);
            assert!(apexes.len() >= 2, "{text}: {apexes:?}");
            for &apex in &apexes {
                let mean = mean_around(&mesh, apex, &apexes).normalize();
                let found = Vec3::from(mesh.vertices[apex as usize].normal).as_dvec3();
                assert!(found.distance(mean) < 1e-4, "{text} {n}: {found} for {mean}");
                assert!(
                    text != tilted || found.abs().max_element() < 0.999,
                    "{found} is the edge's direction"
                );
            }
            same_everywhere(text, &source, &Options::new(0.0));
        }
        for n in [16, 31] {
            let source = Source::Field(&cone, beside(n));
            let (mesh, report) = extract_on_cpu(&source, &Options::new(0.0), &|_| {}).unwrap();
            good_normals(text, &mesh);
            assert!(at_origin(&mesh).is_empty() && !marked(&report), "{text}");
            same_everywhere(text, &source, &Options::new(0.0));
        }
    }
}

/// Fields with singular lines and planes, and one whose every gradient is zero.
fn singular() -> Vec<(&'static str, Box<dyn Field>, Grid, f32)> {
    let steiner = |n| common::named("steiner", n);
    let (on, off) = (steiner(48), steiner(37));
    vec![
        ("steiner, even", Box::new(on.0), on.1, 0.0),
        ("steiner, odd", Box::new(off.0), off.1, 0.0),
        ("cone", Box::new(field("x^2 + y^2 - z^2")), cube(40), 0.0),
        ("planes", Box::new(field("x*y*z")), cube(22), 0.0),
        ("flat in part", Box::new(field("min(0.2 - x, 0)")), cube(20), 0.0),
        ("flat", Box::new(field("floor(x + y + z)")), cube(21), 0.5),
        ("steps", Box::new(field("floor(3*x) + y^2*z^2")), cube(23), 0.3),
    ]
}

fn marked(report: &Report) -> bool {
    report.seconds[stage_index::NORMALS].is_some()
}

/// Goes red when `mark` (`shaders/shared/unit.wgsl`) loses the sign of the edge.
#[test]
fn both_backends_agree_and_no_mark_is_left() {
    let mut seen = 0;
    for (name, field, grid, iso) in singular() {
        let source = Source::Field(&*field, grid);
        for sense in [Sense::Below, Sense::Above] {
            let options = Options { sense: Some(sense), ..Options::new(iso) };
            let (mesh, report) = extract_on_cpu(&source, &options, &|_| {}).unwrap();
            // Above 0 this one is nowhere.
            assert!(!mesh.triangles.is_empty() || name == "flat in part", "{name}");
            good_normals(name, &mesh);
            let wanted = match name {
                "cone" | "flat" => true,
                // Ties with iso are outside: the singular lines have vertices where they border on the inside.
                "steiner, even" => sense == Sense::Above,
                "flat in part" => sense == Sense::Below,
                _ => false,
            };
            assert!(marked(&report) || !wanted, "{name}, {sense:?}");
            same_everywhere(name, &source, &options);
            // Differences of a step so small that nearly all are zero.
            let none = Options { normals: Normals::Forward { delta: Some(1e-30) }, ..options };
            let (mesh, report) = extract_on_cpu(&source, &none, &|_| {}).unwrap();
            seen += u32::from(marked(&report));
            good_normals(name, &mesh);
            same_everywhere(name, &source, &none);
        }
    }
    assert!(seen >= 11, "{seen} of 14");
}

/// Volumes have singular vertices, too: single points that stand out, and noise with what is not finite.
#[test]
fn volumes_have_them_too() {
    let grid = Grid::from_bounds([31, 20, 27], Vec3::ZERO, Vec3::ONE).unwrap();
    let speck = common::sampled(grid, |p| f32::from(u8::from((p * 97.0).as_uvec3().element_sum() % 7 == 0)));
    for volume in [speck, common::noise(grid, 5)] {
        let source = Source::Volume(&volume);
        let (mesh, report) = extract_on_cpu(&source, &Options::new(0.1), &|_| {}).unwrap();
        assert!(marked(&report));
        good_normals("volume", &mesh);
        same_everywhere("volume", &source, &Options::new(0.1));
    }
}

/// However the grid is cut.
///
/// Goes red when the flag is read after the last slab alone.
#[test]
fn cut_grids_have_the_same_normals() {
    let Some(extractor) = common::extractor() else { return };
    for (name, field, grid, iso) in singular() {
        let source = Source::Field(&*field, grid);
        let uncut = extractor.extract(&source, &Options::new(iso)).unwrap();
        let mesh = read(extractor, &uncut);
        let mut most = 0;
        let mut budget = uncut.report.peak_bytes;
        loop {
            let options = Options { memory_budget: budget, ..Options::new(iso) };
            match extractor.extract(&source, &options) {
                Ok(found) => {
                    assert!(bytes(&mesh) == bytes(&read(extractor, &found)), "{name} within {budget} bytes");
                    most = most.max(found.report.slabs);
                }
                Err(ExtractError::Budget { .. }) => break,
                Err(error) => panic!("{name}: {error}"),
            }
            budget = budget * 4 / 5;
        }
        assert!(most > 1, "{name}: {most} slabs");
    }
}

/// A mesh that takes several windows of what the device binds: neighbours lie in others.
///
/// Goes red when windows are paired with themselves alone, and when `slabs_beside` leaves out the next slab.
#[test]
fn meshes_of_many_windows() {
    let Some(whole) = common::extractor() else { return };
    let mut windows = Vec::new();
    let zebra = Box::new(field("sin(9*x) * sin(8*y) * sin(7*z)")) as Box<dyn Field>;
    let long = Grid::from_bounds([900, 20, 19], Vec3::splat(-1.0), Vec3::splat(1.0)).unwrap();
    let cubes = singular().into_iter().map(|(name, field, _, iso)| (name, field, cube(100), iso, 200 << 10));
    // Of this one rows are cut as well.
    for (name, field, grid, iso, binding) in cubes.chain([("zebra", zebra, long, 0.0, 512 << 10)]) {
        let limits =
            |all| wgpu::Limits { max_storage_buffer_binding_size: binding, max_buffer_size: 1 << 26, ..all };
        let small = Extractor::new(common::own_device(limits).unwrap()).unwrap();
        let source = Source::Field(&*field, grid);
        // A step that is lost beside coordinates over 1/4: so a good part is marked, and borders on the rest.
        for normals in [Normals::Exact, Normals::Forward { delta: Some(2e-8) }] {
            let options = Options { normals, ..Options::new(iso) };
            let expected = read(whole, &whole.extract(&source, &options).unwrap());
            let found = small.extract(&source, &options).unwrap();
            assert!(bytes(&expected) == bytes(&read(&small, &found)), "{name} {normals:?}");
            windows.push(24 * expected.vertices.len() as u64 / binding + 1);
        }
    }
    assert!(windows.iter().filter(|&&n| n > 1).count() >= 8, "{windows:?}");
}

/// Recorded into the caller's encoder, with room to spare or too little.
///
/// Goes red when `arrange` has one group too few, and when `add_neighbours` takes the room for the number of triangles.
#[test]
fn recorded_without_waiting() {
    let Some(extractor) = common::extractor() else { return };
    let gpu = extractor.gpu();
    let encode = |source: &Source<'_>, options: &Options, room: [usize; 2], marked: u32| {
        let space = extractor.prepare(source, u64::MAX).unwrap();
        let mesh = GpuMesh::with_capacity(gpu, room[0] as u32, room[1] as u32).unwrap();
        // What an earlier mesh left behind this one must not count as triangles of it: here all at one vertex.
        let corner = |i| if i % 3 == 0 { marked } else { i % room[0] as u32 };
        let earlier: Vec<u32> = (0..mesh.indices.size() as u32 / 4).map(corner).collect();
        gpu.queue.write_buffer(&mesh.indices, 0, bytemuck::cast_slice(&earlier));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        extractor.encode(&space, &mut encoder, options, &mesh).unwrap();
        gpu.queue.submit([encoder.finish()]);
        mesh.read(gpu).unwrap()
    };
    for (name, field, grid, iso) in singular() {
        let source = Source::Field(&*field, grid);
        let options = Options { normals: Normals::Forward { delta: None }, ..Options::new(iso) };
        for options in [Options::new(iso), options] {
            let expected = read(extractor, &extractor.extract(&source, &options).unwrap());
            let [v, t] = [expected.vertices.len(), expected.triangles.len()];
            let marked = at_origin(&expected).first().copied().unwrap_or(0);
            for room in [[v, t], [v + 1, t + 1], [2 * v + 70, 3 * t + 130]] {
                assert!(
                    bytes(&expected) == bytes(&encode(&source, &options, room, marked)),
                    "{name} {room:?}"
                );
            }
            assert_eq!(encode(&source, &options, [v / 2, t], 0), Mesh::default(), "{name}");
        }
    }
}
