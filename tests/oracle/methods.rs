//! The methods that promise the interpolant's topology, against the oracle: 10,000 grids a kind, on both backends, none
//! excepted but the singular ones.

use crate::common;
use crate::count::{Count, count};
use crate::exact::Cell;
use crate::grids::{Kind, Packed, break_ties};
use crate::topology::{Small, Topology, topology};
use isoforge::extract::{Method, Options, Source, extract_on_cpu};
use isoforge::mesh::Mesh;
use rayon::prelude::*;
use std::fmt::Write as _;

/// The methods whose pieces are those of the trilinear interpolant.
const EXACT: [Method; 1] = [Method::Mc33];

/// Points along each axis of the grids, and how many volumes of [`PACK`] of them there are: 10,000 grids.
const SIZES: [(usize, u64); 5] = [(5, 8), (6, 5), (7, 3), (8, 2), (9, 2)];
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
fn pieces(packed: &Packed, grids: usize, mesh: &Mesh, count: &Count) -> Vec<Vec<i64>> {
    let mut all = vec![Vec::new(); grids];
    for (vertex, euler) in &count.pieces {
        all[packed.grid_at(mesh.vertices[*vertex as usize].position)].push(*euler);
    }
    all.iter_mut().for_each(|pieces| pieces.sort_unstable());
    all
}

/// The oracle's answer; ties are as good as outside.
fn expected(mut grid: Small) -> Option<Topology> {
    break_ties(&mut grid);
    topology(&grid)
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
            let Some(expected) = expected(Small::of_cell(cell)) else { continue };
            if found != expected.pieces {
                writeln!(text, "  {backend}: {cell:?} alone has {found:?}, not {expected:?}").unwrap();
            }
        }
    }
    text
}

fn as_the_oracle_says(kind: Kind) {
    let [mut singular, mut compared, mut all_pieces, mut handles] = [0; 4];
    let mut wrong = Vec::new();
    for (n, packs) in SIZES {
        for first in (0..packs).map(|pack| pack * PACK) {
            let seeds: Vec<u64> = (first..first + PACK).map(|seed| seed * 10 + n as u64).collect();
            let grids: Vec<Small> = seeds.iter().map(|seed| kind.grid(n, *seed)).collect();
            let packed = Packed::new(kind, &grids, first + n as u64);
            let expected: Vec<_> = grids.into_par_iter().map(expected).collect();
            singular += expected.iter().filter(|topology| topology.is_none()).count();
            for topology in expected.iter().flatten() {
                compared += 1;
                all_pieces += topology.pieces.len();
                handles += topology.betti()[1] as usize / 2;
            }
            for method in EXACT {
                let mut before: Option<Vec<[u32; 3]>> = None;
                for (backend, mesh) in meshes(&packed, &packed.options(method)) {
                    // Where a backend has the triangles of the other, it has been judged.
                    if before.as_ref().is_some_and(|before| *before == mesh.triangles) {
                        continue;
                    }
                    let count = count(mesh.vertices.len(), &mesh.triangles);
                    assert!(
                        count.is_closed_by_edge() && count.non_manifold_vertices == 0,
                        "{method:?} {kind:?} {n}"
                    );
                    let found = pieces(&packed, expected.len(), &mesh, &count);
                    for ((seed, expected), found) in seeds.iter().zip(&expected).zip(found) {
                        if let Some(expected) = expected
                            && expected.pieces != found
                        {
                            wrong.push((
                                method,
                                backend,
                                n,
                                *seed,
                                format!("{found:?}, not {:?}", expected.pieces),
                            ));
                        }
                    }
                    before = Some(mesh.triangles);
                }
            }
        }
    }
    eprintln!(
        "{kind:?}: {compared} grids compared, {singular} singular; {all_pieces} pieces, {handles} handles"
    );
    let mut text = String::new();
    for (method, backend, n, seed, what) in wrong.iter().take(5) {
        writeln!(text, "{method:?} {backend}, grid {n}³ {seed}: {what}").unwrap();
        text += &blame(kind, *n, *seed, *method);
    }
    assert!(wrong.is_empty(), "{kind:?}: {} of {compared} grids are wrong:\n{text}", wrong.len());
    // Few enough that hardly anything is left out.
    assert!(singular <= 100 && singular + compared == 10_000, "{kind:?}: {singular} singular grids");
}

#[test]
fn uniform() {
    as_the_oracle_says(Kind::Uniform);
}

#[test]
fn integers() {
    as_the_oracle_says(Kind::Integers);
}

#[test]
fn adversarial() {
    as_the_oracle_says(Kind::Adversarial);
}

#[test]
fn rounded() {
    as_the_oracle_says(Kind::Rounded);
}

#[test]
fn ties() {
    as_the_oracle_says(Kind::Ties);
}
