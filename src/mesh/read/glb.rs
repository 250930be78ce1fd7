//! Binary glTF, by the `gltf` crate.
//!
//! The crate's accessors trust offsets and counts, so each one is compared with the data first.

use glam::{Mat3, Mat4, Vec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Gltf, Node, Primitive, Semantic};

use super::Fault;
use super::polygon::fan;
use crate::mesh::{Mesh, Vertex, triangles_of_strip};

pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    let word = |at: usize| bytes.get(at..at + 4).map(|w| w.iter().rev().fold(0, |n, &b| n << 8 | b as usize));
    if !bytes.starts_with(b"glTF") {
        return Err(Fault::new("not a GLB file: it does not begin with glTF"));
    }
    match word(8) {
        Some(length) if (12..=bytes.len()).contains(&length) => {}
        Some(length) => {
            let what = format!("the header says {length} bytes, but the file has {}", bytes.len());
            return Err(Fault::new(what));
        }
        None => return Err(Fault::new("the file ends within its header")),
    }
    let fault = |error: gltf::Error| match error {
        gltf::Error::Binary(gltf::binary::Error::Io(_)) => Fault::new("the file ends within its data"),
        error => Fault::new(error.to_string()),
    };
    let gltf = Gltf::from_slice_without_validation(bytes).map_err(fault)?;
    let json = gltf.document.into_json();
    // The crate's own validation panics on these.
    let attributes = json.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|p| p.attributes.values());
    if let Some(i) = attributes.map(|index| index.value()).find(|&i| i >= json.accessors.len()) {
        return Err(Fault::new(format!("a primitive names accessor {i}, which does not exist")));
    }
    let document = Document::from_json(json).map_err(fault)?;
    if let Some(extension) = document.extensions_required().next() {
        return Err(Fault::unsupported(None, format!("the file needs the extension {extension}")));
    }
    let blob = gltf.blob.as_deref().unwrap_or_default();

    let mut mesh = Mesh::default();
    let Some(scene) = document.default_scene().or_else(|| document.scenes().next()) else {
        for primitive in document.meshes().flat_map(|mesh| mesh.primitives()) {
            append(&mut mesh, &primitive, Mat4::IDENTITY, blob)?;
        }
        return Ok(mesh);
    };
    // In the order of a walk from the roots. A node has one parent at most, or the file is damaged.
    let mut seen = vec![false; document.nodes().len()];
    let mut waiting: Vec<(Node, Mat4)> = scene.nodes().map(|node| (node, Mat4::IDENTITY)).collect();
    waiting.reverse();
    while let Some((node, parent)) = waiting.pop() {
        if std::mem::replace(&mut seen[node.index()], true) {
            return Err(Fault::new(format!("node {} has two parents", node.index())));
        }
        let matrix = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            append(&mut mesh, &primitive, matrix, blob)?;
        }
        let children = waiting.len();
        waiting.extend(node.children().map(|child| (child, matrix)));
        waiting[children..].reverse();
    }
    Ok(mesh)
}

fn append(mesh: &mut Mesh, primitive: &Primitive, matrix: Mat4, blob: &[u8]) -> Result<(), Fault> {
    if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(());
    }
    let reader = primitive.reader(|_| Some(blob));
    let missing = || Fault::new("a primitive has no positions");
    let positions = primitive.get(&Semantic::Positions).ok_or_else(missing)?;
    vectors(&positions, blob)?;
    let positions = reader.read_positions().ok_or_else(missing)?;
    let base = mesh.vertices.len();
    let new = |position| Vertex { position, normal: [0.0; 3] };
    mesh.vertices.extend(positions.map(new));
    super::countable(mesh.vertices.len())?;
    if let Some(normals) = primitive.get(&Semantic::Normals) {
        vectors(&normals, blob)?;
        for (vertex, normal) in
            mesh.vertices[base..].iter_mut().zip(reader.read_normals().into_iter().flatten())
        {
            vertex.normal = normal;
        }
    }
    // Bits stay where nothing is to be moved.
    if matrix != Mat4::IDENTITY {
        let normals = Mat3::from_mat4(matrix).inverse().transpose();
        for vertex in &mut mesh.vertices[base..] {
            vertex.position = matrix.transform_point3(vertex.at()).to_array();
            vertex.normal = (normals * Vec3::from(vertex.normal)).normalize_or_zero().to_array();
        }
    }

    let count = mesh.vertices.len() - base;
    let indices: Vec<u32> = match primitive.indices() {
        None => (0..count as u32).collect(),
        Some(accessor) => {
            let size = match accessor.data_type() {
                DataType::U8 => 1,
                DataType::U16 => 2,
                DataType::U32 => 4,
                other => return Err(Fault::new(format!("indices of type {other:?}"))),
            };
            within(&accessor, Dimensions::Scalar, size, blob)?;
            reader.read_indices().map(|indices| indices.into_u32().collect()).unwrap_or_default()
        }
    };
    if let Some(i) = indices.iter().position(|&v| v as usize >= count) {
        let what = format!("triangle {} names vertex {}, but there are {count}", i / 3, indices[i]);
        return Err(Fault::new(what));
    }
    let first = mesh.triangles.len();
    match primitive.mode() {
        Mode::TriangleFan => fan(&mut mesh.triangles, &indices),
        Mode::TriangleStrip => mesh.triangles.extend(triangles_of_strip(&indices)),
        _ => {
            let (triangles, rest) = indices.as_chunks();
            if !rest.is_empty() {
                return Err(Fault::new(format!(
                    "{} indices are no whole number of triangles",
                    indices.len()
                )));
            }
            mesh.triangles.extend_from_slice(triangles);
        }
    }
    let mirrored = matrix.determinant() < 0.0;
    for triangle in &mut mesh.triangles[first..] {
        *triangle = triangle.map(|v| v + base as u32);
        if mirrored {
            triangle.swap(1, 2);
        }
    }
    Ok(())
}

fn vectors(accessor: &Accessor, blob: &[u8]) -> Result<(), Fault> {
    if accessor.data_type() != DataType::F32 {
        return Err(Fault::new(format!("positions or normals of type {:?}", accessor.data_type())));
    }
    within(accessor, Dimensions::Vec3, 12, blob)
}

/// Checks that an accessor has the shape expected and lies within the data.
fn within(accessor: &Accessor, shape: Dimensions, size: usize, blob: &[u8]) -> Result<(), Fault> {
    let i = accessor.index();
    if accessor.sparse().is_some() {
        return Err(Fault::unsupported(None, format!("accessor {i} is sparse")));
    }
    let view = accessor.view().ok_or_else(|| Fault::new(format!("accessor {i} has no data")))?;
    if !matches!(view.buffer().source(), gltf::buffer::Source::Bin) {
        return Err(Fault::unsupported(None, "the data lies in another file"));
    }
    let stride = view.stride().unwrap_or(size);
    let end = accessor
        .count()
        .checked_sub(1)
        .and_then(|last| last.checked_mul(stride)?.checked_add(size)?.checked_add(accessor.offset()));
    let view_end = view.offset().checked_add(view.length());
    let fits = end.is_some_and(|end| end <= view.length())
        && view_end.is_some_and(|end| end <= blob.len())
        && stride >= size
        && accessor.dimensions() == shape;
    fits.then_some(()).ok_or_else(|| Fault::new(format!("accessor {i} does not fit its data")))
}
