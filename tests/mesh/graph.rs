//! The checker's counts against those of a graph library, on extracted meshes, whole and damaged.

use std::collections::{HashMap, HashSet};

use isoforge::mesh::Mesh;
use petgraph::algo::connected_components;
use petgraph::graphmap::UnGraphMap;
use petgraph::unionfind::UnionFind;
use proptest::prelude::*;

use crate::common::Random;
use crate::extracted::{named, noise};
use crate::shapes::both;

/// What both count.
#[derive(Debug, PartialEq)]
struct Counts {
    components: usize,
    boundary_edges: usize,
    boundary_loops: usize,
    non_manifold_edges: usize,
    non_manifold_vertices: usize,
    misoriented_edges: usize,
    euler: i64,
    is_closed: bool,
}

fn by_checker(mesh: &Mesh) -> Counts {
    let r = mesh.check();
    Counts {
        components: r.components,
        boundary_edges: r.boundary_edges,
        boundary_loops: r.boundary_loops,
        non_manifold_edges: r.non_manifold_edges,
        non_manifold_vertices: r.non_manifold_vertices,
        misoriented_edges: r.misoriented_edges,
        euler: r.euler,
        is_closed: r.is_closed_manifold(),
    }
}

/// By graphs: of the vertices, of the border, and of the link of each vertex (the edges that face it, which of a manifold
/// are one path or one cycle).
fn by_graphs(mesh: &Mesh) -> Counts {
    let proper: Vec<[u32; 3]> = mesh
        .triangles
        .iter()
        .copied()
        .filter(|&[a, b, c]| a != b && b != c && c != a)
        .filter(|t| t.iter().all(|&v| (v as usize) < mesh.vertices.len()))
        .collect();
    let bad_indices = mesh.triangles.iter().flatten().any(|&v| v as usize >= mesh.vertices.len());
    let (mut vertices, mut border) = (UnGraphMap::<u32, ()>::new(), UnGraphMap::<u32, ()>::new());
    // How often each edge runs upwards and downwards.
    let mut runs: HashMap<(u32, u32), [usize; 2]> = HashMap::new();
    let mut links: HashMap<u32, Vec<(u32, u32)>> = HashMap::new();
    for &[a, b, c] in &proper {
        for (a, b, facing) in [(a, b, c), (b, c, a), (c, a, b)] {
            vertices.add_edge(a, b, ());
            runs.entry((a.min(b), a.max(b))).or_default()[usize::from(a > b)] += 1;
            links.entry(facing).or_default().push((a, b));
        }
    }
    for (&(a, b), _) in runs.iter().filter(|(_, n)| n[0] + n[1] == 1) {
        border.add_edge(a, b, ());
    }
    let is_fan = |link: &Vec<(u32, u32)>| {
        let mut degrees: HashMap<u32, usize> = HashMap::new();
        let ends: HashMap<u32, usize> =
            link.iter().flat_map(|&(a, b)| [a, b]).collect::<HashSet<_>>().into_iter().zip(0..).collect();
        let mut pieces = UnionFind::new(ends.len());
        for (a, b) in link {
            *degrees.entry(*a).or_default() += 1;
            *degrees.entry(*b).or_default() += 1;
            pieces.union(ends[a], ends[b]);
        }
        let whole = pieces.into_labeling().into_iter().collect::<HashSet<_>>().len() == 1;
        whole && degrees.values().all(|&n| n <= 2)
    };
    let non_manifold_vertices = links.values().filter(|link| !is_fan(link)).count();
    let non_manifold_edges = runs.values().filter(|n| n[0] + n[1] > 2).count();
    let misoriented_edges = runs.values().filter(|n| n[0] + n[1] == 2 && n[0] != 1).count();
    Counts {
        components: connected_components(&vertices),
        boundary_edges: border.edge_count(),
        boundary_loops: connected_components(&border),
        non_manifold_edges,
        non_manifold_vertices,
        misoriented_edges,
        euler: vertices.node_count() as i64 - vertices.edge_count() as i64 + proper.len() as i64,
        is_closed: !proper.is_empty()
            && non_manifold_edges + non_manifold_vertices + misoriented_edges + border.edge_count() == 0
            && !bad_indices,
    }
}

/// Does one kind of harm to a random triangle or vertex.
fn damage(mesh: &mut Mesh, kind: usize, random: &mut Random) {
    if mesh.triangles.len() < 4 {
        return;
    }
    let (i, j) = (random.below(mesh.triangles.len()), random.below(mesh.triangles.len()));
    let (a, b) = (mesh.triangles[i][0], mesh.triangles[j][0]);
    match kind {
        0 => drop(mesh.triangles.swap_remove(i)),
        1 => mesh.triangles[i].swap(0, 1),
        2 => mesh.triangles.push(mesh.triangles[i]),
        // Two vertices become one, far apart or neighbours.
        3 => mesh.triangles.as_flattened_mut().iter_mut().filter(|v| **v == a).for_each(|v| *v = b),
        4 => mesh.triangles[i][0] = b,
        5 => mesh.triangles.push([a, b, mesh.triangles[j][1]]),
        6 => mesh.triangles[i][1] = mesh.vertices.len() as u32 + 7,
        _ => mesh.triangles.retain(|t| !t.contains(&a)),
    }
}

fn agree(mesh: &Mesh) -> Counts {
    let counts = by_checker(mesh);
    assert_eq!(counts, by_graphs(mesh));
    counts
}

#[test]
fn extracted_meshes_as_by_graphs() {
    for name in ["sphere", "torus", "gyroid", "boy", "steiner"] {
        agree(&named(name, 24));
    }
    let two = both(&named("torus", 16), &named("sphere", 12), [9.0; 3]);
    let counts = agree(&two);
    assert!(counts.is_closed && counts.components == 2 && counts.euler == 2);
    let open = agree(&named("gyroid", 20));
    assert!(open.boundary_loops > 0 && open.boundary_edges > open.boundary_loops);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn damaged_meshes_as_by_graphs(
        n in 3u32..9,
        seed in any::<u64>(),
        closed in any::<bool>(),
        harm in prop::collection::vec(0usize..8, 0..12),
    ) {
        let mut mesh = noise(n, seed, closed);
        let whole = agree(&mesh);
        prop_assert!(!closed || mesh.triangles.is_empty() || whole.is_closed);
        let mut random = Random(seed);
        for kind in harm {
            damage(&mut mesh, kind, &mut random);
            agree(&mesh);
        }
    }
}
