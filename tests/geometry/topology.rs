//! Closed, manifold by edge and by vertex, consistently wound: always, whatever the samples.

use crate::common::{self, Random};
use crate::meshes;
use glam::{Mat3, Vec3};
use isoforge::extract::{Options, Source};
use isoforge::field::Sense;
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::volume::Volume;
use proptest::prelude::*;

/// A volume whose outermost samples are outside, so that its surface has no reason to be open.
fn padded(grid: Grid, seed: u64, value: impl Fn(&mut Random) -> f32, outside: f32) -> Volume {
    let mut random = Random(seed);
    let n = grid.points().to_array().map(u64::from);
    let values = (0..grid.point_count())
        .map(|i| {
            let at = [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
            let border = (0..3).any(|axis| at[axis] == 0 || at[axis] + 1 == n[axis]);
            if border { outside } else { value(&mut random) }
        })
        .collect();
    Volume::new(grid, values).unwrap()
}

fn assert_closed(mesh: &Mesh, name: &str) {
    let report = mesh.check();
    let open = [
        report.boundary_edges,
        report.non_manifold_edges,
        report.misoriented_edges,
        report.non_manifold_vertices,
        report.bad_indices,
        report.non_finite_vertices,
        report.unused_vertices,
        report.duplicate_triangles,
    ];
    assert_eq!(open, [0; 8], "{name}: {report}");
    assert!(mesh.triangles.is_empty() || report.volume > 0.0, "{name}: {report}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn random_volumes_are_closed(
        cells in prop::array::uniform3(2u32..24),
        seed in any::<u64>(),
        odd in any::<bool>(),
        mirrored in any::<bool>(),
    ) {
        let step = Mat3::from_diagonal(Vec3::new(if mirrored { -0.5 } else { 0.5 }, 1.0, 0.8));
        let grid = Grid::new(cells, Vec3::ZERO, step).unwrap();
        let value = |random: &mut Random| match random.next() % 12 {
            0 if odd => f32::NAN,
            1 if odd => f32::INFINITY,
            _ => random.unit() - 0.4,
        };
        let volume = padded(grid, seed, value, -1.0);
        for mesh in meshes(&Source::Volume(&volume), &Options::new(0.0)) {
            assert_closed(&mesh, &format!("{cells:?} {seed}"));
        }
    }
}

#[test]
fn padding_by_what_is_not_finite_closes_too() {
    let grid = Grid::new([11, 9, 17], Vec3::ZERO, Mat3::IDENTITY).unwrap();
    for outside in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let volume = padded(grid, 4, |random| random.unit(), outside);
        for sense in [Sense::Below, Sense::Above] {
            let options = Options { sense: Some(sense), ..Options::new(0.5) };
            for mesh in meshes(&Source::Volume(&volume), &options) {
                assert!(!mesh.triangles.is_empty());
                assert_closed(&mesh, &format!("{outside} {sense:?}"));
            }
        }
    }
}

/// Where samples equal iso, triangles without area appear; they are counted, and can be taken out.
#[test]
fn ties_leave_degenerate_triangles_that_can_be_removed() {
    let grid = Grid::new([17, 16, 9], Vec3::ZERO, Mat3::from_diagonal(Vec3::new(1.0, 2.0, 0.5))).unwrap();
    for seed in 0..6 {
        let volume = padded(grid, seed, |random| (random.next() % 4) as f32, 0.0);
        for iso in [0.0, 1.0, 2.0] {
            for mut mesh in meshes(&Source::Volume(&volume), &Options::new(iso)) {
                assert_closed(&mesh, "ties");
                let before = mesh.check();
                assert!(before.degenerate_triangles > 0, "iso {iso}");
                assert_eq!(before.degenerate_triangles, mesh.degenerate_count());
                mesh.remove_degenerate();
                assert_closed(&mesh, "ties removed");
                let after = mesh.check();
                assert_eq!(after.degenerate_triangles, 0, "iso {iso}: {after}");
                assert!((after.volume - before.volume).abs() < 1e-6 * before.volume, "iso {iso}");
            }
        }
    }
}

/// Boxes of samples that are whole, so that every vertex is known.
#[test]
fn one_point_makes_an_octahedron() {
    let grid = Grid::new([16, 16, 16], Vec3::ZERO, Mat3::IDENTITY).unwrap();
    // In a brick, and at borders of bricks: face, edge, corner.
    for at in [[3, 4, 5], [8, 4, 5], [7, 8, 3], [8, 8, 8], [7, 7, 7], [15, 8, 1], [1, 1, 1]] {
        let point = Vec3::from(at.map(|v| v as f32));
        let volume = common::sampled(grid, |p| if p == point { 1.0 } else { -1.0 });
        for mesh in meshes(&Source::Volume(&volume), &Options::new(0.0)) {
            let report = mesh.check();
            assert!(report.is_closed_manifold() && report.euler == 2, "{at:?}: {report}");
            assert_eq!((report.vertices, report.triangles), (6, 8), "{at:?}");
            assert!((report.volume - 4.0 / 3.0 * 0.125).abs() < 1e-9, "{at:?}: {report}");
            assert!(mesh.vertices.iter().all(|v| Vec3::from(v.normal).dot(v.at() - point) > 0.0));
        }
    }
}

#[test]
fn real_volumes_are_sound() {
    let mut all = vec![("brain_24", common::small_brain(), 34.0)];
    all.extend(common::large_volumes());
    for (name, volume, iso) in all {
        for mut mesh in meshes(&Source::Volume(&volume), &Options::new(iso)) {
            let report = mesh.check();
            let wrong = [
                report.non_manifold_edges,
                report.misoriented_edges,
                report.non_manifold_vertices,
                report.bad_indices,
                report.non_finite_vertices,
                report.unused_vertices,
                report.duplicate_triangles,
            ];
            assert_eq!(wrong, [0; 7], "{name}: {report}");
            assert!(mesh.vertices.iter().all(|v| (Vec3::from(v.normal).length() - 1.0).abs() < 1e-5));
            mesh.remove_degenerate();
            let after = mesh.check();
            assert_eq!([after.degenerate_triangles, after.misoriented_edges], [0; 2], "{name}: {after}");
            assert!((after.volume - report.volume).abs() <= 1e-6 * report.volume.abs(), "{name}");
        }
    }
}
