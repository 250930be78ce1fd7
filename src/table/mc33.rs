//! What topologically correct marching cubes adds to the table: the triangles of the cells that the corners alone do
//! not decide, parsed once from `tables/mc33.txt`.
//!
//! Theory: Chernyaev 1995 (the cases), Nielson & Hamann 1991 (faces), Custodio, Pesco & Silva 2019 and Grosso 2016 (that
//! vertices within the cell are needed where every cut of a polygon would lie in a face, which the cell beside may use,
//! too). How it differs from the usual: a row is chosen by what is decided, the faces and whether there is a tunnel, and
//! not by a number of a case and a rotation.

use super::{MARCHING_CUBES, Table};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// The corners of each face, around it; face `2 axis + side`. Its ambiguous form has the first and third corner on one
/// side of iso, and the others on the other.
pub const FACE_CORNERS: [[u8; 4]; 6] =
    [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];

/// The most triangles that a cell has.
pub const MAX_TRIANGLES: usize = 14;
/// The most vertices within a cell, its centres. In triangles they follow the twelve edges.
pub const MAX_CENTRES: u32 = 2;
/// The number of the first centre among the corners of triangles.
pub const FIRST_CENTRE: u32 = 12;

/// Where the two words a case begin, behind the marching cubes table: those of that table, or [`UNDECIDED`] and in the second the
/// ambiguous faces in bits 0–5, and the case's first row.
const CASES: usize = 512;
/// In place of the number of triangles, where the corners do not decide.
const UNDECIDED: u32 = 15;
/// Where the rows begin: three for each decision of a case's faces, for no tunnel, for one that joins inside corners, and
/// for one that joins outside corners.
const ROWS: usize = CASES + 512;

/// How the interpolant joins corners through the middle of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tunnel {
    /// Not at all.
    None,
    /// Two groups of inside corners are one.
    Inside,
    /// Two groups of outside corners are one.
    Outside,
}

/// The words of both tables.
pub struct Mc33 {
    words: Vec<u32>,
}

/// The one table of the program.
pub static MC33: LazyLock<Mc33> =
    LazyLock::new(|| Mc33::parse(&MARCHING_CUBES, include_str!("../../tables/mc33.txt")));

/// The triangles of a cell: the number of them in bits 0–3, of centres in bits 4–5, the edges around the centres in bits
/// 8–19 and 20–31; then two triangles a word.
#[derive(Debug, Clone, Copy)]
pub struct Entry<'a>(&'a [u32]);

impl Entry<'_> {
    /// Number of triangles.
    #[inline(always)]
    pub fn triangle_count(self) -> u32 {
        self.0[0] & 15
    }

    /// Number of vertices within the cell.
    #[inline(always)]
    pub fn centres(self) -> u32 {
        self.0[0] >> 4 & 3
    }

    /// The edges whose vertices lie around centre `i`, a bit each.
    pub fn around(self, i: u32) -> u32 {
        self.0[0] >> (8 + 12 * i) & 0xfff
    }

    /// The corners of triangle `i`: edges, and from [`FIRST_CENTRE`] on centres.
    #[inline(always)]
    pub fn triangle(self, i: u32) -> [u32; 3] {
        let packed = self.0[1 + i as usize / 2] >> (12 * (i % 2));
        [packed & 15, packed >> 4 & 15, packed >> 8 & 15]
    }
}

/// The words of a case's entries, by the number that its faces' decisions make, for each tunnel; none where it cannot be.
type Decided = BTreeMap<u32, [Vec<u32>; 3]>;

impl Mc33 {
    /// Parses the text of the table file.
    ///
    /// # Panics
    /// If the text is not a whole table: it is part of the program, checked by its tests.
    fn parse(cubes: &Table, text: &str) -> Self {
        let mut cases: BTreeMap<u8, (u32, Decided)> = BTreeMap::new();
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let (key, corners) = line.split_once(": ").expect("a row is `case faces tunnel: corners`");
            let key: Vec<&str> = key.split(' ').collect();
            let [case, faces, tunnel] = key[..] else { panic!("three words of a row: {line}") };
            let tunnel = ["none", "inside", "outside"].iter().position(|&word| word == tunnel);
            let entry = pack(corners.split_whitespace().map(corner));
            let (ambiguous, decided) =
                faces.chars().enumerate().fold((0, 0), |(all, number), (face, c)| match c {
                    '-' => (all, number),
                    _ => (all | 1 << face, 2 * number + u32::from(c == '1')),
                });
            let of_case =
                cases.entry(case.parse().expect("a case")).or_insert_with(|| (ambiguous, Decided::new()));
            of_case.1.entry(decided).or_default()[tunnel.expect("a tunnel")] = entry;
        }
        let cubes: Vec<u32> = cubes.words().iter().flatten().copied().collect();
        let mut words = [&cubes[..], &cubes[..]].concat();
        let rows: usize = cases.values().map(|(_, decided)| 3 * decided.len()).sum();
        words.resize(ROWS + rows, 0);
        let mut row = ROWS;
        for (case, (ambiguous, decided)) in cases {
            assert_eq!(decided.len(), 1 << ambiguous.count_ones(), "every decision has a row");
            let at = CASES + 2 * usize::from(case);
            (words[at], words[at + 1]) = (UNDECIDED, ambiguous | (row as u32) << 6);
            for entry in decided.into_values().flatten() {
                if !entry.is_empty() {
                    words[row] = words.len() as u32;
                    words.extend(entry);
                }
                row += 1;
            }
        }
        Self { words }
    }

    /// The words as the GPU gets them: the marching cubes table, the two words a case, rows, and entries.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Whether the corners alone decide a case, so that the marching cubes table is right.
    #[inline(always)]
    pub fn is_decided(&self, case: u8) -> bool {
        self.words[CASES + 2 * usize::from(case)] & 15 != UNDECIDED
    }

    /// The entry of a case that is not decided, once `joined` has said of each ambiguous face whether its inside
    /// corners are joined, and `tunnel`, given these in bits, where one can be, which there is.
    pub fn entry(
        &self,
        case: u8,
        joined: impl Fn(usize) -> bool,
        tunnel: impl FnOnce(u32) -> Tunnel,
    ) -> Entry<'_> {
        let word = self.words[CASES + 2 * usize::from(case) + 1];
        let (mut number, mut faces) = (0, 0);
        for face in (0..6).filter(|face| word >> face & 1 == 1) {
            let joined = u32::from(joined(face));
            number = 2 * number + joined as usize;
            faces |= joined << face;
        }
        let first = (word >> 6) as usize + 3 * number;
        let rows = &self.words[first..first + 3];
        let row = if rows[1] | rows[2] == 0 { 0 } else { tunnel(faces) as usize };
        // Rounding may say what cannot be.
        let entry = if rows[row] == 0 { rows[0] } else { rows[row] };
        Entry(&self.words[entry as usize..])
    }
}

fn corner(word: &str) -> u32 {
    match word {
        "a" => FIRST_CENTRE,
        "b" => FIRST_CENTRE + 1,
        edge => edge.parse().expect("an edge number"),
    }
}

/// The words of [`Entry`].
fn pack(corners: impl Iterator<Item = u32>) -> Vec<u32> {
    let corners: Vec<u32> = corners.collect();
    let triangles: Vec<&[u32]> = corners.chunks(3).collect();
    assert!(
        corners.len().is_multiple_of(3)
            && triangles.len() <= MAX_TRIANGLES
            && corners.iter().all(|&c| c < 14)
    );
    let centres = corners.iter().map(|&c| (c + 1).saturating_sub(FIRST_CENTRE)).max().unwrap_or(0);
    let mut head = triangles.len() as u32 | centres << 4;
    for i in 0..centres {
        let fan = triangles.iter().filter(|t| t.contains(&(FIRST_CENTRE + i)));
        let around = fan.flat_map(|t| t.iter()).filter(|&&c| c < FIRST_CENTRE);
        head |= around.fold(0, |mask, edge| mask | 1 << edge) << (8 + 12 * i);
    }
    let pairs = triangles.chunks(2).map(|pair| {
        pair.iter().enumerate().fold(0, |word, (i, t)| word | (t[0] | t[1] << 4 | t[2] << 8) << (12 * i))
    });
    std::iter::once(head).chain(pairs).collect()
}
