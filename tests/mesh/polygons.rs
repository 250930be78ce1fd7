//! Faces of many corners: concave ones are cut within what they enclose, and meshes of them stay closed.

use isoforge::mesh::Mesh;
use proptest::prelude::*;

use crate::odd::{from, texts};

/// A prism over a polygon in the plane, counter-clockwise: sheared, so that no coordinate stays the same on its ends.
/// `first` is the corner that its ends begin with; corners of equal number are one vertex.
fn prism(
    polygon: &[[i32; 2]],
    number: &[u32],
    first: usize,
    axes: [usize; 3],
) -> [(&'static str, String); 3] {
    let n = polygon.len();
    let count = number.iter().max().unwrap() + 1;
    let mut positions = vec![String::new(); 2 * count as usize];
    for (&[x, y], &v) in polygon.iter().zip(number) {
        for top in [0, 1] {
            let p = [x, y, 2 * top + x + 3 * y];
            let word = |i: usize| p[axes[i]].to_string();
            positions[(v + count * top as u32) as usize] = [word(0), word(1), word(2)].join(" ");
        }
    }
    let end = |top: u32| number.iter().cycle().skip(first).take(n).map(move |v| v + count * top);
    let mut faces: Vec<Vec<u32>> = vec![end(1).collect(), end(0).collect()];
    faces[1].reverse();
    for i in 0..n {
        let (a, b) = (number[i], number[(i + 1) % n]);
        let is_bridge = (0..n).any(|j| (number[j], number[(j + 1) % n]) == (b, a));
        if !is_bridge {
            faces.push(vec![a, b, b + count, a + count]);
        }
    }
    let even = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].contains(&axes);
    if !even {
        faces.iter_mut().for_each(|face| face.reverse());
    }
    let positions: Vec<&str> = positions.iter().map(String::as_str).collect();
    let faces: Vec<&[u32]> = faces.iter().map(Vec::as_slice).collect();
    texts(&positions, &faces)
}

/// Twice the area within.
fn area(polygon: &[[i32; 2]]) -> i32 {
    let n = polygon.len();
    (0..n).map(|i| (polygon[i], polygon[(i + 1) % n])).map(|([a, b], [c, d])| a * d - b * c).sum()
}

const AXES: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// Reads the prism from each format and by each first corner, and holds it against what it is a prism of.
fn is_whole(polygon: &[[i32; 2]], number: &[u32], genus: i64, axes: [usize; 3]) -> Mesh {
    let mut last = Mesh::default();
    for first in 0..polygon.len() {
        for (ending, text) in prism(polygon, number, first, axes) {
            let mesh = from(ending, text.as_bytes()).unwrap().mesh;
            let report = mesh.check();
            let context = format!("{ending}, from corner {first}, axes {axes:?}: {report}\n{text}");
            assert!(!report.has_defects(), "{context}");
            assert_eq!(report.genus, Some(genus), "{context}");
            assert!((report.volume - f64::from(area(polygon))).abs() < 1e-6, "{context}");
            // Ends that lap over themselves enclose as much, with more area.
            let mut flat = mesh.triangles[..2 * (polygon.len() - 2)].iter().map(|&[a, b, c]| {
                let [a, b, c] = [a, b, c].map(|v| mesh.vertices[v as usize].at());
                (b - a).cross(c - a).length() / 2.0
            });
            let slope = (1.0f32 + 1.0 + 9.0).sqrt();
            let ends: f32 = flat.by_ref().sum();
            assert!((ends - area(polygon) as f32 * slope).abs() < 1e-3 * ends, "{ends}: {context}");
            last = mesh;
        }
    }
    last
}

fn in_order(polygon: &[[i32; 2]]) -> Vec<u32> {
    (0..polygon.len() as u32).collect()
}

#[test]
fn concave_polygons_with_straight_corners() {
    // A U, each of its sides with a corner within: one of them lies in line with a side elsewhere.
    let u = [
        [0, 0],
        [3, 0],
        [6, 0],
        [6, 2],
        [6, 4],
        [5, 4],
        [4, 4],
        [4, 3],
        [4, 2],
        [3, 2],
        [2, 2],
        [2, 3],
        [2, 4],
        [1, 4],
        [0, 4],
        [0, 2],
    ];
    let arrow = [[0, 0], [4, 2], [0, 4], [1, 2]];
    let star = [[0, 3], [-1, 1], [-3, 0], [-1, -1], [0, -3], [1, -1], [3, 0], [1, 1]];
    for axes in AXES {
        is_whole(&u, &in_order(&u), 0, axes);
        is_whole(&arrow, &in_order(&arrow), 0, axes);
        is_whole(&star, &in_order(&star), 0, axes);
    }
}

#[test]
fn a_hole_cut_free_by_a_bridge() {
    let ring = [[0, 0], [6, 0], [6, 6], [0, 6], [0, 0], [2, 2], [2, 4], [4, 4], [4, 2], [2, 2]];
    is_whole(&ring, &[0, 1, 2, 3, 0, 4, 5, 6, 7, 4], 1, AXES[0]);
}

#[test]
fn flat_along_an_axis() {
    let arrow = [[0, 0], [4, 2], [0, 4], [1, 2]];
    for zero in 0..3 {
        let corners = arrow.map(|[x, y]| {
            let mut words = vec![x.to_string(), y.to_string()];
            words.insert(zero, "0".into());
            words.join(" ")
        });
        for (ending, text) in texts(&corners.each_ref().map(String::as_str), &[&[0, 1, 2, 3], &[2, 1, 0, 3]])
        {
            let mesh = from(ending, text.as_bytes()).unwrap().mesh;
            // Not across the notch at corner 3.
            assert!(
                mesh.triangles.iter().all(|t| t.contains(&1) && t.contains(&3)),
                "{ending} {:?}",
                mesh.triangles
            );
        }
    }
}

#[test]
fn polygons_without_a_clear_inside_stay_fans() {
    let corners = [
        "0 0 0", "6 0 0", "6 6 0", "0 6 0", "2 2 0", "4 2 0", "4 4 0", "2 4 0", "0 0 0", "2 2 0", "3 0 0",
        "nan 0 0", "9 0 0", "1 -6 0",
    ];
    let faces: [&[u32]; 8] = [
        // It crosses itself; a corner lies on an edge of it; a corner is there twice in a row.
        &[1, 3, 0, 2, 13],
        &[0, 1, 2, 10, 3],
        &[0, 1, 5, 5, 3],
        // Two loops meet in a vertex.
        &[4, 1, 5, 4, 7, 3],
        // Both rings of a bridge go round the same way; its ends are two vertices at one place.
        &[0, 1, 2, 3, 0, 4, 5, 6, 7, 4],
        &[0, 1, 2, 3, 8, 4, 7, 6, 5, 9],
        // A corner is nowhere; all are on a line.
        &[0, 5, 11, 2, 7],
        &[0, 12, 10, 1],
    ];
    for face in faces {
        for (ending, text) in texts(&corners, &[face]) {
            let found = from(ending, text.as_bytes()).unwrap().mesh;
            let want: Vec<[u32; 3]> = face[1..].windows(2).map(|side| [face[0], side[0], side[1]]).collect();
            assert_eq!(found.triangles, want, "{ending} {face:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Between two lines of steps, the one over the other.
    #[test]
    fn mountains(low in prop::collection::vec(0i32..4, 2..9), high in prop::collection::vec(4i32..8, 2..9), i in 0usize..6) {
        let wide = low.len().max(high.len()) as i32 - 1;
        let at = |i: usize, of: usize| if i + 1 == of { wide } else { i as i32 };
        let mut polygon: Vec<[i32; 2]> = low.iter().enumerate().map(|(i, &y)| [at(i, low.len()), y]).collect();
        polygon.extend(high.iter().enumerate().map(|(i, &y)| [at(i, high.len()), y]).rev());
        is_whole(&polygon, &in_order(&polygon), 0, AXES[i]);
    }
}
