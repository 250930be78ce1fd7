//! Binary glTF 2.0: one scene, one node, one mesh of indexed triangles, or one triangle strip.
//!
//! Positions and normals are interleaved as they lie in memory; colours and values follow, each by themselves. A mesh
//! without triangles becomes a scene whose node has no mesh: glTF forbids empty accessors.

use std::collections::BTreeMap;
use std::io::{self, Write};

use glam::Vec3;
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Stride, Target, View};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::{Checked, USize64};
use gltf_json::{Accessor, Asset, Buffer, Index, Node, Root, Scene, Value};

use super::{Extra, Mesh, Vertex, floats_le, in_chunks, vertices_le};
use crate::colour::linear;

const STRIDE: usize = size_of::<Vertex>();
/// Bytes of a colour: four u16, the last opaque.
const COLOUR: usize = 8;
/// Room for the chunk headers and the JSON text, which grows by digits only.
const OVERHEAD: u64 = 1 << 16;

/// Whether the file's length fits the format's u32.
pub(super) fn fits(mesh: &Mesh, extra: &Extra) -> Result<(), String> {
    let bytes = Parts::of(mesh, extra).total() + OVERHEAD;
    if bytes <= u64::from(u32::MAX) {
        return Ok(());
    }
    Err(format!("GLB files end at 4 GiB, and the mesh takes {bytes} bytes"))
}

/// Bytes of each part of the buffer, in its order.
struct Parts {
    vertices: u64,
    colours: u64,
    values: u64,
    indices: u64,
}

impl Parts {
    fn of(mesh: &Mesh, extra: &Extra) -> Self {
        if is_empty(mesh, extra) {
            return Self { vertices: 0, colours: 0, values: 0, indices: 0 };
        }
        let vertices = mesh.vertices.len() as u64;
        let coloured = if extra.colours.is_some() { vertices } else { 0 };
        Self {
            vertices: vertices * STRIDE as u64,
            colours: coloured * COLOUR as u64,
            values: coloured * 4,
            indices: 4 * extra.strip.map_or(mesh.triangles.len() as u64 * 3, |strip| strip.len() as u64),
        }
    }

    fn total(&self) -> u64 {
        self.vertices + self.colours + self.values + self.indices
    }
}

pub(super) fn write(mesh: &Mesh, extra: &Extra, out: &mut impl Write) -> io::Result<()> {
    let parts = Parts::of(mesh, extra);
    let mut json = gltf_json::serialize::to_vec(&root(mesh, extra, &parts)).map_err(io::Error::other)?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = parts.total();
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
    if let Some(coloured) = extra.colours {
        let steps = f32::from(u16::MAX);
        let linear: Vec<[u8; 2]> =
            (0..=255).map(|byte| ((linear(byte) * steps).round() as u16).to_le_bytes()).collect();
        in_chunks(out, &coloured.colours, |buffer, colour| {
            colour.iter().for_each(|&byte| buffer.extend_from_slice(&linear[usize::from(byte)]));
            buffer.extend_from_slice(&u16::MAX.to_le_bytes());
            Ok(())
        })?;
        in_chunks(out, &coloured.values, |buffer, &value| floats_le(buffer, &[number(value)]))?;
    }
    let indices = extra.strip.unwrap_or(mesh.triangles.as_flattened());
    in_chunks(out, indices, |buffer, v| {
        buffer.extend_from_slice(&v.to_le_bytes());
        Ok(())
    })
}

fn is_empty(mesh: &Mesh, extra: &Extra) -> bool {
    extra.strip.map_or(mesh.triangles.is_empty(), <[u32]>::is_empty)
}

/// glTF has finite numbers alone.
fn number(value: f32) -> f32 {
    if value.is_finite() { value } else { 0.0 }
}

fn root(mesh: &Mesh, extra: &Extra, parts: &Parts) -> Root {
    let mut root = Root {
        asset: Asset {
            generator: Some(concat!("isoforge ", env!("CARGO_PKG_VERSION")).into()),
            ..Default::default()
        },
        ..Default::default()
    };
    let mut node = Node { name: Some("isosurface".into()), ..Default::default() };
    if !is_empty(mesh, extra) {
        let primitives = vec![primitive(mesh, extra, parts, &mut root)];
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

fn primitive(mesh: &Mesh, extra: &Extra, parts: &Parts, root: &mut Root) -> Primitive {
    let buffer = root.push(Buffer {
        byte_length: USize64::from(parts.total()),
        name: None,
        uri: None,
        extensions: None,
        extras: Default::default(),
    });
    let mut offset = 0;
    let mut view = |length: u64, stride: Option<usize>, target: Target| {
        let view = View {
            buffer,
            byte_length: USize64::from(length),
            byte_offset: Some(USize64::from(offset)),
            byte_stride: stride.map(Stride),
            name: None,
            target: Some(Checked::Valid(target)),
            extensions: None,
            extras: Default::default(),
        };
        offset += length;
        root.push(view)
    };
    let vertices = view(parts.vertices, Some(STRIDE), Target::ArrayBuffer);
    let coloured = extra.colours.map(|coloured| {
        let colours = view(parts.colours, Some(COLOUR), Target::ArrayBuffer);
        (coloured, colours, view(parts.values, Some(4), Target::ArrayBuffer))
    });
    let indices = view(parts.indices, None, Target::ElementArrayBuffer);

    let count = mesh.vertices.len();
    let mut attributes = BTreeMap::new();
    let (low, high) = mesh.bounds().unwrap_or_default();
    let mut positions = accessor(vertices, 0, count, ComponentType::F32, Type::Vec3);
    positions.min = Some(corner(low));
    positions.max = Some(corner(high));
    attributes.insert(Checked::Valid(Semantic::Positions), root.push(positions));
    // glTF wants unit normals or none.
    if mesh.vertices.iter().any(|vertex| vertex.normal != [0.0; 3]) {
        let normals = accessor(vertices, 12, count, ComponentType::F32, Type::Vec3);
        attributes.insert(Checked::Valid(Semantic::Normals), root.push(normals));
    }
    if let Some((coloured, colours, values)) = coloured {
        let mut colours = accessor(colours, 0, count, ComponentType::U16, Type::Vec4);
        colours.normalized = true;
        attributes.insert(Checked::Valid(Semantic::Colors(0)), root.push(colours));
        let mut values = accessor(values, 0, count, ComponentType::F32, Type::Scalar);
        let ends = |(low, high): (f32, f32), value: &f32| (low.min(number(*value)), high.max(number(*value)));
        let (low, high) = coloured.values.iter().fold((f32::MAX, f32::MIN), ends);
        (values.min, values.max) = (Some(Value::from(vec![low])), Some(Value::from(vec![high])));
        attributes.insert(Checked::Valid(Semantic::Extras("VALUE".into())), root.push(values));
    }
    let (mode, length) = match extra.strip {
        Some(strip) => (Mode::TriangleStrip, strip.len()),
        None => (Mode::Triangles, mesh.triangles.len() * 3),
    };
    let indices = accessor(indices, 0, length, ComponentType::U32, Type::Scalar);
    Primitive {
        attributes,
        extensions: None,
        extras: Default::default(),
        indices: Some(root.push(indices)),
        material: None,
        mode: Checked::Valid(mode),
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
