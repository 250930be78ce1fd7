//! PLY, text and both binary orders, by `ply-rs-bw`.

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    BeginList, ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::{Fault, countable, fan};
use crate::mesh::{Mesh, Vertex};

pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Other>::new().read_header(&mut reader).map_err(fault)?;
    let mut mesh = Mesh::default();
    let mut faces = Vec::new();
    for element in header.elements.values() {
        fits(element, &header, reader.get_ref().len())?;
        match element.name.as_str() {
            "vertex" => {
                for name in ["x", "y", "z"] {
                    let kind = element.properties.get(name).map(|property| &property.data_type);
                    if !matches!(kind, Some(PropertyType::Scalar(_))) {
                        return Err(Fault::new(format!("the vertices have no coordinate {name}")));
                    }
                }
                countable(element.count)?;
                mesh.vertices = elements::<PlyVertex>(&mut reader, element, &header)?
                    .into_iter()
                    .map(|vertex| vertex.0)
                    .collect();
            }
            "face" => {
                if !INDICES.iter().any(|name| element.properties.contains_key(*name)) {
                    return Err(Fault::new("the faces have no property vertex_indices"));
                }
                faces = elements::<Face>(&mut reader, element, &header)?;
            }
            "tristrips" => return Err(Fault::unsupported(None, "triangle strips are not supported")),
            _ => drop(elements::<Other>(&mut reader, element, &header)?),
        }
    }
    if !header.elements.contains_key("vertex") {
        return Err(Fault::new("the file has no vertices: no element is named vertex"));
    }
    for (i, face) in faces.iter().enumerate() {
        if let Some(v) = face.0.iter().find(|&&v| v as usize >= mesh.vertices.len()) {
            let count = mesh.vertices.len();
            // Negative numbers were turned over, as they are in the file.
            return Err(Fault::new(format!("face {i} names vertex {}, but there are {count}", *v as i32)));
        }
        fan(&mut mesh.triangles, &face.0);
    }
    Ok(mesh)
}

fn fault(error: ParseError) -> Fault {
    let what = error.to_string();
    // The first line: what follows repeats the input, which need not be text.
    let what = what.lines().next().unwrap_or("damaged").trim_end_matches('.');
    // The line is said again by the error itself.
    let what = what.split_once(": ").filter(|(line, _)| line.starts_with("Line ")).map_or(what, |(_, w)| w);
    Fault { line: error.line(), ..Fault::new(what) }
}

fn elements<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, Fault> {
    let binary = header.encoding != Encoding::Ascii;
    Parser::<E>::new().read_payload_for_element(reader, element, header).map_err(|error| {
        let fault = fault(error);
        // The parser counts binary elements as lines.
        Fault { line: fault.line.filter(|_| !binary), ..fault }
    })
}

/// Refuses counts that what is left of the file cannot hold: the parser would try.
fn fits(element: &ElementDef, header: &Header, left: usize) -> Result<(), Fault> {
    let size = |kind: &ScalarType| match kind {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let least = |kind: &PropertyType| match (header.encoding, kind) {
        (Encoding::Ascii, _) => 2,
        (_, PropertyType::Scalar(kind)) => size(kind),
        (_, PropertyType::List(count, _)) => size(count),
    };
    let each: usize = element.properties.values().map(|property| least(&property.data_type)).sum();
    // Text may lack the end of its last line.
    if element.count.saturating_mul(each.max(1)) > left.saturating_add(1) {
        let (count, name) = (element.count, &element.name);
        return Err(Fault::new(format!("{count} elements {name} do not fit into the {left} bytes left")));
    }
    Ok(())
}

struct PlyVertex(Vertex);

impl PropertyAccess for PlyVertex {
    fn new() -> Self {
        PlyVertex(Vertex::default())
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        let Vertex { position: [x, y, z], normal: [nx, ny, nz] } = &mut self.0;
        let slot = match name {
            "x" => x,
            "y" => y,
            "z" => z,
            "nx" => nx,
            "ny" => ny,
            "nz" => nz,
            _ => return PropertyAccessResult::Ignored,
        };
        *slot = value;
        PropertyAccessResult::Set
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match property.to_f32_lossy() {
            Some(value) => self.set_float(name, value),
            None => PropertyAccessResult::Ignored,
        }
    }
}

const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

struct Face(Vec<u32>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Face(Vec::new())
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !INDICES.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        match property.to_u32_list() {
            Some(list) => self.0 = list,
            None => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }

    fn set_list_int(&mut self, name: &str, list: Vec<i32>) -> PropertyAccessResult {
        if !INDICES.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        // Negative numbers turn into ones out of range, which is found with the face's number at hand.
        self.0 = bytemuck::cast_vec(list);
        PropertyAccessResult::Set
    }

    fn begin_list_uint(&mut self, name: &str, _len: usize) -> BeginList<'_, u32> {
        if INDICES.contains(&name) { BeginList::Fill(&mut self.0) } else { BeginList::UseSetter }
    }
}

/// An element of no interest.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Other
    }
}
