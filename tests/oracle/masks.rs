//! Every pattern of a cell's signs, with values of every kind: whatever the method, the mesh is closed and manifold, by
//! edge and by vertex.

use crate::common::Random;
use crate::count::count;
use crate::exact::Cell;
use crate::grids::Kind;
use crate::methods::meshes;
use crate::packed::Packed;
use crate::topology::Small;
use isoforge::extract::Method;

/// Sets of values for each pattern.
const VALUES: u64 = 64;

/// Goes red when a triangle of a row of `tables/mc33.txt` is turned round.
#[test]
fn all_patterns_close() {
    let mut random = Random(8);
    let mut cells: Vec<Cell> = Vec::new();
    for pattern in 0..256u32 {
        for set in 0..VALUES {
            // Of all sizes, alike, nearly the same, and the same.
            let size = |random: &mut Random| match set % 4 {
                0 => 1 << (random.next() % 22),
                1 => 1 + (random.next() % (1 << 22)) as i64,
                2 => (1 << 21) + (random.next() % 16) as i64,
                _ => 1 << 20,
            };
            cells.push([0, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
                let size = size(&mut random);
                if pattern >> corner & 1 == 1 { size } else { -size }
            }));
        }
    }
    let alone: Vec<Small> = cells.iter().map(Small::of_cell).collect();
    for seed in 0..2 {
        let packed = Packed::new(Kind::Uniform, &alone, seed);
        for method in Method::ALL {
            for (backend, mesh) in meshes(&packed, &packed.options(method)) {
                let count = count(mesh.vertices.len(), &mesh.triangles);
                assert!(count.is_closed_by_edge(), "{method:?} {backend}: {count:?}");
                assert_eq!(count.non_manifold_vertices, 0, "{method:?} {backend}");
                // Each pattern but the empty one has a piece.
                assert!(count.pieces.len() >= 255 * VALUES as usize, "{method:?} {backend}");
            }
        }
    }
}
