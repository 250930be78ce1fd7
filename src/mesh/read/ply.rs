//! PLY: the header and both binary orders by `ply-rs-bw`, text by lines.

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    BeginList, ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::polygon::Faces;
use super::{Contents, Fault, countable, text};
use crate::mesh::Vertex;

pub(super) fn parse(bytes: &[u8]) -> Result<Contents, Fault> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Other>::new().read_header(&mut reader).map_err(fault)?;
    let mut line = reader.line();
    let mut vertices = Vec::new();
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
                vertices = elements::<PlyVertex>(&mut reader, &mut line, element, &header)?
                    .into_iter()
                    .map(|vertex| vertex.0)
                    .collect();
            }
            "face" => {
                let is_list = |name| {
                    let property = element.properties.get(name);
                    property.is_some_and(|property| matches!(property.data_type, PropertyType::List(..)))
                };
                if !INDICES.into_iter().any(is_list) {
                    return Err(Fault::new("the faces have no list vertex_indices"));
                }
                faces = elements::<Face>(&mut reader, &mut line, element, &header)?;
            }
            "tristrips" => return Err(Fault::unsupported(None, "triangle strips are not supported")),
            _ => drop(elements::<Other>(&mut reader, &mut line, element, &header)?),
        }
    }
    if !header.elements.contains_key("vertex") {
        return Err(Fault::new("the file has no vertices: no element is named vertex"));
    }
    let mut mesh = Faces::with_capacity(faces.len());
    for (i, face) in faces.iter().enumerate() {
        let count = vertices.len();
        if let Some(v) = face.0.iter().find(|&&v| v as usize >= count) {
            // Negative numbers were turned over, as they are in the file.
            return Err(Fault::new(format!("face {i} names vertex {}, but there are {count}", *v as i32)));
        }
        mesh.add(&face.0);
    }
    Ok(mesh.finish(vertices))
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
    line: &mut usize,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, Fault> {
    if header.encoding == Encoding::Ascii {
        return text_elements(reader.get_mut(), line, element);
    }
    let elements = Parser::<E>::new().read_payload_for_element(reader, element, header);
    // The parser counts binary elements as lines.
    elements.map_err(|error| Fault { line: None, ..fault(error) })
}

/// Elements of a text file, a line each. The crate's grammar has no `nan` and no `inf`, which programs write all the same.
fn text_elements<E: PropertyAccess>(
    rest: &mut &[u8],
    line: &mut usize,
    element: &ElementDef,
) -> Result<Vec<E>, Fault> {
    let ElementDef { name: kind, count, properties } = element;
    let mut elements = Vec::with_capacity(*count);
    for i in 0..*count {
        if rest.is_empty() {
            return Err(Fault::new(format!("the file ends where {kind} {i} of {count} should be")));
        }
        let end = rest.iter().position(|&byte| byte == b'\n').map_or(rest.len(), |at| at + 1);
        let (this, after) = rest.split_at(end);
        let this = text(this);
        let mut words = this.split_whitespace();
        let fewer = |name| Fault::at(*line, format!("{kind} {i} ends before all of its {name}"));
        let bad = |word| Fault::at(*line, format!("{kind} {i}: {word:?} is no number of its type"));
        let mut new = E::new();
        for (name, property) in properties {
            let word = words.next().ok_or_else(|| fewer(name))?;
            if let PropertyType::Scalar(_) = property.data_type {
                new.set_float(name, word.parse().map_err(|_| bad(word))?);
                continue;
            }
            let size: usize = word.parse().map_err(|_| bad(word))?;
            let list: Vec<&str> = words.by_ref().take(size).collect();
            if list.len() < size {
                return Err(fewer(name));
            }
            if INDICES.contains(&name.as_str()) {
                let index = |word: &str| {
                    let index = word.parse::<i64>().ok()?;
                    i32::try_from(index).ok().or_else(|| Some(u32::try_from(index).ok()?.cast_signed()))
                };
                let list = list.into_iter().map(|word| index(word).ok_or_else(|| bad(word)));
                new.set_list_int(name, list.collect::<Result<_, _>>()?);
            }
        }
        elements.push(new);
        *rest = after;
        *line += 1;
    }
    Ok(elements)
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
