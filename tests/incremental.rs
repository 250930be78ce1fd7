//! Extraction again after edits: the bytes of a full extraction, and few bricks sampled where few can have changed.

mod common;

use common::Random;
use glam::{Mat3, Vec3};
use isoforge::extract::{ExtractError, Incremental, Normals, Options, Source, Update, extract_on_cpu};
use isoforge::field::named::Named;
use isoforge::field::{Closure, Field, Sense};
use isoforge::graph::blobs::{Blobs, Component, Ellipsoid, Ellipsoids, Kernel};
use isoforge::graph::shapes::*;
use isoforge::graph::{Expr, GraphField, x, y, z};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::scene::{self, Scene};
use std::path::Path;

/// The bytes of a mesh: NaN equals itself, −0 differs from 0.
fn bytes(mesh: &Mesh) -> (&[u8], &[u8]) {
    (bytemuck::cast_slice(&mesh.vertices), bytemuck::cast_slice(&mesh.triangles))
}

/// An update, and that it gives what a full extraction does.
fn update(scene: &mut Incremental, grid: Grid, field: &dyn Field, options: &Options, name: &str) -> Update {
    let update = scene.update(field, options).unwrap();
    let (mesh, report) = extract_on_cpu(&Source::Field(field, grid), options, &|_| {}).unwrap();
    assert!(bytes(scene.mesh()) == bytes(&mesh), "{name}: {update:?}, {report:?}");
    assert_eq!(
        [update.bricks, update.vertices, update.triangles, update.non_finite],
        [report.bricks, report.vertices, report.triangles, report.non_finite],
        "{name}"
    );
    // Nothing that no bound leaves is sampled; what is sampled and what is kept do not overlap.
    assert!(
        update.dirty_bricks + update.kept_bricks <= report.active_bricks,
        "{name}: {update:?}, {report:?}"
    );
    update
}

fn grid(cells: [u32; 3], half: f32) -> Grid {
    Grid::from_bounds(cells, Vec3::splat(-half), Vec3::splat(half)).unwrap()
}

/// A scene of the examples, and the grid that it asks for, with cells `part` as many along each axis.
fn example(name: &str, part: f32) -> (GraphField, Grid) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes").join(name);
    let scene = Scene::open(&path, &scene::OpenOptions::default()).unwrap();
    let [low, high] = scene.bounds.unwrap();
    let cells = scene.cells.unwrap().map(|n| (n as f32 * part) as u32);
    (scene.field(), Grid::from_bounds(cells, low, high).unwrap())
}

/// Balls in rows, joined sharply and with seams, a hole through all; each with parameters of its own.
fn balls() -> GraphField {
    let mut all = sphere(0.2);
    for i in 0..12 {
        let place = [0.5 * f64::from(i % 4) - 0.75, 0.5 * f64::from(i / 4) - 0.5, 0.1 * f64::from(i % 3)];
        let ball = sphere(Expr::parameter(&format!("r{i}"), 0.2)).translate(place);
        all = if i % 2 == 0 { all.min(ball) } else { all.smooth_union(ball, Expr::parameter("seam", 0.1)) };
    }
    GraphField::new(&all.difference(cylinder(Expr::parameter("hole", 0.1), 3.0)), Sense::Below)
}

/// Goes red when a brick's box lacks its last points, when a change of a uniform's value is not seen, when the triangles of
/// bricks that are kept keep their vertices' old numbers, when those of a brick that is emitted again are counted on from its
/// first (not looked up by their edges), or when bricks with singular vertices are kept.
#[test]
fn a_hundred_edits() {
    let (part, of_part) = example("part.toml", 0.75);
    let oblique = Mat3::from_rotation_z(0.3) * Mat3::from_rotation_x(0.5) * 0.05;
    let cases = [
        ("part", part, of_part),
        ("balls", balls(), grid([71, 45, 38], 1.1)),
        ("balls, turned", balls(), Grid::new([45; 3], oblique * Vec3::splat(-22.0), oblique).unwrap()),
    ];
    for (name, mut field, grid) in cases {
        let mut random = Random(7);
        let options = Options::new(0.0);
        let mut scene = Incremental::new(grid);
        let first = update(&mut scene, grid, &field, &options, name);
        assert_eq!(first.kept_bricks, 0);
        let defaults: Vec<(String, f64)> = field.parameters().map(|(n, v)| (n.to_string(), v)).collect();
        let (mut dirty, mut kept) = (0, 0);
        for edit in 0..100 {
            // One, sometimes two; now and then a value that makes the part vanish, or everything.
            for _ in 0..1 + random.next() % 5 / 4 {
                let (parameter, default) = &defaults[random.next() as usize % defaults.len()];
                let factor = match random.next() % 16 {
                    0 => -1.0,
                    1 => 8.0,
                    2 => 0.0,
                    _ => 0.7 + 0.6 * f64::from(random.unit()),
                };
                field.set(parameter, default * factor).unwrap();
            }
            let update = update(&mut scene, grid, &field, &options, &format!("{name}, edit {edit}"));
            dirty += update.dirty_bricks;
            kept += update.kept_bricks;
        }
        // Half of the part's edits are of its edges' radius or its bore, which most of it depends on.
        assert!(kept > dirty / 4, "{name}: {kept} kept, {dirty} dirty");
    }
}

/// Nothing changed: nothing is sampled. A value that is set and set back is no change, and a field made anew of the same
/// expression is none. Goes red when fields are compared by the addresses of their tapes.
#[test]
fn no_edit() {
    let (part, grid) = example("part.toml", 0.5);
    let options = Options::new(0.0);
    let mut scene = Incremental::new(grid);
    let first = update(&mut scene, grid, &part, &options, "first");
    let surface = {
        let again = update(&mut scene, grid, &part, &options, "again");
        assert_eq!(again.dirty_bricks, 0);
        again.kept_bricks
    };
    assert!(surface > 0 && surface <= first.dirty_bricks);
    let (mut anew, _) = example("part.toml", 0.5);
    assert_eq!(update(&mut scene, grid, &anew, &options, "anew").dirty_bricks, 0);
    anew.set("bore", 0.5).unwrap();
    assert!(update(&mut scene, grid, &anew, &options, "another").dirty_bricks > 0);
    // Of the budget nothing depends but whether it fits.
    let roomy = Options { memory_budget: 1 << 30, ..options };
    assert_eq!(update(&mut scene, grid, &anew, &roomy, "roomy").dirty_bricks, 0);
}

/// An edit in one place: few bricks are sampled. Goes red when what is decided in a box is not looked at.
#[test]
fn few_bricks_are_dirty() {
    let mut field = balls();
    let grid = grid([96, 96, 64], 1.1);
    let options = Options::new(0.0);
    let mut scene = Incremental::new(grid);
    let full = update(&mut scene, grid, &field, &options, "first").dirty_bricks;
    let mut shares = Vec::new();
    for (parameter, value) in [("r0", 0.21), ("r7", 0.19), ("r10", 0.25), ("hole", 0.12)] {
        field.set(parameter, value).unwrap();
        let update = update(&mut scene, grid, &field, &options, parameter);
        assert!(update.dirty_bricks > 0);
        shares.push(update.dirty_bricks as f64 / full as f64);
    }
    assert!(shares.iter().all(|share| *share < 0.45), "{shares:?}");
}

/// Of a seam only what is near it changes with its radius. Goes red when operations on numbers alone are compared by the
/// numbers, not by what they give.
#[test]
fn seams() {
    let ball = |x| sphere(0.6).translate([x, 0.0, 0.0]);
    let seam = ball(-0.5).smooth_union(ball(0.5), Expr::parameter("seam", 0.1));
    let mut field = GraphField::new(&seam, Sense::Below);
    let grid = grid([96, 60, 60], 1.2);
    let mut scene = Incremental::new(grid);
    update(&mut scene, grid, &field, &Options::new(0.0), "first");
    for radius in [0.11, 0.05, 0.0, 0.1] {
        field.set("seam", radius).unwrap();
        let update = update(&mut scene, grid, &field, &Options::new(0.0), &format!("seam = {radius}"));
        assert!(update.dirty_bricks > 0 && update.dirty_bricks < update.kept_bricks, "{update:?}");
    }
}

/// Solids that come and go in a field that is made anew each time: bricks far from them are kept. Goes red when only
/// parameters of one and the same expression are compared, or sums in the order in which they stand on the tape.
#[test]
fn solids_come_and_go() {
    let grid = grid([70, 71, 72], 1.2);
    let mut scene = Incremental::new(grid);
    let ball = |i: u32| sphere(0.2).translate([0.5 * f64::from(i) - 1.0, 0.3, 0.1]);
    for present in [0b10011u32, 0b10111, 0b10110, 0b11110, 0b11010] {
        let balls = union((0..5).filter(|i| present >> i & 1 == 1).map(ball));
        let field = GraphField::new(&torus_distance(0.8, 0.1).min(balls), Sense::Below);
        let update = update(&mut scene, grid, &field, &Options::new(0.0), &format!("{present:b}"));
        assert!(present == 0b10011 || update.kept_bricks > update.dirty_bricks, "{present:b}: {update:?}");
    }
}

/// Components that move, come and go: bricks that none of them reaches, before or after, are kept. Goes red when lists of
/// components are compared without their order or their weights, or only where they are few.
#[test]
fn blobs() {
    let mut random = Random(3);
    let mut one =
        |radius: f32| Component { position: [0; 3].map(|_| 1.8 * random.unit() - 0.9), radius, weight: 1.0 };
    for (name, count, radius) in [("few", 12, 0.4), ("many", 3000, 0.09)] {
        let mut components: Vec<Component> = (0..count).map(|_| one(radius)).collect();
        // The corners stay, and with them the lookup grids.
        components.extend([-1.0, 1.0].map(|c| Component { position: [c; 3], radius, weight: 1.0 }));
        let grid = grid([67, 70, 61], 1.1);
        let mut scene = Incremental::new(grid);
        let mut random = Random(4);
        let mut shares = Vec::new();
        for edit in 0..25 {
            let at = random.next() as usize % (components.len() - 2);
            match edit % 5 {
                0 => {}
                1 => {
                    components.remove(at);
                }
                2 => components.insert(at, one(radius)),
                3 => components[at].weight = -components[at].weight,
                _ => components[at].position[edit % 3] += 0.01,
            }
            let blobs = Blobs::new(Kernel::SoftObject, components.clone()).unwrap();
            let field = GraphField::new(&blobs.expr(), Sense::Above);
            let update =
                update(&mut scene, grid, &field, &Options::new(0.3), &format!("{name}, edit {edit}"));
            shares.push(update.dirty_bricks as f64 / (update.dirty_bricks + update.kept_bricks) as f64);
        }
        let most = if count > 100 { 0.1 } else { 0.7 };
        assert!(shares[1..].iter().all(|share| *share < most), "{name}: {shares:?}");
    }
}

/// As [`blobs`], of ellipsoids, in a tree with other things, and with kernels of other kinds.
#[test]
fn blobs_within_a_tree() {
    let mut random = Random(5);
    let mut one = || Ellipsoid {
        component: Component {
            position: [0; 3].map(|_| 1.6 * random.unit() - 0.8),
            radius: 0.2,
            weight: 1.0,
        },
        rotation: glam::Quat::from_rotation_z(random.unit()),
        scale: Vec3::new(0.5, 1.0, 1.0 + random.unit()),
    };
    let mut components: Vec<Ellipsoid> = (0..60).map(|_| one()).collect();
    let drop = Component { position: [0.5, 0.2, 0.1], radius: 0.5, weight: 1.0 };
    let grid = grid([50, 41, 47], 1.1);
    let mut scene = Incremental::new(grid);
    for edit in 0..12 {
        if edit % 3 == 1 {
            components[edit] = one();
        }
        let kernel = if edit < 9 { Kernel::Metaball } else { Kernel::Blobby { least: 1e-3 } };
        let stretched = Ellipsoids::new(kernel, &components).unwrap().expr();
        let weight = if edit % 3 == 2 { 0.5 + 0.05 * edit as f32 } else { 1.0 };
        let drops = Blobs::new(Kernel::SoftObject, vec![Component { weight, ..drop }]).unwrap().expr();
        let rough = Expr::noise(3) * 0.02;
        let field =
            GraphField::new(&(0.4 - stretched).min(sphere(0.3)).min(0.3 - drops + rough), Sense::Below);
        let update = update(&mut scene, grid, &field, &Options::new(0.0), &format!("edit {edit}"));
        match edit {
            // Another kernel changes all of the sum.
            0 | 9 => assert_eq!(update.kept_bricks, 0, "{update:?}"),
            _ => assert!(update.kept_bricks > update.dirty_bricks, "{edit}: {update:?}"),
        }
        assert!(update.dirty_bricks > 0, "{edit}: {update:?}");
    }
}

/// A closure says nothing of what changed: all is sampled, at each update. A named field is compared as its expression.
#[test]
fn other_fields() {
    let grid = grid([33, 20, 41], 1.3);
    let mut scene = Incremental::new(grid);
    for radius in [0.9, 0.9, 1.0, -1.0, 1.1] {
        let ball = Closure::new(Sense::Below, move |p: Vec3| p.length() - radius);
        let update = update(&mut scene, grid, &ball, &Options::new(0.0), "closure");
        assert_eq!((update.dirty_bricks, update.kept_bricks), (update.bricks, 0));
    }
    for (thickness, same) in [(0.1, false), (0.1, true), (0.2, false)] {
        let field = Named::new("gyroid").unwrap().with("thickness", thickness).unwrap();
        let update = update(&mut scene, grid, &field, &Options::new(0.0), "named");
        assert_eq!(update.dirty_bricks == 0, same, "{update:?}");
    }
}

/// A new iso value, side or kind of normals is another mesh altogether. Goes red when one of them is left out of what is
/// compared.
#[test]
fn other_options() {
    let field = balls();
    let grid = grid([40, 41, 42], 1.1);
    let mut scene = Incremental::new(grid);
    let zero = Options::new(0.0);
    let central = Normals::Central { delta: Some(0.2) };
    for options in [
        Options::new(0.05),
        Options { sense: Some(Sense::Above), ..zero },
        Options { normals: central, ..zero },
        Options { normals: Normals::Forward { delta: None }, ..zero },
        Options { cull: false, ..zero },
    ] {
        scene.update(&field, &zero).unwrap();
        let update = scene.update(&field, &options).unwrap();
        assert_eq!(update.kept_bricks, 0, "{options:?}");
        let (mesh, _) = extract_on_cpu(&Source::Field(&field, grid), &options, &|_| {}).unwrap();
        assert!(bytes(scene.mesh()) == bytes(&mesh), "{options:?}");
    }
}

/// Differences reach out of the brick, here by nearly one. Goes red when the boxes do not.
#[test]
fn normals_by_differences() {
    let grid = grid([80; 3], 1.1);
    for normals in [Normals::Central { delta: Some(0.2) }, Normals::Forward { delta: Some(0.2) }] {
        let options = Options { normals, ..Options::new(0.0) };
        let mut field = balls();
        let mut scene = Incremental::new(grid);
        update(&mut scene, grid, &field, &options, "first");
        for (parameter, value) in [("r0", 0.21), ("r11", 0.3), ("r0", 0.2), ("r5", 0.22)] {
            field.set(parameter, value).unwrap();
            let update = update(&mut scene, grid, &field, &options, parameter);
            assert!(update.dirty_bricks > 0 && update.kept_bricks > 0, "{update:?}");
        }
    }
}

/// Surfaces that vanish and come back, and parameters that make NaN and infinities in some places.
#[test]
fn nothing_and_nan() {
    let ball = sphere(Expr::parameter("r", 0.5)).translate([-0.4, 0.0, 0.0]);
    let odd = (x() - Expr::parameter("from", -2.0)).sqrt() * Expr::parameter("by", 0.0);
    let pole = Expr::parameter("pole", 0.0) / (x() - 0.7) * 0.01;
    let mut field =
        GraphField::new(&(ball.min(sphere(0.2).translate([0.8, 0.3, 0.2])) + odd + pole), Sense::Below);
    let grid = grid([45, 37, 51], 1.2);
    let mut scene = Incremental::new(grid);
    let mut odd = 0;
    update(&mut scene, grid, &field, &Options::new(0.0), "first");
    for (name, value) in [
        ("r", 0.4),
        ("from", 0.5),
        ("by", 1.0),
        ("from", -0.5),
        ("r", 1e30),
        ("pole", 1.0),
        ("from", -2.0),
        ("r", -5.0),
        ("by", 3e38),
        ("by", 0.0),
        ("r", 0.4),
        ("pole", 0.0),
        ("r", 0.5),
    ] {
        field.set(name, value).unwrap();
        let update = update(&mut scene, grid, &field, &Options::new(0.0), &format!("{name} = {value}"));
        odd += update.non_finite;
    }
    assert!(odd > 1000, "{odd}");
    let mut empty = GraphField::new(&(sphere(Expr::parameter("r", -1.0)) + 0.0), Sense::Below);
    let mut scene = Incremental::new(grid);
    for r in [-1.0, 0.5, -1.0, 0.7, 0.7] {
        empty.set("r", r).unwrap();
        let update = update(&mut scene, grid, &empty, &Options::new(0.0), "empty");
        assert_eq!(update.triangles == 0, r < 0.0);
    }
}

/// The tips of a double cone have normals of their neighbours, which may lie in other bricks: their bricks are emitted
/// again each time ([`a_hundred_edits`] goes red when they are kept).
#[test]
fn singular_vertices() {
    let cone = (x().square() + y().square()).sqrt() - z().abs() * Expr::parameter("wide", 0.5);
    let ball = sphere(Expr::parameter("r", 0.1)).translate([0.3, 0.3, -0.3]);
    let mut field = GraphField::new(&cone.min(ball), Sense::Below);
    for cells in [[32; 3], [31, 40, 33]] {
        let grid = grid(cells, 1.0);
        let mut scene = Incremental::new(grid);
        for (parameter, value) in [("r", 0.1), ("r", 0.12), ("wide", 0.6), ("r", 0.3), ("r", 0.31)] {
            field.set(parameter, value).unwrap();
            update(&mut scene, grid, &field, &Options::new(0.0), &format!("{parameter} = {value}"));
        }
        assert!(update(&mut scene, grid, &field, &Options::new(0.0), "no edit").dirty_bricks <= 8);
    }
}

#[test]
fn any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut field = balls();
            let grid = grid([61, 50, 40], 1.1);
            let mut scene = Incremental::new(grid);
            for value in [0.2, 0.21, 0.3, 0.1] {
                field.set("r4", value).unwrap();
                update(&mut scene, grid, &field, &Options::new(0.0), "threads");
            }
            scene.into_mesh()
        })
    };
    let one = run(1);
    assert!([2, 5].into_iter().all(|threads| bytes(&run(threads)) == bytes(&one)));
}

/// Where both meshes do not fit, the one before is dropped; where one does not, that is the error, and the next
/// update begins anew.
#[test]
fn the_budget_holds() {
    let mut field = balls();
    let grid = grid([64; 3], 1.1);
    let source = Source::Field(&field as &dyn Field, grid);
    let (mesh, report) = extract_on_cpu(&source, &Options::new(0.0), &|_| {}).unwrap();
    let mut scene = Incremental::new(grid);
    let tight = Options { memory_budget: report.peak_bytes * 5 / 4, ..Options::new(0.0) };
    let first = scene.update(&field, &tight).unwrap();
    assert!(first.peak_bytes <= tight.memory_budget);
    field.set("r0", 0.21).unwrap();
    let second = update(&mut scene, grid, &field, &tight, "tight");
    assert_eq!(second.kept_bricks, 0);
    assert!(second.peak_bytes <= tight.memory_budget);
    let none = Options { memory_budget: report.peak_bytes / 2, ..Options::new(0.0) };
    assert!(matches!(scene.update(&field, &none), Err(ExtractError::Budget { .. })));
    assert!(scene.mesh().vertices.is_empty());
    assert!(matches!(scene.update(&field, &Options::new(f32::NAN)), Err(ExtractError::Iso(_))));
    field.set("r0", 0.2).unwrap();
    assert_eq!(scene.update(&field, &Options::new(0.0)).unwrap().kept_bricks, 0);
    assert!(bytes(scene.mesh()) == bytes(&mesh));
}
