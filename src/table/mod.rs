//! The lookup tables, parsed once from `tables/` and packed into the words that both the CPU and the GPU read:
//! marching cubes here, what its topologically correct form adds in [`mc33`]. `tables/README.md` has the corner
//! and edge numbering.

pub mod mc33;
pub mod tetrahedra;

use std::sync::LazyLock;

/// The corners that edge `e` joins, the lower one first; corner bits are `zyx`.
pub const EDGE_CORNERS: [[u8; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The most triangles a case has.
pub const MAX_TRIANGLES: usize = 5;

/// The 256 cases, two words each: bits 0–3 the number of triangles, then 4-bit edge numbers.
pub struct Table {
    words: [[u32; 2]; 256],
}

/// The one table of the program.
pub static MARCHING_CUBES: LazyLock<Table> =
    LazyLock::new(|| Table::parse(include_str!("../../tables/marching_cubes.txt")));

impl Table {
    /// Parses the text of a table file.
    ///
    /// # Panics
    /// If the text is not a whole table: it is part of the program, checked by its tests.
    fn parse(text: &str) -> Self {
        let mut words = [[0; 2]; 256];
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        for (case, line) in lines.enumerate() {
            let (number, edges) = line.split_once(':').expect("a table line is `case: edges`");
            assert_eq!(number.parse(), Ok(case), "table lines are in order");
            let edges: Vec<u64> =
                edges.split_whitespace().map(|e| e.parse().expect("an edge number")).collect();
            assert!(
                edges.len().is_multiple_of(3)
                    && edges.len() <= 3 * MAX_TRIANGLES
                    && edges.iter().all(|&e| e < 12)
            );
            let mut packed = edges.len() as u64 / 3;
            for (i, edge) in edges.iter().enumerate() {
                packed |= edge << (4 + 4 * i);
            }
            words[case] = [packed as u32, (packed >> 32) as u32];
        }
        Self { words }
    }

    /// The words as the GPU gets them.
    pub fn words(&self) -> &[[u32; 2]; 256] {
        &self.words
    }

    /// A case's packed words as one number.
    #[inline(always)]
    pub fn packed(&self, case: u8) -> u64 {
        let [low, high] = self.words[case as usize];
        u64::from(low) | u64::from(high) << 32
    }

    /// Number of triangles of a case.
    #[inline(always)]
    pub fn triangle_count(&self, case: u8) -> u32 {
        self.words[case as usize][0] & 15
    }

    /// The edges of triangle `i` of a case.
    pub fn triangle(&self, case: u8, i: u32) -> [u32; 3] {
        let packed = self.packed(case) >> (4 + 12 * i);
        [packed & 15, packed >> 4 & 15, packed >> 8 & 15].map(|e| e as u32)
    }
}
