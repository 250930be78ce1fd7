//! Files cut short, bent, and lying: an error that says where, or a mesh, but never a panic.

use std::fs;

use isoforge::mesh::Mesh;
use isoforge::mesh::read::{ReadError, read};
use isoforge::mesh::write::{ENDINGS, write};
use serde_json::json;

use crate::shapes::{both, cube, tetrahedron};

/// A GLB file of a JSON text and whole further chunks.
pub fn glb(json: &serde_json::Value, chunks: &[u8]) -> Vec<u8> {
    let mut text = serde_json::to_vec(json).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((20 + text.len() as u32 + chunks.len() as u32).to_le_bytes());
    file.extend((text.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(text);
    file.extend(chunks);
    file
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    fn read(&self, ending: &str, bytes: &[u8]) -> Result<Mesh, ReadError> {
        let path = self.0.path().join(format!("x.{ending}"));
        fs::write(&path, bytes).unwrap();
        Ok(read(&path)?.mesh)
    }

    fn bytes(&self, mesh: &Mesh, ending: &str) -> Vec<u8> {
        let path = self.0.path().join(format!("whole.{ending}"));
        write(mesh, &path).unwrap();
        fs::read(path).unwrap()
    }

    /// The error without the path and the remedy.
    fn fault(&self, ending: &str, bytes: impl AsRef<[u8]>) -> String {
        let error = self.read(ending, bytes.as_ref()).unwrap_err().to_string();
        let place = error.find(&format!("x.{ending}")).expect("the error names the file");
        let (what, remedy) = error[place + 2 + ending.len()..].split_once(';').expect("a remedy");
        assert!(remedy.contains("export it again") || remedy.contains("in another format"), "{remedy}");
        format!("{what}.")
    }
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
                   endfacet\nendsolid a\n";

#[test]
fn cut_anywhere() {
    let folder = Folder::new();
    for (ending, whole, tail) in ENDINGS
        .map(|ending| (ending, folder.bytes(&tetrahedron(), ending), 0))
        .into_iter()
        .chain([("ply", PLY.into(), 2), ("stl", STL.into(), 3)])
    {
        // OFF and OBJ may lose the last line's end, or digits of a number; OBJ whole lines.
        let tail = match ending {
            "off" => 2,
            "obj" => whole.len(),
            _ => tail,
        };
        for length in 0..whole.len() {
            let result = folder.read(ending, &whole[..length]);
            assert!(result.is_err() || length + tail >= whole.len(), "{ending} cut to {length}: {result:?}");
        }
    }
}

#[test]
fn bent_anywhere() {
    let folder = Folder::new();
    for ending in ENDINGS {
        let whole = folder.bytes(&both(&tetrahedron(), &cube(), [3.0; 3]), ending);
        for i in 0..whole.len().min(1500) {
            for bent in [whole[i] ^ 1, whole[i] ^ 0x80, 0, 0xff, b'9', b' '] {
                let mut file = whole.clone();
                file[i] = bent;
                if let Ok(mesh) = folder.read(ending, &file) {
                    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.vertices.len()));
                    mesh.check();
                }
            }
        }
    }
    for (ending, whole) in [("ply", PLY), ("stl", STL)] {
        for i in 0..whole.len() {
            for bent in [0, 0xff, b'9', b' ', b'\n', b'-'] {
                let mut file = whole.as_bytes().to_vec();
                file[i] = bent;
                let _ = folder.read(ending, &file);
            }
        }
    }
}

#[test]
fn lying_counts_and_indices() {
    let folder = Folder::new();
    let off = |text: &str| folder.fault("off", text);
    assert_eq!(
        off("OFF\n4000000000 1 0\n0 0 0\n"),
        ", line 2: 4000000000 vertices and 1 faces do not fit into the file."
    );
    assert_eq!(off("OFF\n1 1 0\n0 0 0\n3 0 0 1\n"), ", line 4: face 0 names vertex 1, but there are 1.");
    assert_eq!(
        off("OFF\n1 1 0\n0 0 0\n99999999999 0\n"),
        ", line 4: face 0 should have 99999999999 corners, and has 1."
    );
    assert_eq!(off("OFF\n2 0 0\n0 0 0\n"), ": the file ends where vertex 1 of 2 should be.");
    assert_eq!(off("OFF\n1 0 0\n0 zero 0\n"), ", line 3: \"zero\" is not a number.");
    assert_eq!(off("PLY\n"), ", line 1: not an OFF file: the word OFF is missing.");
    assert_eq!(off("OFF BINARY\n"), ", line 1: binary OFF files are not supported.");

    let obj = |text: &str| folder.fault("obj", text);
    assert_eq!(obj("v 0 0 0\nf 1 1 2\n"), ", line 2: a face names vertex 2, but the file has 1.");
    assert_eq!(
        obj("v 0 0 0\nf 1 1 1\nf 1 1 -2\n"),
        ", line 3: face 1 names vertex -2, which does not exist."
    );
    assert_eq!(obj("v 0 0 0\nf 0 1 1\n"), ", line 2: face 0 names vertex 0, which does not exist.");
    assert_eq!(obj("v 0 0 0\nf 1//1 1//1 1//1\n"), ", line 2: a face names normal 1, but the file has 0.");
    assert_eq!(
        obj("v 0 0 0\nf 1 1 99999999999999999999\n"),
        ", line 2: face 0: \"99999999999999999999\" is not the number of a vertex."
    );
    assert_eq!(obj("v 0 0\n"), ", line 1: three numbers expected, found fewer.");
    assert_eq!(
        obj("# of the web\n<html>\n<p>v 0 0 0</p>\n</html>\n"),
        ", line 2: \"<html>\" begins no statement of OBJ, and no line has one: v, vn, vt or f expected."
    );
    // A word may be as long as the file.
    assert!(obj(&"x".repeat(1 << 20)).len() < 200);

    let ply = |from: &str, to: &str| folder.fault("ply", PLY.replace(from, to));
    assert_eq!(ply("3 0 1 2", "3 0 1 3"), ": face 0 names vertex 3, but there are 3.");
    assert_eq!(ply("3 0 1 2", "3 0 1 -1"), ": face 0 names vertex -1, but there are 3.");
    assert_eq!(
        ply("face 1", "face 999999999999"),
        ": 999999999999 elements face do not fit into the 8 bytes left."
    );
    assert!(ply("vertex 3", "vertex 18446744073709551615").contains("do not fit"));
    assert_eq!(ply("property float z", "property float w"), ": the vertices have no coordinate z.");
    assert_eq!(ply("1 0 0", "1 zero 0"), ", line 11: vertex 1: \"zero\" is no number of its type.");
    assert_eq!(ply("1 0 0", "1 0"), ", line 11: vertex 1 ends before all of its z.");
    assert_eq!(ply("3 0 1 2", "4 0 1 2"), ", line 13: face 0 ends before all of its vertex_indices.");
    assert_eq!(ply("3 0 1 2", "3 0 1 1.5"), ", line 13: face 0: \"1.5\" is no number of its type.");
    assert_eq!(ply("3 0 1 2\n", ""), ": 1 elements face do not fit into the 0 bytes left.");
    assert_eq!(ply("face 1", "face 2"), ": the file ends where face 1 of 2 should be.");
    assert_eq!(ply("vertex_indices", "corners"), ": the faces have no list vertex_indices.");
    // No properties: elements without end that take no room.
    let endless = "ply\nformat binary_little_endian 1.0\nelement x 99999999999999\nend_header\n";
    assert!(folder.fault("ply", endless).contains("do not fit"));

    let mut stl = folder.bytes(&tetrahedron(), "stl");
    stl[83] = 0xff;
    assert!(folder.fault("stl", &stl).starts_with(": the header promises 4278190084 triangles"));
    assert!(folder.fault("stl", STL.replace("vertex 1 0 0", "vertex 1 0")).starts_with(": triangle 0: "));
    assert!(folder.fault("stl", &STL[..60]).contains("without endsolid"));
}

#[test]
fn lying_accessors() {
    let folder = Folder::new();
    let whole = folder.bytes(&tetrahedron(), "glb");
    let json_length = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    let good: serde_json::Value = serde_json::from_slice(&whole[20..20 + json_length]).unwrap();
    let chunk = &whole[20 + json_length..];
    assert_eq!(folder.read("glb", &glb(&good, chunk)).unwrap(), tetrahedron());
    let lies = [
        ("/accessors/0/count", json!(5)),
        ("/accessors/0/count", json!(0)),
        ("/accessors/0/count", json!(u64::MAX)),
        ("/accessors/0/byteOffset", json!(u64::MAX)),
        ("/accessors/0/byteOffset", json!(1000)),
        ("/accessors/0/type", json!("VEC2")),
        ("/accessors/0/componentType", json!(5121)),
        ("/accessors/1/componentType", json!(5123)),
        ("/accessors/2/componentType", json!(5126)),
        ("/accessors/2/type", json!("VEC3")),
        ("/accessors/2/count", json!(13)),
        ("/accessors/2/count", json!(11)),
        ("/accessors/0/bufferView", json!(7)),
        ("/accessors/0/min", json!([0, 0])),
        ("/accessors", json!([])),
        ("/bufferViews/0/byteLength", json!(u64::MAX)),
        ("/bufferViews/0/byteOffset", json!(u64::MAX)),
        ("/bufferViews/0/byteStride", json!(4)),
        ("/bufferViews/0/byteStride", json!(0)),
        ("/buffers/0/uri", json!("elsewhere.bin")),
        ("/nodes/0/children", json!([0])),
        ("/scenes/0/nodes", json!([0, 0])),
        ("/scenes/0/nodes", json!([3])),
        ("/meshes/0/primitives/0/attributes", json!({})),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(2)),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9)),
        ("/meshes/0/primitives/0/indices", json!(0)),
        ("/meshes/0/primitives/0/indices", json!(9)),
        ("/meshes/0/primitives/0/mode", json!(9)),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"])),
    ];
    for (place, lie) in lies {
        let mut json = good.clone();
        let (parent, key) = place.rsplit_once('/').unwrap();
        json.pointer_mut(parent).unwrap()[key] = lie.clone();
        let result = folder.read("glb", &glb(&json, chunk));
        assert!(result.is_err(), "{place} = {lie}: {result:?}");
    }
    // Without its data, and with an index too many.
    assert!(folder.read("glb", &glb(&good, &[])).is_err());
    let mut chunk = chunk.to_vec();
    let last = chunk.len() - 4;
    chunk[last] = 4;
    assert_eq!(folder.fault("glb", glb(&good, &chunk)), ": triangle 3 names vertex 4, but there are 4.");
}
