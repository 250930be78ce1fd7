//! One vertex on every crossed grid edge, and none elsewhere; counted and placed here once more, from the
//! samples alone.

use crate::common::{self, Random, noise};
use crate::{meshes, on_cpu};
use glam::{DMat3, Mat3, Vec3};
use isoforge::extract::{Options, Source};
use isoforge::field::Sense;
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::volume::Volume;
use std::collections::HashSet;

/// A grid edge: its lower point, and its axis.
type Edge = ([u32; 3], usize);

fn value(volume: &Volume, [x, y, z]: [u32; 3]) -> f32 {
    let n = volume.grid().points();
    volume.values().get(x as usize + n.x as usize * (y as usize + n.y as usize * z as usize))
}

fn is_inside(value: f32, iso: f32, sense: Sense) -> bool {
    value.is_finite()
        && match sense {
            Sense::Below => value < iso,
            Sense::Above => value > iso,
        }
}

fn crossed_edges(volume: &Volume, iso: f32, sense: Sense) -> HashSet<Edge> {
    let n = volume.grid().points().to_array();
    let mut found = HashSet::new();
    for z in 0..n[2] {
        for y in 0..n[1] {
            for x in 0..n[0] {
                let at = is_inside(value(volume, [x, y, z]), iso, sense);
                for axis in 0..3 {
                    let mut next = [x, y, z];
                    next[axis] += 1;
                    if next[axis] < n[axis] && is_inside(value(volume, next), iso, sense) != at {
                        found.insert(([x, y, z], axis));
                    }
                }
            }
        }
    }
    found
}

/// The crossed edge that a vertex lies on, and how far along; `None` where it lies on none.
fn edge_of(grid: &Grid, inverse: DMat3, position: Vec3, crossed: &HashSet<Edge>) -> Option<(Edge, f64)> {
    let q = inverse * (position.as_dvec3() - grid.origin().as_dvec3());
    let near = |v: f64| (v - v.round()).abs() < 2e-3;
    // A vertex at a point may be on any of its edges; of those, on the crossed ones.
    for axis in 0..3 {
        if (0..3).all(|other| other == axis || near(q[other])) {
            for along in [q[axis].floor(), q[axis].round(), q[axis].round() - 1.0] {
                let mut low = q.round();
                low[axis] = along;
                let t = q[axis] - along;
                if low.min_element() < 0.0 || !(-2e-3..=1.002).contains(&t) {
                    continue;
                }
                let edge = (low.as_uvec3().to_array(), axis);
                if crossed.contains(&edge) {
                    return Some((edge, t));
                }
            }
        }
    }
    None
}

fn check(volume: &Volume, iso: f32, sense: Sense, mesh: &Mesh, name: &str) {
    let crossed = crossed_edges(volume, iso, sense);
    assert_eq!(mesh.vertices.len(), crossed.len(), "{name}: a vertex for every crossed edge");
    let inverse = volume.grid().step().as_dmat3().inverse();
    let mut met = HashSet::new();
    let mut ambiguous = 0;
    for vertex in &mesh.vertices {
        let normal = Vec3::from(vertex.normal);
        assert!(normal.is_finite() && (normal.length() - 1.0).abs() < 1e-5, "{name}: {vertex:?}");
        let Some(((low, axis), t)) = edge_of(volume.grid(), inverse, vertex.at(), &crossed) else {
            panic!("{name}: {vertex:?} lies on no crossed edge")
        };
        let mut high = low;
        high[axis] += 1;
        let [a, b] = [low, high].map(|p| f64::from(value(volume, p)));
        if !(0.01..=0.99).contains(&t) {
            // At a point, several edges meet.
            ambiguous += 1;
            continue;
        }
        assert!(met.insert((low, axis)), "{name}: two vertices on {low:?} along {axis}");
        let expected = if (a - b).is_finite() { (f64::from(iso) - a) / (b - a) } else { 0.5 };
        assert!((t - expected).abs() < 2e-3, "{name}: {vertex:?} at {t}, the crossing is at {expected}");
    }
    assert!(met.len() + ambiguous == crossed.len());
}

fn steps() -> [(&'static str, Mat3); 3] {
    let sheared =
        Mat3::from_cols(Vec3::new(0.5, 0.1, -0.05), Vec3::new(0.2, 0.7, 0.0), Vec3::new(-0.3, 0.25, 1.5));
    let mirrored = Mat3::from_diagonal(Vec3::new(0.3, -1.0, 2.7));
    [("plain", Mat3::IDENTITY), ("sheared", sheared), ("mirrored", mirrored)]
}

#[test]
fn every_crossed_edge_has_its_vertex() {
    let sizes = [[1, 1, 1], [8, 8, 8], [7, 9, 15], [16, 17, 1], [33, 4, 5]];
    for (i, cells) in sizes.into_iter().enumerate() {
        for (kind, step) in steps() {
            let grid = Grid::new(cells, Vec3::new(2.0, -1.0, 0.5), step).unwrap();
            let volume = noise(grid, 10 + i as u64);
            for sense in [Sense::Below, Sense::Above] {
                let options = Options { sense: Some(sense), ..Options::new(0.05) };
                for mesh in meshes(&Source::Volume(&volume), &options) {
                    check(&volume, 0.05, sense, &mesh, &format!("{cells:?} {kind} {sense:?}"));
                }
            }
        }
    }
}

#[test]
fn samples_equal_to_iso_are_outside() {
    let grid = Grid::new([9, 8, 7], Vec3::ZERO, Mat3::IDENTITY).unwrap();
    let mut random = Random(5);
    let values = (0..grid.point_count()).map(|_| (random.next() % 3) as f32).collect();
    let volume = Volume::new(grid, values).unwrap();
    for sense in [Sense::Below, Sense::Above] {
        for mesh in meshes(&Source::Volume(&volume), &Options { sense: Some(sense), ..Options::new(1.0) }) {
            check(&volume, 1.0, sense, &mesh, "ties");
            assert!(mesh.check().degenerate_triangles > 0);
        }
    }
}

#[test]
fn a_real_volume() {
    let volume = common::small_brain();
    for mesh in meshes(&Source::Volume(&volume), &Options::new(34.5)) {
        check(&volume, 34.5, Sense::Above, &mesh, "brain_24");
    }
}

/// Shear, scale and mirroring move the vertices of the plain grid and change nothing else but the winding.
#[test]
fn a_grid_in_space_is_the_plain_one_moved() {
    let cells = [13, 8, 17];
    let plain = noise(Grid::new(cells, Vec3::ZERO, Mat3::IDENTITY).unwrap(), 21);
    let base = on_cpu(&Source::Volume(&plain), &Options::new(0.0));
    for (kind, step) in steps() {
        let origin = Vec3::new(3.0, -7.0, 0.25);
        let grid = Grid::new(cells, origin, step).unwrap();
        let volume = Volume::new(grid, plain.values().to_f32()).unwrap();
        for mesh in meshes(&Source::Volume(&volume), &Options::new(0.0)) {
            for (vertex, moved) in base.vertices.iter().zip(&mesh.vertices) {
                let expected = origin.as_dvec3() + step.as_dmat3() * vertex.at().as_dvec3();
                assert!(expected.distance(moved.at().as_dvec3()) < 1e-5, "{kind}");
            }
            let wound = |[a, b, c]: [u32; 3]| if grid.is_mirrored() { [a, c, b] } else { [a, b, c] };
            let expected: Vec<_> = base.triangles.iter().copied().map(wound).collect();
            assert!(mesh.triangles == expected && mesh.vertices.len() == base.vertices.len(), "{kind}");
        }
    }
}

/// A cell of each case by itself: 8 samples, all 256 ways.
#[test]
fn one_cell_of_every_case() {
    let grid = Grid::new([1, 1, 1], Vec3::ZERO, Mat3::IDENTITY).unwrap();
    for case in 0..256u32 {
        let values = (0..8).map(|corner| if case >> corner & 1 == 1 { 1.0 } else { -0.5 }).collect();
        let volume = Volume::new(grid, values).unwrap();
        for mesh in meshes(&Source::Volume(&volume), &Options::new(0.0)) {
            check(&volume, 0.0, Sense::Above, &mesh, &format!("case {case}"));
            assert_eq!(mesh.triangles.is_empty(), case == 0 || case == 255);
            let used: HashSet<u32> = mesh.triangles.iter().flatten().copied().collect();
            assert_eq!(used.len(), mesh.vertices.len(), "case {case}");
        }
    }
}
