//! Binary glTF 2.0: one scene, one node, one mesh of indexed triangles.
//!
//! Positions and normals are interleaved as they lie in memory. A mesh without triangles becomes a
//! scene whose node has no mesh: glTF forbids empty accessors.

use std::collections::BTreeMap;
use std::io::{self, Write};

use glam::Vec3;
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Stride, Target, View};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::{Checked, USize64};
use gltf_json::{Accessor, Asset, Buffer, Index, Node, Root, Scene, Value};

use super::{Mesh, Vertex, in_chunks, vertices_le};

const STRIDE: usize = size_of::<Vertex>();
/// Room for the chunk headers and the JSON text, which grows by digits only.
const OVERHEAD: u64 = 1 << 16;

/// Whether the file's length fits the format's u32.
pub(super) fn fits(mesh: &Mesh) -> Result<(), String> {
    let bytes = binary_length(mesh) + OVERHEAD;
    if bytes <= u64::from(u32::MAX) {
        return Ok(());
    }
    Err(format!("GLB files end at 4 GiB, and the mesh takes {bytes} bytes"))
}

fn binary_length(mesh: &Mesh) -> u64 {
    if mesh.triangles.is_empty() {
        return 0;
    }
    (mesh.vertices.len() * STRIDE) as u64 + (mesh.triangles.len() * 12) as u64
}

pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    let mut json = gltf_json::serialize::to_vec(&root(mesh)).map_err(io::Error::other)?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = binary_length(mesh);
    let chunks = 8 + json.len() as u64 + if binary > 0 { 8 + binary } else { 0 };
    // `fits` has seen to it that these are u32.
    let word = |out: &mut dyn Write, n: u64| out.write_all(&(n as u32).to_le_bytes());
    out.write_all(b"glTF")?;
    word(out, 2)?;
    word(out, 12 + chunks)?;
    word(out, json.len() as u64)?;
    out.write_all(b"JSON")?;
    out.write_all(&json)?;
    if binary == 0 {
        return Ok(());
    }
    word(out, binary)?;
    out.write_all(b"BIN\0")?;
    vertices_le(out, &mesh.vertices)?;
    in_chunks(out, &mesh.triangles, |buffer, triangle| {
        triangle.iter().for_each(|v| buffer.extend_from_slice(&v.to_le_bytes()));
        Ok(())
    })
}

fn root(mesh: &Mesh) -> Root {
    let mut root = Root {
        asset: Asset {
            generator: Some(concat!("isoforge ", env!("CARGO_PKG_VERSION")).into()),
            ..Default::default()
        },
        ..Default::default()
    };
    let mut node = Node { name: Some("isosurface".into()), ..Default::default() };
    if !mesh.triangles.is_empty() {
        let primitives = vec![primitive(mesh, &mut root)];
        node.mesh = Some(root.push(gltf_json::Mesh {
            extensions: None,
            extras: Default::default(),
            name: Some("isosurface".into()),
            primitives,
            weights: None,
        }));
    }
    let nodes = vec![root.push(node)];
    let scene = Scene { extensions: None, extras: Default::default(), name: None, nodes };
    root.scene = Some(root.push(scene));
    root
}

fn primitive(mesh: &Mesh, root: &mut Root) -> Primitive {
    let buffer = root.push(Buffer {
        byte_length: USize64(binary_length(mesh)),
        name: None,
        uri: None,
        extensions: None,
        extras: Default::default(),
    });
    let split = mesh.vertices.len() * STRIDE;
    let view = |offset: usize, length: usize, stride: Option<usize>, target: Target| View {
        buffer,
        byte_length: USize64::from(length),
        byte_offset: Some(USize64::from(offset)),
        byte_stride: stride.map(Stride),
        name: None,
        target: Some(Checked::Valid(target)),
        extensions: None,
        extras: Default::default(),
    };
    let vertices = root.push(view(0, split, Some(STRIDE), Target::ArrayBuffer));
    let triangles = root.push(view(split, mesh.triangles.len() * 12, None, Target::ElementArrayBuffer));

    let mut attributes = BTreeMap::new();
    let (low, high) = mesh.bounds().unwrap_or_default();
    let mut positions = accessor(vertices, 0, mesh.vertices.len(), ComponentType::F32, Type::Vec3);
    positions.min = Some(corner(low));
    positions.max = Some(corner(high));
    attributes.insert(Checked::Valid(Semantic::Positions), root.push(positions));
    // glTF wants unit normals or none.
    if mesh.vertices.iter().any(|vertex| vertex.normal != [0.0; 3]) {
        let normals = accessor(vertices, 12, mesh.vertices.len(), ComponentType::F32, Type::Vec3);
        attributes.insert(Checked::Valid(Semantic::Normals), root.push(normals));
    }
    let indices = accessor(triangles, 0, mesh.triangles.len() * 3, ComponentType::U32, Type::Scalar);
    Primitive {
        attributes,
        extensions: None,
        extras: Default::default(),
        indices: Some(root.push(indices)),
        material: None,
        mode: Checked::Valid(Mode::Triangles),
        targets: None,
    }
}

fn accessor(
    view: Index<View>,
    offset: usize,
    count: usize,
    component: ComponentType,
    kind: Type,
) -> Accessor {
    Accessor {
        buffer_view: Some(view),
        byte_offset: Some(USize64::from(offset)),
        count: USize64::from(count),
        component_type: Checked::Valid(GenericComponentType(component)),
        extensions: None,
        extras: Default::default(),
        type_: Checked::Valid(kind),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    }
}

fn corner(p: Vec3) -> Value {
    Value::from(p.to_array().to_vec())
}
