//! The table of marching tetrahedra: the 16 cases of a tetrahedron, parsed once from `tables/marching_tetrahedra.txt`, and
//! from them the 256 cases of a cell cut into six.
//!
//! Theory: the Coxeter–Freudenthal (Kuhn) split: a tetrahedron for each order in which the axes lead from corner 0 to corner 7.
//! The cuts of a face's two cells are the same, and no case is ambiguous. Practice: an edge is its lower corner and its
//! direction, a corner's number each, so that the owner of the vertex on it is read off.

use std::sync::LazyLock;

/// The corners of the six tetrahedra, and whether they are wound as the table's is.
const TETRAHEDRA: [([u8; 4], bool); 6] = [
    ([0, 1, 3, 7], true),
    ([0, 1, 5, 7], false),
    ([0, 2, 3, 7], false),
    ([0, 2, 6, 7], true),
    ([0, 4, 5, 7], true),
    ([0, 4, 6, 7], false),
];

/// The most triangles that a cell has.
pub const MAX_TRIANGLES: usize = 12;

/// Words of a case of a cell: the number of triangles, then a word each.
pub const CASE_WORDS: usize = 1 + MAX_TRIANGLES;

/// The cases of cells: [`CASE_WORDS`] words each.
pub struct Tetrahedra {
    words: Vec<u32>,
}

/// The one table of the program.
pub static MARCHING_TETRAHEDRA: LazyLock<Tetrahedra> =
    LazyLock::new(|| Tetrahedra::parse(include_str!("../../tables/marching_tetrahedra.txt")));

impl Tetrahedra {
    /// Parses the text of the table file.
    ///
    /// # Panics
    /// If the text is not a whole table: it is part of the program, checked by its tests.
    fn parse(text: &str) -> Self {
        let digit = |c: char| c.to_digit(4).expect("a corner of a tetrahedron") as usize;
        let mut cases: Vec<Vec<[usize; 2]>> = Vec::new();
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let (number, edges) = line.split_once(':').expect("a line is `case: edges`");
            assert_eq!(number.parse(), Ok(cases.len()), "lines are in order");
            let edges = edges.split_whitespace().map(|edge| {
                let ends: Vec<usize> = edge.chars().map(digit).collect();
                <[usize; 2]>::try_from(ends).expect("two corners of a tetrahedron")
            });
            cases.push(edges.collect());
            assert!(cases.last().is_some_and(|edges| edges.len().is_multiple_of(3)));
        }
        let mut words = vec![0; 256 * CASE_WORDS];
        for (case, words) in words.chunks_exact_mut(CASE_WORDS).enumerate() {
            for (corners, is_wound_so) in TETRAHEDRA {
                let own = (0..4).fold(0, |own, i| own | (case >> corners[i] & 1) << i);
                for triangle in cases[own].chunks_exact(3) {
                    let [a, b, c] = [0, 1, 2].map(|i| {
                        let [low, high] = triangle[i].map(|end| u32::from(corners[end]));
                        low | (high - low) << 3
                    });
                    let [b, c] = if is_wound_so { [b, c] } else { [c, b] };
                    words[0] += 1;
                    words[words[0] as usize] = a | b << 6 | c << 12;
                }
            }
        }
        Self { words }
    }

    /// The words as the GPU gets them.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The triangles of a case: of each of three edges the lower corner in the low three bits of six, and above it the
    /// direction; the first edge lowest.
    #[inline(always)]
    pub fn triangles(&self, case: u8) -> &[u32] {
        let words = &self.words[usize::from(case) * CASE_WORDS..][..CASE_WORDS];
        &words[1..=words[0] as usize]
    }
}
