//! RIB files, read by a small reader of the interface's own grammar: words, strings and lists.

use crate::shapes::{mesh, tetrahedron, torus};
use glam::{DMat4, DVec3, DVec4};
use isoforge::mesh::Mesh;
use isoforge::mesh::write::{Extra, write, write_with};
use isoforge::render::View;

/// A RIB request: its name and what follows up to the next.
struct Request {
    name: String,
    strings: Vec<String>,
    lists: Vec<Vec<f64>>,
    numbers: Vec<f64>,
}

fn requests(text: &str) -> Vec<Request> {
    let mut found: Vec<Request> = Vec::new();
    let mut rest = text.lines().filter(|line| !line.starts_with('#')).collect::<Vec<_>>().join("\n");
    while let Some(first) = rest.trim_start().chars().next() {
        let start = rest.len() - rest.trim_start().len();
        rest.drain(..start);
        let end = match first {
            '"' => 2 + rest[1..].find('"').unwrap(),
            '[' => 1 + rest.find(']').unwrap(),
            _ => rest.find(|c: char| c.is_whitespace()).unwrap_or(rest.len()),
        };
        let token: String = rest.drain(..end).collect();
        if first.is_ascii_alphabetic() {
            found.push(Request { name: token, strings: vec![], lists: vec![], numbers: vec![] });
            continue;
        }
        let request = found.last_mut().unwrap();
        match first {
            '"' => request.strings.push(token.trim_matches('"').into()),
            '[' => {
                let words = token[1..token.len() - 1].split_whitespace();
                request.lists.push(words.map(|word| word.parse().unwrap()).collect());
            }
            _ => request.numbers.push(token.parse().unwrap()),
        }
    }
    found
}

fn written(mesh: &Mesh, name: &str) -> Vec<Request> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    assert_eq!(write(mesh, &path).unwrap(), std::fs::metadata(&path).unwrap().len());
    requests(&std::fs::read_to_string(&path).unwrap())
}

fn one<'a>(all: &'a [Request], name: &str) -> &'a Request {
    let mut found = all.iter().filter(|request| request.name == name);
    let request = found.next().unwrap_or_else(|| panic!("no {name}"));
    assert!(found.next().is_none(), "{name} twice");
    request
}

#[test]
fn the_mesh_is_whole() {
    let mut mesh = torus(9, 5);
    mesh.vertices[0].position = [0.1, -0.0, 1.0e-38];
    mesh.vertices[1].position = [16_777_217.0, -1.0 / 3.0, 123_456.79];
    let all = written(&mesh, "a \"b\".rib");
    let polygons = one(&all, "PointsPolygons");
    assert_eq!(polygons.strings, ["P", "N"]);
    let [counts, corners, positions, normals] = &polygons.lists[..] else { panic!("four lists") };
    assert!(counts.len() == mesh.triangles.len() && counts.iter().all(|&n| n == 3.0));
    assert!(corners.iter().map(|&n| n as u32).eq(mesh.triangles.iter().flatten().copied()));
    let same = |list: &[f64], floats: Vec<f32>| {
        list.len() == floats.len()
            && list.iter().zip(floats).all(|(a, b)| (*a as f32).to_bits() == b.to_bits())
    };
    assert!(same(positions, mesh.vertices.iter().flat_map(|v| v.position).collect()));
    assert!(same(normals, mesh.vertices.iter().flat_map(|v| v.normal).collect()));
    // What opens is closed, in order.
    let blocks = all
        .iter()
        .map(|request| &*request.name)
        .filter(|name| name.ends_with("Begin") || name.ends_with("End"));
    assert!(blocks.eq(["WorldBegin", "AttributeBegin", "AttributeEnd", "WorldEnd"]));
}

/// Goes red when the camera looks the other way, or stands 20 % nearer.
#[test]
fn the_camera_sees_all_of_it() {
    let far = |mut mesh: Mesh, scale: f32, offset: f32| {
        mesh.vertices.iter_mut().for_each(|v| v.position = v.position.map(|x| x * scale + offset));
        mesh
    };
    let one_point = mesh(&[[3.0; 3]], &[]);
    let meshes =
        [tetrahedron(), torus(16, 9), far(torus(16, 9), 1e-6, 0.0), far(torus(9, 9), 1e6, 1e7), one_point];
    for mesh in meshes {
        let all = written(&mesh, "a.rib");
        let matrix: [f64; 16] = one(&all, "ConcatTransform").lists[0].clone().try_into().unwrap();
        // Column-major with columns for rows: what RenderMan applies to row vectors.
        let to_camera = DMat4::from_cols_array(&matrix);
        assert!(to_camera.determinant() < 0.0, "right-handed world, left-handed camera");
        let [near, far] = one(&all, "Clipping").numbers[..] else { panic!("two planes") };
        let slope = (one(&all, "Projection").lists[0][0].to_radians() / 2.0).tan();
        for vertex in &mesh.vertices {
            let p: DVec4 = to_camera * DVec3::from(vertex.position.map(f64::from)).extend(1.0);
            assert!(near > 0.0 && near < p.z && p.z < far, "{near} {} {far}", p.z);
            assert!(p.x.abs().max(p.y.abs()) < p.z * slope, "{p} is out of the frame");
        }
        // Up in the world is up in the picture.
        assert!((to_camera * DVec4::Z).y > 0.0);
    }
}

#[test]
fn views_that_no_picture_has_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.rib");
    let plain = View::default();
    for view in
        [View { fov: 0.0, ..plain }, View { size: [0, 5], ..plain }, View { azimuth: f32::NAN, ..plain }]
    {
        let error = write_with(&tetrahedron(), &Extra { view, ..Extra::default() }, &path).unwrap_err();
        assert!(error.to_string().contains("a.rib") && !path.exists(), "{error}");
    }
}

/// Of an upright picture the angle of its height is given, and RenderMan's is that of its width.
#[test]
fn the_camera_stands_where_it_is_told() {
    let view = View { azimuth: 0.0, elevation: 0.0, fov: 90.0, size: [300, 600] };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.rib");
    write_with(&tetrahedron(), &Extra { view, ..Extra::default() }, &path).unwrap();
    let all = requests(&std::fs::read_to_string(path).unwrap());
    assert_eq!(one(&all, "Format").numbers, [300.0, 600.0, 1.0]);
    let width = one(&all, "Projection").lists[0][0];
    assert!((width - 2.0 * 0.5f64.atan().to_degrees()).abs() < 1e-9, "{width}");
    let matrix: [f64; 16] = one(&all, "ConcatTransform").lists[0].clone().try_into().unwrap();
    // From +x, y is to the right.
    let to_camera = DMat4::from_cols_array(&matrix);
    let [right, up, ahead] = [DVec4::Y, DVec4::Z, DVec4::NEG_X].map(|axis| to_camera * axis);
    assert!(
        right.abs_diff_eq(DVec4::X, 1e-9)
            && up.abs_diff_eq(DVec4::Y, 1e-9)
            && ahead.abs_diff_eq(DVec4::Z, 1e-9)
    );
}

#[test]
fn without_normals_and_without_anything() {
    let mut bare = tetrahedron();
    bare.vertices.iter_mut().for_each(|v| v.normal = [0.0; 3]);
    assert_eq!(one(&written(&bare, "bare.rib"), "PointsPolygons").strings, ["P"]);
    let empty = written(&Mesh::default(), "none.rib");
    assert!(one(&empty, "PointsPolygons").lists.iter().all(Vec::is_empty));
}
