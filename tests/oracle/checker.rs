//! `Mesh::check`, which is what `isoforge check` prints, against the count made here: on the meshes of every kind of
//! grid, and on what is left of them when triangles are taken out, turned round, doubled, and vertices run together.

use crate::common::Random;
use crate::count::count;
use crate::grids::Kind;
use crate::methods::meshes;
use crate::packed::Packed;
use crate::topology::Small;
use isoforge::extract::Method;
use isoforge::mesh::Mesh;

fn agree(mesh: &Mesh, name: &str) {
    let report = mesh.check();
    let found = count(mesh.vertices.len(), &mesh.triangles);
    let said = [
        report.boundary_edges,
        report.non_manifold_edges,
        report.misoriented_edges,
        report.non_manifold_vertices,
        report.components,
    ];
    let counted = [
        found.boundary_edges,
        found.non_manifold_edges,
        found.misoriented_edges,
        found.non_manifold_vertices,
        found.pieces.len(),
    ];
    assert_eq!(said, counted, "{name}:\n{report}");
    assert_eq!(report.euler, found.euler(), "{name}");
    let closed = found.is_closed_by_edge() && found.non_manifold_vertices == 0;
    assert_eq!(report.is_closed_manifold(), closed && !found.pieces.is_empty(), "{name}");
    let genus = closed.then(|| found.pieces.len() as i64 - found.euler() / 2);
    assert_eq!(report.genus, genus, "{name}");
}

fn damage(mesh: &mut Mesh, random: &mut Random) {
    for _ in 0..1 + random.next() % 200 {
        let n = mesh.triangles.len() as u64;
        let pick = (random.next() % n) as usize;
        match random.next() % 4 {
            0 => drop(mesh.triangles.swap_remove(pick)),
            1 => mesh.triangles[pick].swap(0, 1),
            2 => mesh.triangles.push(mesh.triangles[pick]),
            _ => {
                let [from, to] = [0, 1].map(|i| mesh.triangles[(pick + i) % n as usize][i]);
                mesh.triangles.iter_mut().flatten().filter(|v| **v == from).for_each(|v| *v = to);
            }
        }
    }
}

#[test]
fn the_checker_counts_the_same() {
    let mut random = Random(3);
    for kind in Kind::ALL {
        for seed in 0..4 {
            let grids: Vec<Small> = (0..8).map(|i| kind.grid(6, 8 * seed + i)).collect();
            let packed = Packed::new(kind, &grids, seed);
            for method in Method::ALL {
                for (backend, mut mesh) in meshes(&packed, &packed.options(method)) {
                    let name = format!("{kind:?} {seed} {method:?} {backend}");
                    agree(&mesh, &name);
                    damage(&mut mesh, &mut random);
                    agree(&mesh, &format!("{name}, damaged"));
                }
            }
        }
    }
}
