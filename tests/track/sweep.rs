//! The tracked components are those of the sweep, byte for byte and in its order.

use crate::common::{Random, noise};
use crate::{assert_same, balls, components, grid, only};
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::Closure;
use isoforge::field::Sense;
use isoforge::mesh::Mesh;
use isoforge::track::{Seeds, track};
use std::collections::BTreeSet;

const SIZES: [[u32; 3]; 6] =
    [[40, 40, 40], [64, 17, 33], [9, 70, 16], [23, 24, 25], [8, 8, 100], [50, 3, 60]];

/// Seeds on some vertices of the sweep, and beside them: what is tracked are whole components, those of the vertices among them,
/// and none that does not come near a seed.
fn check_seeds(name: &str, source: &Source<'_>, options: &Options, random: &mut Random) -> usize {
    let (sweep, _) = extract_on_cpu(source, options, &|_| {}).expect("a mesh");
    if sweep.vertices.is_empty() {
        return 0;
    }
    let labels = components(&sweep);
    let step = source.grid().step();
    let chosen: Vec<usize> = (0..2).map(|_| random.next() as usize % labels.len()).collect();
    let points: Vec<Vec3> = chosen.iter().map(|&v| sweep.vertices[v].at()).collect();
    let seeds = Seeds { points: points.clone(), ..Seeds::default() };
    let (mesh, report, told) = track(source, options, &seeds, &|_| {}).expect("a mesh");
    assert!(told.missed.is_empty(), "{name}: {:?}", told.missed);
    assert_eq!(
        [report.vertices, report.triangles],
        [mesh.vertices.len() as u64, mesh.triangles.len() as u64]
    );

    // Which of the sweep's components these are: vertices of different components may lie at one place.
    let inverse = step.inverse();
    let cell_of = |p: Vec3| inverse * (p - source.grid().origin());
    let near = |p: Vec3, q: Vec3| (cell_of(p) - cell_of(q)).abs().max_element() <= 1.01;
    let may: BTreeSet<usize> = (0..labels.len())
        .filter(|&v| points.iter().any(|&p| near(p, sweep.vertices[v].at())))
        .map(|v| labels[v])
        .collect();
    let must: BTreeSet<usize> = chosen.iter().map(|&v| labels[v]).collect();
    // Few may: try what of them explains the mesh.
    let extra: Vec<usize> = may.difference(&must).copied().collect();
    assert!(extra.len() < 12, "{name}: too many components near a seed for this test");
    let explained = (0..1u32 << extra.len()).any(|some| {
        let mut kept = must.clone();
        kept.extend(extra.iter().enumerate().filter(|(i, _)| some >> i & 1 == 1).map(|(_, &label)| label));
        same(&only(&sweep, &labels, &kept), &mesh)
    });
    assert!(explained, "{name}: {} triangles of {}", mesh.triangles.len(), sweep.triangles.len());
    usize::from(mesh.triangles.len() < sweep.triangles.len())
}

fn same(a: &Mesh, b: &Mesh) -> bool {
    a.triangles == b.triangles
        && bytemuck::cast_slice::<_, u8>(&a.vertices) == bytemuck::cast_slice::<_, u8>(&b.vertices)
}

/// Goes red when `spread` (src/track/cpu.rs) leaves out a way or looks at the 8th points for the 9th, when components are
/// kept that hold no seed, and when `Nearby` looks for a layer's
/// neighbours one brick too far.
#[test]
fn some_components_of_random_balls() {
    let mut parts = 0;
    for i in 0..24 {
        let mut random = Random(i);
        let (_, field) = balls(&mut random, 25, 0.13);
        let grid = grid(i, SIZES[i as usize % SIZES.len()]);
        let options = Options { cull: i % 3 != 0, ..Options::new(0.0) };
        parts += check_seeds(&format!("balls {i}"), &Source::Field(&field, grid), &options, &mut random);
    }
    assert!(parts > 12, "most scenes have components apart: {parts}");
}

/// Random volumes: components of a few triangles side by side, ties, NaN and infinities.
#[test]
fn some_components_of_random_volumes() {
    let mut parts = 0;
    for i in 0..18 {
        let mut random = Random(100 + i);
        let volume = noise(grid(i, [[12, 9, 17], [8, 8, 8], [30, 5, 9]][i as usize % 3]), i);
        let iso = [0.0, 0.45, -0.3][i as usize / 3 % 3];
        let options =
            Options { sense: Some([Sense::Above, Sense::Below][i as usize % 2]), ..Options::new(iso) };
        parts += check_seeds(&format!("volume {i}"), &Source::Volume(&volume), &options, &mut random);
    }
    assert!(parts > 3, "some volumes have components apart: {parts}");
}

/// All of the surface, found by every way there is, is the sweep's mesh byte for byte.
#[test]
fn all_of_it() {
    let mut random = Random(7);
    let (places, balls) = balls(&mut random, 30, 0.12);
    let plain = Closure::new(Sense::Below, move |p: Vec3| {
        places.iter().map(|(c, r)| (p - *c).length() - r).fold(f32::INFINITY, f32::min)
    });
    for (i, cells) in (0..).zip(SIZES) {
        let grid = grid(i, cells);
        let volume = noise(grid, i);
        for (kind, source) in [
            ("balls", Source::Field(&balls, grid)),
            ("closure", Source::Field(&plain, grid)),
            ("volume", Source::Volume(&volume)),
        ] {
            let options = Options::new(0.0);
            let (sweep, of_sweep) = extract_on_cpu(&source, &options, &|_| {}).expect("a mesh");
            for seeds in [
                Seeds { coarse: Some(1), ..Seeds::default() },
                Seeds { search: Some(1), ..Seeds::default() },
                Seeds { points: vec![Vec3::splat(0.5)], coarse: Some(1), search: Some(8) },
            ] {
                let name = format!("{kind}, {cells:?}, {seeds:?}");
                let (mesh, report, told) = track(&source, &options, &seeds, &|_| {}).expect("a mesh");
                assert_same(&name, &mesh, &sweep);
                assert_eq!(report.triangles, of_sweep.triangles);
                assert!(told.search.is_none_or(|s| s.cells > 1 || s.is_complete()), "{name}: {told:?}");
            }
        }
    }
}

/// Threads change nothing: neither the bytes nor what is told.
#[test]
fn any_number_of_threads() {
    let mut random = Random(5);
    let (_, field) = balls(&mut random, 30, 0.15);
    let source = Source::Field(&field, grid(0, [50, 60, 70]));
    let seeds = Seeds { points: vec![Vec3::splat(0.5), Vec3::ZERO], ..Seeds::default() };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let (mesh, _, told) =
            pool.install(|| track(&source, &Options::new(0.0), &seeds, &|_| {})).expect("a mesh");
        (mesh, told)
    };
    let (one, told) = with(1);
    for threads in [2, 5] {
        let (other, others) = with(threads);
        assert_same("threads", &other, &one);
        assert_eq!(told, others);
    }
}
