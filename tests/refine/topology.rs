//! What comes out is closed, manifold, wound and connected as what went in.

use crate::common::{Random, named, small_brain};
use crate::tools::*;
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::{Sense, Surface};
use isoforge::graph::volume::{Lookup, VolumeLeaf};
use isoforge::graph::{Expr, GraphField, shapes::*};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::refine::{RefineReport, Settings, refine};
use std::sync::Arc;

/// Goes red when one of the three parts of a triangle is wound the other way round.
fn assert_same_topology(start: &Mesh, refined: &Mesh, report: &RefineReport, name: &str) {
    let (before, after) = (start.check(), refined.check());
    let bad = |r: &isoforge::mesh::check::Report| {
        [
            r.non_manifold_edges,
            r.misoriented_edges,
            r.non_manifold_vertices,
            r.bad_indices,
            r.non_finite_vertices,
        ]
    };
    assert_eq!(bad(&before), bad(&after), "{name}: {after}");
    assert_eq!(before.boundary_edges == 0, after.boundary_edges == 0, "{name}: {after}");
    // Zero-area triangles that split off do not change the count either: they are triangles like all.
    let euler = |mesh: &Mesh| {
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for t in &mesh.triangles {
            edges.extend((0..3).map(|k| [t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3])]));
        }
        edges.sort_unstable();
        edges.dedup();
        mesh.vertices.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64
    };
    assert_eq!(euler(start), euler(refined), "{name}");
    assert_eq!(before.genus.is_some(), after.genus.is_some(), "{name}");
    let last = report.levels.last().unwrap();
    assert_eq!([last.vertices, last.triangles], [after.vertices as u64, after.triangles as u64]);
    let all = report.projected + report.not_converged + report.taken_back;
    assert!(all >= last.vertices, "{name}: {report:?}");
    for vertex in &refined.vertices {
        let length = Vec3::from(vertex.normal).length();
        assert!((length - 1.0).abs() < 1e-5, "{name}: a normal of length {length}");
    }
}

#[test]
fn named_fields() {
    for (name, n) in [("torus", 24), ("gyroid", 24), ("sphere", 5), ("cube", 9), ("octahedron", 16)] {
        let (field, grid) = named(name, n);
        let s = start(&field, field.definition().iso, grid);
        for flatness in [0.8, 0.95, 0.999] {
            let (mesh, report) = s.refined(|s| (s.flatness, s.depth) = (flatness, 3));
            assert_same_topology(&s.mesh, &mesh, &report, name);
        }
    }
}

/// Spheres and boxes, joined and cut at random.
fn random_solid(random: &mut Random) -> Expr {
    let place = |random: &mut Random| [0; 3].map(|_| f64::from(random.unit()) * 1.2 - 0.6);
    let part = |random: &mut Random| {
        let size = 0.2 + 0.4 * f64::from(random.unit());
        let solid = if random.next().is_multiple_of(2) { sphere(size) } else { box_([-size; 3], [size; 3]) };
        let turned = solid.rotate([0.3, 0.4, 1.0], f64::from(random.unit())).unwrap();
        turned.translate(place(random))
    };
    (0..4).fold(
        part(random),
        |all, i| if i % 2 == 0 { all.union(part(random)) } else { all.difference(part(random)) },
    )
}

#[test]
fn random_solids_and_blobs() {
    let mut random = Random(4);
    for i in 0..12 {
        let solid = graph(&random_solid(&mut random));
        let s = start(&solid, 0.0, cube(14 + i, 1.7));
        let (mesh, report) = s.refined(|s| s.depth = 4);
        assert_same_topology(&s.mesh, &mesh, &report, &format!("solid {i}"));
        let blobs = (0..5).map(|_| {
            let at = [0; 3].map(|_| f64::from(random.unit()) - 0.5);
            (sphere(0.0).translate(at).square() * -12.0).exp()
        });
        let blobs = GraphField::new(&blobs.reduce(|a, b| a + b).unwrap(), Sense::Above);
        let s = start(&blobs, 0.5, cube(10 + i, 1.6));
        let (mesh, report) = s.refined(|s| s.depth = 4);
        assert_same_topology(&s.mesh, &mesh, &report, &format!("blobs {i}"));
    }
}

/// A volume's surface is open where the volume ends; its border stays in the faces of the grid. Goes red when
/// `Settings::free` says that points may move along all axes.
#[test]
fn volume_with_border() {
    let volume = Arc::new(small_brain());
    let leaf = VolumeLeaf::new(volume.clone(), Lookup::default()).unwrap();
    let field = GraphField::new(&leaf.expr(), Sense::Above);
    let iso = 10.0;
    let (mesh, _) = extract_on_cpu(&Source::Volume(&volume), &Options::new(iso), &|_| {}).unwrap();
    let grid = *volume.grid();
    let surface = Surface::new(&field, iso, Sense::Above, grid.shortest_step() as f32 * 0.01).unwrap();
    let settings = Settings { depth: 2, epsilon: 1e-3, ..Settings::default() }.on(&grid);
    let (refined, report) = refine(&surface, &mesh, &settings, &|_| {}).unwrap();
    assert_same_topology(&mesh, &refined, &report, "brain");

    let (field, grid) = named("gyroid", 12);
    let s = start(&field, field.definition().iso, grid);
    let (mesh, report) = s.refined(|_| {});
    assert_same_topology(&s.mesh, &mesh, &report, "gyroid");
    let [low, high] = s.settings.border.unwrap();
    for mesh in [&s.mesh, &mesh] {
        assert_within(mesh, [low, high]);
        let mut edges = std::collections::HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *edges.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
            }
        }
        for edge in edges.iter().filter(|(_, count)| **count == 1).map(|(edge, _)| edge) {
            let [a, b] = edge.map(|i| mesh.vertices[i as usize].at());
            let on = |k: usize, face: f32| (a[k] - face).abs() < 1e-4 && (b[k] - face).abs() < 1e-4;
            assert!((0..3).any(|k| on(k, low[k]) || on(k, high[k])), "{a} to {b}");
        }
    }
}

fn assert_within(mesh: &Mesh, [low, high]: [Vec3; 2]) {
    let near = (high - low) * 1.1e-5;
    for vertex in &mesh.vertices {
        assert!(vertex.at().cmpge(low - near).all() && vertex.at().cmple(high + near).all(), "{vertex:?}");
    }
}

/// Where the surface just touches the border from within, or bulges over it between the points of an edge, no vertex leaves the
/// domain.
#[test]
fn nothing_leaves_the_border() {
    for (cells, thickness) in [(24, 0.5), (40, 0.5), (12, 0.0)] {
        let (field, grid) = named("gyroid", cells);
        let field = field.with("thickness", thickness).unwrap();
        let s = start(&field, field.definition().iso, grid);
        let (mesh, report) = s.refined(|_| {});
        assert_same_topology(&s.mesh, &mesh, &report, "gyroid");
        assert_within(&mesh, s.settings.border.unwrap());
        if let Some(extractor) = crate::common::extractor() {
            let on_gpu = isoforge::gpu::GpuMesh::upload(extractor.gpu(), &s.mesh).unwrap();
            let (on_gpu, _) = extractor.refine(&s.surface, &on_gpu, &s.settings, &|_| {}).unwrap();
            assert_within(&on_gpu.read(extractor.gpu()).unwrap(), s.settings.border.unwrap());
        }
    }
}

/// The same bytes on one thread and on two.
#[test]
fn any_number_of_threads() {
    let field = graph(&kugeldiff());
    let s = start(&field, 0.0, cube(30, 1.3));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| s.refined(|_| {}).0)
    };
    let (one, two) = (on(1), on(2));
    assert!(one == two && one.triangles.len() > s.mesh.triangles.len());
}

/// A mesh on a sheared grid has no border that is known.
#[test]
fn a_sheared_grid() {
    let step = glam::Mat3::from_cols(Vec3::X * 0.2, Vec3::new(0.1, 0.2, 0.0), Vec3::Z * 0.2);
    let grid = Grid::new([20; 3], Vec3::new(-3.0, -2.0, -2.0), step).unwrap();
    let ball = graph(&sphere(1.0));
    let s = start(&ball, 0.0, grid);
    assert!(s.settings.border.is_none());
    let (mesh, report) = s.refined(|s| s.flatness = 0.999);
    assert_same_topology(&s.mesh, &mesh, &report, "sheared");
    // Slivers where the surface passes a grid point may be in the way of a few.
    assert!(report.projected * 1000 > mesh.vertices.len() as u64 * 999, "{report:?}");
}
