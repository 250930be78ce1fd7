//! Files that are odd but no damage, and those with nothing in them: what each reader makes of them.

use std::fs;

use isoforge::mesh::read::{Contents, ENDINGS, ReadError, read};
use isoforge::mesh::write::write;

use crate::shapes::tetrahedron;

pub fn from(ending: &str, bytes: &[u8]) -> Result<Contents, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("x.{ending}"));
    fs::write(&path, bytes).unwrap();
    read(&path)
}

/// The corners and faces as a text file of each format that has faces of any size.
pub fn texts(corners: &[&str], faces: &[&[u32]]) -> [(&'static str, String); 3] {
    let row = |face: &&[u32], first: u32| {
        face.iter().map(|v| (v + first).to_string()).collect::<Vec<_>>().join(" ")
    };
    let sized = |faces: &[&[u32]]| -> String {
        faces.iter().map(|f| format!("{} {}\n", f.len(), row(f, 0))).collect()
    };
    let (n, m) = (corners.len(), faces.len());
    let positions = corners.join("\n");
    let ply = "property float x\nproperty float y\nproperty float z\n";
    [
        ("off", format!("OFF\n{n} {m} 0\n{positions}\n{}", sized(faces))),
        (
            "ply",
            format!(
                "ply\nformat ascii 1.0\nelement vertex {n}\n{ply}element face {m}\nproperty list uchar int vertex_indices\nend_header\n{positions}\n{}",
                sized(faces)
            ),
        ),
        (
            "obj",
            corners
                .iter()
                .map(|c| format!("v {c}\n"))
                .chain(faces.iter().map(|f| format!("f {}\n", row(f, 1))))
                .collect(),
        ),
    ]
}

const SQUARE: [&str; 5] = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0.5 0.5 0"];

#[test]
fn polygons_become_fans_where_these_are_right() {
    for (ending, text) in texts(&SQUARE, &[&[0, 1, 2, 3], &[3, 2, 1, 0], &[4, 0, 1, 2, 3]]) {
        let Contents { mesh, left_out } = from(ending, text.as_bytes()).unwrap();
        let want = [[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0], [4, 0, 1], [4, 1, 2], [4, 2, 3]];
        assert_eq!((mesh.triangles, left_out), (want.to_vec(), 0), "{ending}");
    }
}

#[test]
fn faces_of_fewer_than_three_corners_are_left_out_and_counted() {
    for (ending, text) in texts(&SQUARE, &[&[0, 1], &[0, 1, 2], &[3]]) {
        let Contents { mesh, left_out } = from(ending, text.as_bytes()).unwrap();
        assert_eq!((mesh.triangles, mesh.vertices.len(), left_out), (vec![[0, 1, 2]], 5, 2), "{ending}");
    }
    assert_eq!(from("obj", b"v 0 0 0\nv 1 0 0\nl 1 2\np 1\nf 1 2\n").unwrap().left_out, 1);
    // One that names what is not there is damage all the same.
    for (ending, text) in texts(&SQUARE, &[&[0, 1, 2], &[0, 9]]) {
        let error = from(ending, text.as_bytes()).unwrap_err().to_string();
        assert!(
            error.contains("face") && error.contains("names vertex") && error.contains("export it again"),
            "{error}"
        );
    }
}

#[test]
fn lost_positions_are_kept_and_counted() {
    for lost in ["nan 0 0", "0 inf 0", "0 0 -inf", "NaN nan 1"] {
        for (ending, text) in texts(&["0 0 0", "1 0 0", "0 1 0", lost], &[&[0, 1, 2], &[0, 1, 3]]) {
            let mut mesh = from(ending, text.as_bytes()).unwrap().mesh;
            let report = mesh.check();
            assert_eq!((report.non_finite_vertices, report.triangles), (1, 2), "{ending} {lost}");
            assert!(report.area.is_finite() && report.has_defects());
            assert!(report.to_string().contains("non-finite vertex: vertex 3"), "{report}");
            assert_eq!(mesh.remove_broken().triangles, 1);
            assert_eq!(mesh.check().non_finite_vertices, 0);
        }
    }
    // In binary files.
    let folder = tempfile::tempdir().unwrap();
    let mut lost = tetrahedron();
    lost.vertices[2].position[1] = f32::NAN;
    for ending in ENDINGS {
        let path = folder.path().join(format!("x.{ending}"));
        write(&lost, &path).unwrap();
        let found = read(&path).unwrap().mesh;
        assert_eq!((found.check().non_finite_vertices, found.triangles.len()), (1, 4), "{ending}");
    }
}

#[test]
fn empty_files_are_damage() {
    for ending in ENDINGS {
        let error = from(ending, b"").unwrap_err();
        let text = error.to_string();
        assert!(matches!(error, ReadError::Malformed { .. }), "{text}");
        assert!(
            text.contains(&format!("x.{ending}: the file is empty; ")) && text.contains("export it again"),
            "{text}"
        );
    }
    // Blank ones have no header; an OBJ file needs none.
    for ending in ["off", "ply", "stl", "glb"] {
        assert!(from(ending, b"\n\n").is_err(), "{ending}");
    }
    // Statements that are not read, and words beside them that are none, make no mesh, either.
    for text in
        ["# nothing\n", "\n\n", "#\n\t# a\n", "mtllib a.mtl\n", "<a>\ncstype bezier\n", "vt 0 0\nwhat 1\n"]
    {
        assert_eq!(from("obj", text.as_bytes()).unwrap(), Contents::default(), "{text:?}");
    }
}
