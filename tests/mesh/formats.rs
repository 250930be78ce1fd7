//! Each writer against a reader that is not ours, and ours against files it did not write.

use std::fs;
use std::path::{Path, PathBuf};

use isoforge::mesh::Mesh;
use isoforge::mesh::read::{ENDINGS, ReadError, read};
use isoforge::mesh::write::{self, is_mesh_ending, write};
use ply_rs_bw::ply::{DefaultElement, Property};

use crate::shapes::{both, cube, mesh, tetrahedron, torus};

/// Numbers that need all their digits, and extremes.
fn awkward() -> Mesh {
    let mut mesh = torus(9, 5);
    mesh.vertices[0].position = [0.1, -0.0, 1.0e-38];
    mesh.vertices[1].position = [f32::MAX, f32::MIN_POSITIVE, 1.0e-45];
    mesh.vertices[2].position = [16_777_217.0, -1.0 / 3.0, 123_456.79];
    mesh.vertices[3].normal = [0.577_350_26, -0.577_350_26, 0.577_350_26];
    mesh
}

fn written(mesh: &Mesh, name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let bytes = write(mesh, &path).unwrap();
    assert_eq!(bytes, fs::metadata(&path).unwrap().len());
    (folder, path)
}

fn bits(points: impl IntoIterator<Item = [f32; 3]>) -> Vec<[u32; 3]> {
    points.into_iter().map(|p| p.map(f32::to_bits)).collect()
}

fn positions(mesh: &Mesh) -> Vec<[u32; 3]> {
    bits(mesh.vertices.iter().map(|v| v.position))
}

fn normals(mesh: &Mesh) -> Vec<[u32; 3]> {
    bits(mesh.vertices.iter().map(|v| v.normal))
}

fn threes<T: Copy>(flat: &[T]) -> Vec<[T; 3]> {
    flat.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect()
}

#[test]
fn off_by_a_few_lines() {
    let mesh = awkward();
    let (_folder, path) = written(&mesh, "a.off");
    let text = fs::read_to_string(path).unwrap();
    let mut words = text.split_whitespace();
    assert_eq!(words.next(), Some("OFF"));
    let mut count = || words.next().unwrap().parse::<usize>().unwrap();
    let (vertices, faces, _) = (count(), count(), count());
    let numbers: Vec<f64> = text.split_whitespace().skip(4).map(|word| word.parse().unwrap()).collect();
    let (corners, rest) = numbers.split_at(3 * vertices);
    assert_eq!(bits(threes(corners).iter().map(|p| p.map(|x| x as f32))), positions(&mesh));
    assert_eq!(rest.len(), 4 * faces);
    let triangles: Vec<[u32; 3]> = rest.chunks(4).map(|f| [f[1] as u32, f[2] as u32, f[3] as u32]).collect();
    assert_eq!(triangles, mesh.triangles);
}

#[test]
fn obj_by_tobj() {
    let mesh = awkward();
    let (_folder, path) = written(&mesh, "a.obj");
    let (models, _) = tobj::load_obj(&path, &tobj::LoadOptions::default()).unwrap();
    assert_eq!(models.len(), 1);
    let found = &models[0].mesh;
    // tobj numbers in the order of use: compare corner by corner.
    let at = |flat: &[f32], i: u32| threes(flat)[i as usize];
    let corners = |flat: &[f32], indices: &[u32]| bits(indices.iter().map(|&i| at(flat, i)));
    let want: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let ours = |all: &[[u32; 3]]| want.iter().map(|&v| all[v as usize]).collect::<Vec<_>>();
    assert_eq!(corners(&found.positions, &found.indices), ours(&positions(&mesh)));
    assert_eq!(corners(&found.normals, &found.normal_indices), ours(&normals(&mesh)));
}

#[test]
fn ply_by_ply_rs() {
    let mesh = awkward();
    let (_folder, path) = written(&mesh, "a.ply");
    let parser = ply_rs_bw::parser::Parser::<DefaultElement>::new();
    let ply = parser.read_ply(&mut fs::File::open(path).unwrap()).unwrap();
    let get = |e: &DefaultElement, names: [&str; 3]| {
        names.map(|name| match e.get(name) {
            Some(Property::Float(x)) => *x,
            other => panic!("{name}: {other:?}"),
        })
    };
    let all = |names| bits(ply.payload["vertex"].iter().map(|e| get(e, names)));
    assert_eq!(all(["x", "y", "z"]), positions(&mesh));
    assert_eq!(all(["nx", "ny", "nz"]), normals(&mesh));
    let faces: Vec<Vec<u32>> =
        ply.payload["face"].iter().map(|e| e["vertex_indices"].to_u32_list().unwrap()).collect();
    assert_eq!(faces, mesh.triangles.iter().map(|t| t.to_vec()).collect::<Vec<_>>());
}

#[test]
fn stl_by_stl_io() {
    let mesh = torus(9, 5);
    let (_folder, path) = written(&mesh, "a.stl");
    assert_eq!(fs::metadata(&path).unwrap().len(), 84 + 50 * 90);
    let found = stl_io::read_stl(&mut fs::File::open(path).unwrap()).unwrap();
    found.validate().unwrap();
    assert_eq!((found.vertices.len(), found.faces.len()), (45, 90));
    for (face, triangle) in found.faces.iter().zip(&mesh.triangles) {
        let corners = triangle.map(|v| mesh.vertices[v as usize].at());
        assert_eq!(face.vertices.map(|v| glam::Vec3::from(found.vertices[v].0)), corners);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        assert!((glam::Vec3::from(face.normal.0) - normal).length() < 1e-5);
    }
}

#[test]
fn glb_by_gltf() {
    let mesh = awkward();
    let (_folder, path) = written(&mesh, "a.glb");
    let bytes = fs::read(&path).unwrap();
    assert_eq!(
        (bytes.len() % 4, bytes.len() as u32),
        (0, u32::from_le_bytes(bytes[8..12].try_into().unwrap()))
    );
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
    assert_eq!(document.as_json().asset.generator.as_deref().map(|g| g.starts_with("isoforge")), Some(true));
    let node = document.default_scene().unwrap().nodes().next().unwrap();
    let primitive = node.mesh().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| blob.as_deref());
    assert_eq!(bits(reader.read_positions().unwrap()), positions(&mesh));
    assert_eq!(bits(reader.read_normals().unwrap()), normals(&mesh));
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    assert_eq!(threes(&indices), mesh.triangles);
    let (low, high) = mesh.bounds().unwrap();
    let bounds = primitive.bounding_box();
    assert_eq!((bounds.min, bounds.max), (low.to_array(), high.to_array()));
    for accessor in document.accessors() {
        assert!(accessor.view().unwrap().target().is_some() && accessor.offset() % 4 == 0);
    }
}

#[test]
fn ours_reads_ours() {
    for ending in ENDINGS {
        for whole in [awkward(), both(&torus(4, 3), &cube(), [7.0; 3])] {
            let (_folder, path) = written(&whole, &format!("a.{}", ending.to_uppercase()));
            assert!(is_mesh_ending(&path));
            let found = read(&path).unwrap().mesh;
            if ending == "stl" {
                assert_eq!(found.triangles.len(), whole.triangles.len());
                let (a, b) = (found.check(), whole.check());
                assert_eq!(
                    (a.boundary_edges, a.genus, a.components),
                    (b.boundary_edges, b.genus, b.components)
                );
                continue;
            }
            assert_eq!(found.triangles, whole.triangles, "{ending}");
            assert_eq!(positions(&found), positions(&whole), "{ending}");
            if ending == "off" {
                assert!(found.vertices.iter().all(|v| v.normal == [0.0; 3]));
            } else {
                assert_eq!(normals(&found), normals(&whole), "{ending}");
            }
        }
    }
}

#[test]
fn nothing_is_a_valid_file() {
    for ending in ENDINGS {
        let (_folder, path) = written(&Mesh::default(), &format!("none.{ending}"));
        assert_eq!(read(&path).unwrap().mesh, Mesh::default(), "{ending}");
        if ending == "glb" {
            let document = gltf::Gltf::open(&path).unwrap().document;
            assert_eq!(
                (document.meshes().count(), document.buffers().count(), document.scenes().count()),
                (0, 0, 1)
            );
        }
    }
    // Vertices without triangles, and normals that are all zero.
    let points = mesh(&[[1.0; 3]], &[]);
    for ending in write::ENDINGS {
        written(&points, &format!("points.{ending}"));
    }
    let mut bare = tetrahedron();
    bare.vertices.iter_mut().for_each(|v| v.normal = [0.0; 3]);
    let (_folder, path) = written(&bare, "bare.glb");
    assert_eq!(read(&path).unwrap().mesh, bare);
}

fn from_text(name: &str, text: &str) -> Result<Mesh, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    Ok(read(&path)?.mesh)
}

#[test]
fn off_of_others() {
    let text = "# made by hand\nNOFF # normals\n\n4 2 0\n0 0 0 0 0 1\n1 0 0 0 0 1 # corner\n1 1 0 0 0 1\n0 1 0 0 0 1\n\
                4 0 1 2 3 255 0 0\n3 0 1 2\n";
    let mesh = from_text("a.off", text).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(mesh.vertices[3].normal, [0.0, 0.0, 1.0]);
    assert_eq!(
        from_text("a.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 2 1 0\n").unwrap().triangles,
        [[2, 1, 0]]
    );
}

#[test]
fn obj_of_others() {
    let text = "mtllib none.mtl\no first\nv 0 0 0 1 0.5 0.5\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nvn 0 1 0\n\
                g a\nusemtl x\nf 1/1/1 2/1/1 3//1 4//1 # quad\ng b\nl 1 2\nf -4//2 \\\n-2//2 -1//2\nf 1 2 5\nv 5 5 5\n";
    let mesh = from_text("a.obj", text).unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (5, 4));
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 3], [0, 1, 4]]);
    assert_eq!((mesh.vertices[1].normal, mesh.vertices[4].normal), ([0.0, 0.0, 1.0], [0.0; 3]));
    let unit = 0.5f32.sqrt();
    assert!((glam::Vec3::from(mesh.vertices[3].normal) - glam::vec3(0.0, unit, unit)).length() < 1e-6);
}

#[test]
fn ply_of_others() {
    let text = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty double x\nproperty double y\n\
                property int z\nproperty uchar red\nelement edge 1\nproperty int vertex1\nelement face 2\n\
                property list uchar short vertex_index\nproperty float quality\nend_header\n\
                0 0 0 255\n1 0 0 255\n1 1 0 255\n0 1.5 2 255\n7\n4 0 1 2 3 0.5\n3 0 1 2 1\n";
    let mesh = from_text("a.ply", text).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!((mesh.vertices[3].position, mesh.vertices[3].normal), ([0.0, 1.5, 2.0], [0.0; 3]));

    let mut big =
        b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                    property float z\nelement face 1\nproperty list uchar uint vertex_indices\nend_header\n"
            .to_vec();
    for x in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0] {
        big.extend(x.to_be_bytes());
    }
    big.push(3);
    for v in [2u32, 0, 1] {
        big.extend(v.to_be_bytes());
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("big.ply");
    fs::write(&path, big).unwrap();
    let mesh = read(&path).unwrap().mesh;
    assert_eq!((mesh.triangles[0], mesh.vertices[2].position), ([2, 0, 1], [0.0, 2.0, 0.0]));
}

#[test]
fn stl_of_others() {
    let facet = |z: f32| {
        format!(
            "facet normal 0 0 1\n outer loop\n  vertex 0 0 {z}\n  VERTEX 1 0 {z}\n  vertex 0 1E0 {z}\n \
             endloop\nendfacet\n"
        )
    };
    let text =
        format!("solid\n{}endsolid\nSOLID two words\n{}endsolid two words\n\n", facet(0.0), facet(1.0));
    let mesh = from_text("a.stl", &text).unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (6, 2));
    assert_eq!(mesh.vertices[5].position, [0.0, 1.0, 1.0]);
    assert_eq!(mesh.vertices[5].normal, [0.0, 0.0, 1.0]);

    // A binary file may begin like a text one.
    let (_folder, path) = written(&cube(), "b.stl");
    let mut bytes = fs::read(&path).unwrap();
    bytes[..12].copy_from_slice(b"solid hello\n");
    fs::write(&path, bytes).unwrap();
    assert_eq!(read(&path).unwrap().mesh.check().genus, Some(0));
}

#[test]
fn glb_nodes_place_their_meshes() {
    let (_folder, path) = written(&cube(), "a.glb");
    // A mirror and a move, through the JSON chunk.
    let bytes = fs::read(&path).unwrap();
    let json_length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + json_length]).unwrap();
    json["nodes"][0]["scale"] = serde_json::json!([-2.0, 1.0, 1.0]);
    json["nodes"]
        .as_array_mut()
        .unwrap()
        .push(serde_json::json!({"children": [0], "translation": [10.0, 0.0, 0.0]}));
    json["scenes"][0]["nodes"] = serde_json::json!([1]);
    fs::write(&path, crate::damage::glb(&json, &bytes[20 + json_length..])).unwrap();
    let r = read(&path).unwrap().mesh.check();
    assert_eq!(r.bounds, Some([[8.0, 0.0, 0.0], [10.0, 1.0, 1.0]]));
    assert!(!r.has_defects() && (r.volume - 2.0).abs() < 1e-9);
}

#[test]
fn unknown_endings_are_refused() {
    for name in ["a.stlx", "a", "a.", ".off", "off"] {
        assert!(!is_mesh_ending(Path::new(name)), "{name}");
        let error = read(Path::new(name)).unwrap_err();
        assert!(matches!(&error, ReadError::UnknownEnding { .. }) && error.to_string().contains(".glb"));
    }
    assert!(matches!(read(Path::new("no/such.ply")), Err(ReadError::Io { .. })));
}

/// Some editors begin a file with a byte order mark.
#[test]
fn a_byte_order_mark_is_no_statement() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::write(&path, "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mesh = read(&path).unwrap().mesh;
    assert_eq!((mesh.vertices.len(), &mesh.triangles[..]), (3, &[[0, 1, 2]][..]));
}

/// A line of a million pieces, each of which cost a copy of all before.
#[test]
fn long_continued_lines_of_obj() {
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {}3\nf 1 2 3\n", "\\\n".repeat(1 << 20));
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::write(&path, text).unwrap();
    let since = std::time::Instant::now();
    let mesh = read(&path).unwrap().mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2]; 2]);
    assert!(since.elapsed().as_secs() < 10, "{:?}", since.elapsed());
}
