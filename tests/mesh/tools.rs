//! Welding, components, smoothing.

use glam::Vec3;
use isoforge::mesh::{Least, Mesh, SmoothError, Taubin, triangles_of_strip};
use proptest::prelude::*;

use crate::common::Random;
use crate::extracted::{named, noise, soup, ties};
use crate::shapes::{both, cube, mesh, tetrahedron, torus};

/// The shortest edge.
fn shortest(mesh: &Mesh) -> f32 {
    let at = |v: u32| mesh.vertices[v as usize].at();
    let sides = mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    sides.map(|(a, b)| at(a).distance(at(b))).fold(f32::MAX, f32::min)
}

#[test]
fn a_shaken_soup_is_welded_into_the_mesh() {
    let mut random = Random(1);
    for whole in [torus(40, 24), named("octahedron", 17), both(&cube(), &torus(9, 7), [7.0; 3])] {
        let distance = shortest(&whole) * 0.4;
        for shake in [0.0, distance * 0.49] {
            let mut soup = soup(&whole, shake, &mut random);
            let removed = soup.weld_within(distance).unwrap();
            let (new, old) = (soup.check(), whole.check());
            assert_eq!(removed.vertices, 3 * whole.triangles.len() - whole.vertices.len());
            assert_eq!(removed.triangles, 0);
            assert_eq!(
                (new.vertices, new.triangles, new.components, new.euler, new.genus, new.is_closed_manifold()),
                (old.vertices, old.triangles, old.components, old.euler, old.genus, true)
            );
            // Vertices are numbered by first use: the same as the mesh's, renamed.
            let mut name = vec![None; whole.vertices.len()];
            for (old, new) in whole.triangles.as_flattened().iter().zip(soup.triangles.as_flattened()) {
                assert_eq!(*name[*old as usize].get_or_insert(*new), *new);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Against a search through all vertices.
    #[test]
    fn welding_as_by_search(seed in any::<u64>(), count in 0usize..80, scale in -20i32..20, far in any::<bool>()) {
        let (mut random, scale) = (Random(seed), (scale as f32).exp2());
        let offset = if far { 1e4 * scale } else { 0.0 };
        let positions: Vec<[f32; 3]> =
            (0..count).map(|_| ((random.in_ball() * 3.0).round() * 0.5 * scale + random.in_ball() * 0.3 * scale + offset).to_array()).collect();
        let distance = 0.4 * scale;
        let mut kept: Vec<Vec3> = Vec::new();
        for p in positions.iter().map(|p| Vec3::from(*p)) {
            if kept.iter().all(|k| k.as_dvec3().distance(p.as_dvec3()) > f64::from(distance)) {
                kept.push(p);
            }
        }
        let mut welded = mesh(&positions, &[]);
        welded.weld_within(distance).unwrap();
        prop_assert_eq!(welded.vertices.iter().map(|v| v.at()).collect::<Vec<_>>(), kept);
    }
}

#[test]
fn welding_takes_any_vertices_and_refuses_bad_distances() {
    let far = [f32::MAX, -f32::MAX, 1.0e-40];
    let mut odd = mesh(
        &[far, far, [f32::NAN; 3], [f32::NAN; 3], [f32::INFINITY; 3], [0.0; 3], [-0.0; 3]],
        &[[0, 1, 2], [0, 5, 2]],
    );
    odd.weld_within(f32::MIN_POSITIVE).unwrap();
    assert_eq!((odd.vertices.len(), &odd.triangles[..]), (5, &[[0, 4, 1]][..]));
    for distance in [-1.0, f32::NAN, f32::INFINITY] {
        let before = cube();
        let mut mesh = before.clone();
        let error = mesh.weld_within(distance).unwrap_err().to_string();
        assert!(error.contains("zero or more") && mesh == before, "{error}");
    }
}

#[test]
fn small_components_go_and_the_largest_stays() {
    let parts = both(&both(&torus(20, 12), &cube(), [9.0; 3]), &tetrahedron(), [-9.0; 3]);
    let found = parts.components();
    let sizes: Vec<usize> = found.components.iter().map(|c| c.triangles).collect();
    assert_eq!(sizes, [480, 12, 4]);
    assert!((found.components[1].volume - 1.0).abs() < 1e-6 && (found.components[1].area - 6.0).abs() < 1e-6);
    assert_eq!(
        (found.of_triangle[479], found.of_triangle[480], found.of_triangle[495]),
        (Some(0), Some(1), Some(2))
    );
    let left = |least| {
        let mut mesh = parts.clone();
        let removed = mesh.remove_below(least);
        assert_eq!(mesh.triangles.len() + removed.triangles, parts.triangles.len());
        let r = mesh.check();
        assert!(r.is_closed_manifold() && r.unused_vertices == 0);
        r.triangles
    };
    assert_eq!(left(Least::Triangles(0)), 496);
    assert_eq!(left(Least::Triangles(5)), 492);
    assert_eq!(left(Least::Triangles(12)), 492);
    assert_eq!(left(Least::Triangles(13)), 480);
    assert_eq!(left(Least::Triangles(usize::MAX)), 480);
    let [large, middle, small] = [0, 1, 2].map(|i| found.components[i]);
    assert_eq!(left(Least::Area(1.01 * small.area / large.area)), 492);
    assert_eq!(left(Least::Volume(1.01 * middle.volume / large.volume)), 480);
    assert_eq!(left(Least::Volume(1.0)), 480);

    // Of equals the first; a bad index is in no component.
    let mut twins = both(&cube(), &cube(), [3.0; 3]);
    twins.triangles.push([0, 1, 99]);
    assert_eq!(twins.remove_below(Least::Area(2.0)).triangles, 13);
    assert_eq!(twins, cube());
    let mut none = Mesh::default();
    none.remove_below(Least::Volume(0.5));
    assert_eq!(none, Mesh::default());
}

#[test]
fn what_is_broken_goes() {
    let mut wild = cube();
    wild.triangles.push([0, 1, 8]);
    wild.triangles.push([0, 1, 99]);
    wild.vertices.push(wild.vertices[0]);
    wild.vertices[8].position[2] = f32::NAN;
    let removed = wild.remove_broken();
    assert_eq!((removed.triangles, removed.vertices), (2, 1));
    assert_eq!(wild, cube());
}

/// The mean of |vertex − mean of its neighbours|.
fn roughness(mesh: &Mesh) -> f64 {
    let mut sums = vec![(Vec3::ZERO, 0.0f32); mesh.vertices.len()];
    for &[a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)] {
            sums[from as usize].0 += mesh.vertices[to as usize].at();
            sums[from as usize].1 += 1.0;
        }
    }
    let each = mesh.vertices.iter().zip(sums).filter(|(_, (_, n))| *n > 0.0);
    each.map(|(v, (sum, n))| f64::from(v.at().distance(sum / n))).sum::<f64>() / mesh.vertices.len() as f64
}

fn shaken(mut mesh: Mesh, by: f32) -> Mesh {
    let mut random = Random(5);
    for v in &mut mesh.vertices {
        v.position = (v.at() + by * random.in_ball()).to_array();
    }
    mesh
}

#[test]
fn smoothing_keeps_the_volume_of_spheres() {
    let sphere = named("sphere", 32);
    for (mesh, iterations, bound) in
        [(sphere.clone(), 10, 5e-3), (sphere.clone(), 100, 4e-2), (shaken(sphere.clone(), 0.03), 20, 1e-2)]
    {
        let mut smooth = mesh.clone();
        smooth.smooth(&Taubin { iterations, ..Taubin::default() }, &|_| {}).unwrap();
        let (before, after) = (mesh.check(), smooth.check());
        let change = (after.volume - before.volume).abs() / before.volume;
        println!(
            "{iterations}: volume by {change:.2e}, roughness {:.5} to {:.5}",
            roughness(&mesh),
            roughness(&smooth)
        );
        assert!(change < bound, "{iterations} iterations change the volume by {change}");
        assert!(after.is_closed_manifold() && smooth.triangles == mesh.triangles);
        for v in &smooth.vertices {
            let normal = Vec3::from(v.normal);
            assert!((normal.length() - 1.0).abs() < 1e-5 && normal.dot(v.at()) > 0.0);
        }
    }
    let rough = shaken(sphere, 0.03);
    let mut smooth = rough.clone();
    let mut told = Vec::new();
    let note = std::cell::RefCell::new(&mut told);
    smooth
        .smooth(&Taubin { iterations: 20, ..Taubin::default() }, &|part| note.borrow_mut().push(part))
        .unwrap();
    assert!(roughness(&smooth) < 0.35 * roughness(&rough));
    assert_eq!((told.len(), told[19]), (20, 1.0));
}

#[test]
fn smoothing_leaves_borders_and_the_lost_alone() {
    let mut open = shaken(named("gyroid", 16), 0.02);
    let loose = open.vertices.len();
    open.vertices.push(open.vertices[0]);
    let inner = open.triangles[0][0];
    open.vertices.push(isoforge::mesh::Vertex { position: [f32::NAN; 3], normal: [0.0; 3] });
    open.triangles.push([inner, loose as u32 + 1, inner + 1]);
    open.triangles.push([0, 0, 1]);
    open.triangles.push([0, 1, 99_999]);
    let mut on_border = vec![0; open.vertices.len()];
    let mut sides = std::collections::HashMap::new();
    for &[a, b, c] in open.triangles.iter().take(open.triangles.len() - 3) {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *sides.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    for (&(a, b), _) in sides.iter().filter(|(_, n)| **n == 1) {
        (on_border[a as usize], on_border[b as usize]) = (1, 1);
    }
    let mut smooth = open.clone();
    smooth.smooth(&Taubin::default(), &|_| {}).unwrap();
    let moved: Vec<bool> =
        (0..loose).map(|v| smooth.vertices[v].position != open.vertices[v].position).collect();
    assert!((0..loose).all(|v| on_border[v] == 0 || !moved[v]));
    assert!(moved.iter().filter(|moved| **moved).count() > loose * 9 / 10 - on_border.iter().sum::<usize>());
    assert_eq!(smooth.vertices[loose].position, open.vertices[loose].position);
    assert!(smooth.vertices[..loose].iter().all(|v| v.at().is_finite()));
    let mut same = open.clone();
    same.smooth(&Taubin { iterations: 0, ..Taubin::default() }, &|_| {}).unwrap();
    assert_eq!(same.triangles, open.triangles);
    for (lambda, mu) in [(0.0, -0.5), (0.5, -0.4), (0.5, 0.5), (1.5, -1.6), (f64::NAN, -0.5), (0.5, f64::NAN)]
    {
        let settings = Taubin { lambda, mu, ..Taubin::default() };
        assert!(matches!(same.smooth(&settings, &|_| {}), Err(SmoothError { .. })), "{lambda} {mu}");
    }
}

#[test]
fn the_result_depends_on_no_number_of_threads() {
    let rough = shaken(named("torus", 40), 0.02);
    let smooth = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut mesh = rough.clone();
        pool.install(|| mesh.smooth(&Taubin::default(), &|_| {}).unwrap());
        mesh
    };
    assert!(smooth(1) == smooth(3));
}

/// What a file of triangles and a weld make of a surface: it may touch itself at places where vertices were apart.
#[test]
fn repaired_welds_are_closed_manifolds() {
    // Two cubes that share a vertex, two that share an edge, and a cube with a sheet in it.
    let corner = both(&cube(), &cube(), [1.0; 3]);
    let edge = both(&cube(), &cube(), [1.0, 1.0, 0.0]);
    let mut sheet = cube();
    sheet.triangles.extend([[0, 3, 5], [0, 5, 3], [1, 1, 2]]);
    // A triangle three times, and a whole cube twice, which are two that touch.
    let mut thrice = cube();
    let [a, b, c] = thrice.triangles[4];
    thrice.triangles.extend([[b, c, a], [a, b, c]]);
    let twice = both(&cube(), &cube(), [0.0; 3]);
    for (mut mesh, components, triangles) in
        [(corner, 2, 24), (edge, 2, 24), (sheet, 1, 12), (thrice, 1, 12), (twice, 2, 24)]
    {
        mesh.weld();
        assert!(!mesh.check().is_closed_manifold());
        let places: Vec<_> = mesh.vertices.iter().map(|v| v.position).collect();
        mesh.repair();
        let r = mesh.check();
        assert!(r.is_closed_manifold() && !r.has_defects(), "{r}");
        assert_eq!((r.components, r.triangles, r.unused_vertices), (components, triangles, 0));
        assert!(mesh.vertices.iter().all(|v| places.contains(&v.position)));
        let again = mesh.clone();
        assert_eq!(mesh.repair(), Default::default());
        assert_eq!(mesh, again);
    }
    // What opens: the border of a triangle that is wound against its neighbours, and the third at an edge.
    let mut turned = cube();
    turned.triangles[0].swap(0, 1);
    turned.repair();
    let r = turned.check();
    assert_eq!((r.misoriented_edges, r.non_manifold_edges, r.components, r.boundary_edges), (0, 0, 2, 6));
    let mut third = cube();
    third.vertices.push(third.vertices[0]);
    third.vertices[8].position = [-1.0; 3];
    third.triangles.push([third.triangles[0][0], third.triangles[0][1], 8]);
    third.triangles.push([0, 1, 77]);
    third.repair();
    let r = third.check();
    assert_eq!(
        (r.non_manifold_edges, r.non_manifold_vertices, r.bad_indices, r.boundary_edges),
        (0, 0, 0, 3)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Samples equal to iso put many vertices on one place, which a weld makes one.
    #[test]
    fn repaired_ties_are_manifolds(n in 3u32..8, seed in any::<u64>()) {
        let mut mesh = ties(n, seed);
        let before = mesh.check();
        mesh.weld_within(0.0).unwrap();
        mesh.repair();
        let r = mesh.check();
        prop_assert_eq!((r.boundary_edges, r.misoriented_edges, r.degenerate_triangles), (0, 0, 0), "{}", r);
        prop_assert_eq!((r.non_manifold_edges, r.non_manifold_vertices, r.duplicate_triangles), (0, 0, 0), "{}", r);
        prop_assert!((r.volume - before.volume).abs() < 1e-6);
    }
}

#[test]
fn strips_by_hand() {
    assert_eq!(triangles_of_strip(&[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(triangles_of_strip(&[0, 1, 2, 2, 5, 5, 4, 3]), [[0, 1, 2], [4, 5, 3]]);
    assert!(triangles_of_strip(&[0, 1]).is_empty() && triangles_of_strip(&[]).is_empty());
}

#[test]
fn cache_misses_by_hand() {
    assert_eq!(Mesh::default().cache_misses(), 0.0);
    assert_eq!(tetrahedron().cache_misses(), 1.0);
    // No vertex twice.
    assert_eq!(soup(&noise(4, 3, true), 0.0, &mut Random(0)).cache_misses(), 3.0);
}
