//! Every row of the table of cells that their corners do not decide: met by cells of the row's own decisions, however
//! rare these are in random grids, and meshed as the oracle says. Rows that cannot be are none, and none is missing.

use crate::common::Random;
use crate::count::count;
use crate::exact::{Cell, Decided, decide_cell, faces, number};
use crate::grids::Kind;
use crate::methods::{EXACT, meshes, pieces};
use crate::packed::Packed;
use crate::topology::{Small, topology};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// Cells of each row.
const CELLS: usize = 4;
/// How many are tried for those of a pattern of signs; where its corners decide, so few.
const TRIES: [usize; 2] = [400_000, 1000];

/// The key of a cell's row, as the table has it.
fn key(cell: &Cell, decided: &Decided) -> String {
    let pattern: u8 = (0..8).map(|corner| u8::from(cell[corner] > 0) << corner).sum();
    let [on_surface, in_body] = [&decided.surface, &decided.body].map(number);
    let tunnel = (0..8).find(|corner| decided.surface[*corner] != decided.body[*corner]);
    assert!(on_surface - in_body <= 1, "two tunnels: {cell:?}");
    let tunnel = tunnel.map_or("none", |corner| if cell[corner] > 0 { "inside" } else { "outside" });
    let joins_inside = |(face, decision): ([u8; 4], Option<Ordering>)| match decision {
        None => '-',
        Some(which) if (which == Ordering::Greater) == (cell[face[0] as usize] > 0) => '1',
        Some(_) => '0',
    };
    let faces: String = faces().into_iter().zip(decided.faces).map(joins_inside).collect();
    format!("{pattern} {faces} {tunnel}")
}

/// Cells of a pattern by the keys of their rows.
fn cells_of(pattern: u8, rows: &BTreeSet<&str>) -> BTreeMap<String, Vec<Cell>> {
    let mut found: BTreeMap<String, Vec<Cell>> = BTreeMap::new();
    let wanted = rows.iter().filter(|row| row.starts_with(&format!("{pattern} "))).count();
    let mut random = Random(u64::from(pattern));
    for _ in 0..TRIES[usize::from(wanted == 0)] {
        if wanted > 0 && found.len() == wanted && found.values().all(|cells| cells.len() == CELLS) {
            break;
        }
        // From alike to very different.
        let spread = random.next() % 12;
        let cell: Cell = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
            let size = ((1 << 21) + (random.next() % (1 << 21)) as i64) >> (random.next() % (1 + spread));
            if pattern >> corner & 1 == 1 { size } else { -size }
        });
        if let Some(decided) = decide_cell(&cell) {
            let cells = found.entry(key(&cell, &decided)).or_default();
            if cells.len() < CELLS {
                cells.push(cell);
            }
        }
    }
    found
}

/// Whether no values can have a row's decisions. Where signs alternate along every edge, both faces across an axis join
/// inside corners only if the product of all inside corners is the larger, and outside corners only if that of the
/// others is: for one axis to do the one, and another the other, is impossible. (The table has rows for it, which nobody
/// reads.)
fn is_impossible(row: &str) -> bool {
    let faces = row.split(' ').nth(1).expect("a row names its faces");
    let across = |both: &str| (0..3).any(|axis| &faces[2 * axis..2 * axis + 2] == both);
    !faces.contains('-') && across("11") && across("00")
}

/// Goes red when a row with a tunnel (`24 ------ inside`, `150 101010 outside`) has the triangles of the row without.
#[test]
fn every_row_is_met() {
    let table = include_str!("../../tables/mc33.txt");
    let keys = table
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split_once(": ").expect("a row").0);
    let rows: BTreeSet<&str> = keys.filter(|row| !is_impossible(row)).collect();
    assert_eq!(rows.len(), 640);
    let found: BTreeMap<String, Vec<Cell>> =
        (0..=255).into_par_iter().flat_map(|pattern| cells_of(pattern, &rows)).collect();
    // Without a row: no face is ambiguous, and there is no tunnel.
    let met: BTreeSet<&str> = found
        .keys()
        .map(String::as_str)
        .filter(|key| !key.ends_with(" ------ none") || rows.contains(key))
        .collect();
    let [missing, unmet] = [met.difference(&rows), rows.difference(&met)].map(Iterator::collect::<Vec<_>>);
    assert!(missing.is_empty() && unmet.is_empty(), "no such rows: {missing:?}; never met: {unmet:?}");

    let cells: Vec<(&String, &Cell)> =
        found.iter().flat_map(|(key, cells)| cells.iter().map(move |cell| (key, cell))).collect();
    eprintln!("{} rows met by {} cells", rows.len(), cells.len());
    let alone: Vec<Small> = cells.iter().map(|(_, cell)| Small::of_cell(cell)).collect();
    let packed = Packed::new(Kind::Uniform, &alone, 0);
    for method in EXACT {
        for (backend, mesh) in meshes(&packed, &packed.options(method)) {
            let count = count(mesh.vertices.len(), &mesh.triangles);
            let found = pieces(&packed, alone.len(), &mesh, &count);
            let mut wrong = Vec::new();
            for (((key, cell), alone), found) in cells.iter().zip(&alone).zip(found) {
                let expected = topology(alone).expect("decided above").pieces;
                if expected != found {
                    wrong.push(format!("{key}: {cell:?} has {found:?}, not {expected:?}"));
                }
            }
            assert!(wrong.is_empty(), "{method:?} {backend}: {} cells:\n{}", wrong.len(), wrong.join("\n"));
        }
    }
}
