//! The methods that promise the interpolant's topology, against the oracle: 10,000 grids a kind, on both backends, none
//! excepted but the singular ones.

use crate::common;
use crate::count::{Count, count};
use crate::exact::Cell;
use crate::grids::Kind;
use crate::packed::Packed;
use crate::topology::{Small, topology};
use isoforge::extract::{Method, Options, Source, extract_on_cpu};
use isoforge::mesh::Mesh;
use rayon::prelude::*;
use std::fmt::Write as _;

/// The methods whose pieces are those of the trilinear interpolant.
pub const EXACT: [Method; 1] = [Method::Mc33];

/// Points along each axis of the grids, and how many volumes of [`PACK`] of them there are: 10,000 grids.
const SIZES: [(usize, u64); 5] = [(5, 10), (6, 5), (7, 3), (8, 1), (9, 1)];
const PACK: u64 = 500;

/// The mesh of each backend that there is.
pub fn meshes(volume: &Packed, options: &Options) -> Vec<(&'static str, Mesh)> {
    let source = Source::Volume(&volume.volume);
    let mut all = vec![("CPU", extract_on_cpu(&source, options, &|_| {}).unwrap().0)];
    if let Some(extractor) = common::extractor() {
        let found = extractor.extract(&source, options).unwrap();
        all.push(("GPU", found.mesh.read(extractor.gpu()).unwrap()));
    }
    all
}

/// The pieces of each of the grids in a volume.
pub fn pieces(packed: &Packed, grids: usize, mesh: &Mesh, count: &Count) -> Vec<Vec<i64>> {
    let mut all = vec![Vec::new(); grids];
    for (vertex, euler) in &count.pieces {
        all[packed.grid_at(mesh.vertices[*vertex as usize].position)].push(*euler);
    }
    all.iter_mut().for_each(|pieces| pieces.sort_unstable());
    all
}

/// The cells of a grid that are wrong by themselves.
fn blame(kind: Kind, n: usize, seed: u64, method: Method) -> String {
    let grid = kind.grid(n, seed);
    let at = |x: usize, y: usize, z: usize| grid.values[x + grid.points * (y + grid.points * z)];
    let mut cells: Vec<Cell> = Vec::new();
    for (z, y, x) in (0..=n).flat_map(|z| (0..=n).flat_map(move |y| (0..=n).map(move |x| (z, y, x)))) {
        cells.push([0, 1, 2, 3, 4, 5, 6, 7].map(|c| at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))));
    }
    let alone: Vec<Small> = cells.iter().map(Small::of_cell).collect();
    let packed = Packed::new(kind, &alone, seed);
    let mut text = String::new();
    for (backend, mesh) in meshes(&packed, &packed.options(method)) {
        let found = pieces(&packed, alone.len(), &mesh, &count(mesh.vertices.len(), &mesh.triangles));
        for (cell, found) in cells.iter().zip(found) {
            let Some(expected) = topology(&kind.differences(Small::of_cell(cell))) else { continue };
            if found != expected.pieces {
                writeln!(text, "  {backend}: {cell:?} alone has {found:?}, not {expected:?}").unwrap();
            }
        }
    }
    text
}

/// A grid that a mesh is not like: which, and how.
struct Wrong {
    kind: Kind,
    n: usize,
    seed: u64,
    method: Method,
    what: String,
}

/// What was compared.
#[derive(Debug, Default)]
struct Compared {
    grids: usize,
    singular: usize,
    pieces: usize,
    handles: usize,
}

/// Compares grids of one size, in one volume.
fn compare(kind: Kind, n: usize, seeds: &[u64], compared: &mut Compared, wrong: &mut Vec<Wrong>) {
    let grids: Vec<Small> = seeds.par_iter().map(|seed| kind.grid(n, *seed)).collect();
    let packed = Packed::new(kind, &grids, seeds[0]);
    let expected: Vec<_> = grids.into_par_iter().map(|grid| topology(&kind.differences(grid))).collect();
    compared.singular += expected.iter().filter(|topology| topology.is_none()).count();
    for topology in expected.iter().flatten() {
        compared.grids += 1;
        compared.pieces += topology.pieces.len();
        compared.handles += topology.betti()[1] as usize / 2;
    }
    for method in EXACT {
        let mut before: Option<Vec<[u32; 3]>> = None;
        for (backend, mesh) in meshes(&packed, &packed.options(method)) {
            // Where a backend has the triangles of the other, it has been judged.
            if before.as_ref().is_some_and(|before| *before == mesh.triangles) {
                continue;
            }
            let count = count(mesh.vertices.len(), &mesh.triangles);
            let sound = count.is_closed_by_edge() && count.non_manifold_vertices == 0;
            assert!(sound, "{method:?} {backend}, {kind:?} {n}³ {}", seeds[0]);
            for (i, found) in pieces(&packed, seeds.len(), &mesh, &count).into_iter().enumerate() {
                if let Some(expected) = &expected[i]
                    && expected.pieces != found
                {
                    let what = format!("{backend}: {found:?}, not {:?}", expected.pieces);
                    wrong.push(Wrong { kind, n, seed: seeds[i], method, what });
                }
            }
            before = Some(mesh.triangles);
        }
    }
}

/// Compares 10,000 grids of these kinds, by turns.
///
/// Goes red when `joins_inside` (`src/stage/trilinear.rs`) is turned round, when `tunnel` finds none or asks for no real
/// roots, and `adversarial` alone when `sum` (`shaders/shared/trilinear.wgsl`) loses its carry.
fn as_the_oracle_says(kinds: &[Kind]) {
    let (mut compared, mut wrong) = (Compared::default(), Vec::new());
    let packs = SIZES.into_iter().flat_map(|(n, packs)| (0..packs).map(move |_| n));
    for (pack, n) in (0u64..).zip(packs) {
        let seeds: Vec<u64> = (0..PACK).map(|i| pack * PACK + i).collect();
        compare(kinds[pack as usize % kinds.len()], n, &seeds, &mut compared, &mut wrong);
    }
    eprintln!("{kinds:?}: {compared:?}");
    let mut text = String::new();
    for Wrong { kind, n, seed, method, what } in wrong.iter().take(5) {
        writeln!(text, "{method:?}, {kind:?} {n}³ {seed}: {what}").unwrap();
        text += &blame(*kind, *n, *seed, *method);
    }
    assert!(wrong.is_empty(), "{kinds:?}: {} grids are wrong:\n{text}", wrong.len());
    // Few enough that hardly anything is left out.
    assert!(
        compared.singular <= 100 && compared.singular + compared.grids == 10_000,
        "{kinds:?}: {compared:?}"
    );
}

#[test]
fn uniform() {
    as_the_oracle_says(&[Kind::Uniform]);
}

#[test]
fn integers() {
    as_the_oracle_says(&[Kind::Integers]);
}

#[test]
fn ties() {
    as_the_oracle_says(&[Kind::Ties]);
}

#[test]
fn adversarial() {
    use Kind::{Alternating, Brink, Near, Rounded, Sizes, Turns};
    as_the_oracle_says(&[Near, Alternating, Turns, Sizes, Brink, Rounded]);
}
