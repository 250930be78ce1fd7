//! PLY points, text and both binary orders: the header and binary elements by `ply-rs-bw`, an element
//! at a time. Lines are split here, so that a bad number is shown with its column.

use super::source::{Growing, Place, Source, reading, text};
use super::{Component, Loaded, OpenError, OpenOptions};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType};
use std::io::{BufRead, ErrorKind, Read};
use std::path::Path;

/// Bytes of the longest header.
const LONGEST_HEADER: u64 = 1 << 20;

const REMEDY: &str = "Copy or export the file again";

pub(super) fn read(source: Source, options: &OpenOptions) -> Result<Loaded, OpenError> {
    let Source { path, stream } = source;
    let mut reader = Reader::new(stream.take(LONGEST_HEADER));
    let header =
        Parser::<Point>::new().read_header(&mut reader).map_err(|error| fault(path, &error, REMEDY))?;
    // The reader counts the line that it would read next.
    let passed = (reader.line() as u64).saturating_sub(1);
    let source = Source { path, stream: reader.into_inner().into_inner() };

    let elements: Vec<&ElementDef> = header.elements.values().collect();
    let Some(at) = elements.iter().position(|element| element.name == "vertex") else {
        return Err(malformed(path, "no element is named vertex", "Save the points as vertices"));
    };
    let (before, vertices) = (&elements[..at], elements[at]);
    // Lists could be of any length.
    let list = elements[..=at].iter().find(|element| element.properties.values().any(is_list));
    if let Some(element) = list {
        let problem = format!("the element {} has lists and is not behind the vertices", element.name);
        return Err(malformed(path, problem, "Save the vertices first, without lists"));
    }
    for name in ["x", "y", "z"] {
        if !vertices.properties.contains_key(name) {
            let problem = format!("the vertices have no coordinate {name}");
            return Err(malformed(path, problem, "Save it with x, y and z"));
        }
    }

    let mut growing = Growing::new(path, options);
    growing.promised(vertices.count as u64)?;
    let mut notes = Vec::new();
    if !["radius", "scale"].iter().any(|name| vertices.properties.contains_key(*name)) {
        let radius = growing.default_radius(options)?;
        notes.push(format!("the vertices have no radius: every component has radius {radius}"));
    }
    for element in elements.iter().filter(|element| element.name != "vertex" && element.count > 0) {
        notes.push(format!("{} elements {} are not used", element.count, element.name));
    }
    match header.encoding {
        Encoding::Ascii => from_text(source, passed, before, vertices, options, &mut growing)?,
        order => from_binary(source, order, before, vertices, options, &mut growing)?,
    }
    growing.finish(notes, ": the header promises 0 vertices", "Give a file with vertices")
}

fn is_list(property: &ply_rs_bw::ply::PropertyDef) -> bool {
    matches!(property.data_type, PropertyType::List(..))
}

fn malformed(path: &Path, problem: impl Into<String>, remedy: &'static str) -> OpenError {
    OpenError::Malformed { path: path.to_owned(), row: None, problem: problem.into(), remedy }
}

fn fault(path: &Path, error: &ParseError, remedy: &'static str) -> OpenError {
    let what = error.to_string();
    // The first line: what follows repeats the input, which need not be text. The row is said apart.
    let what = what.lines().next().unwrap_or("damaged").trim_end_matches('.');
    let what = what.split_once(": ").filter(|(line, _)| line.starts_with("Line ")).map_or(what, |(_, w)| w);
    let row = error.line().map(|line| line as u64);
    OpenError::Malformed { path: path.to_owned(), row, problem: what.to_owned(), remedy }
}

fn cut(path: &Path, element: &ElementDef, read: usize) -> OpenError {
    let (count, name) = (element.count, &element.name);
    malformed(path, format!("{count} elements {name} are promised, but the file ends after {read}"), REMEDY)
}

fn from_text(
    source: Source,
    passed: u64,
    before: &[&ElementDef],
    vertices: &ElementDef,
    options: &OpenOptions,
    growing: &mut Growing,
) -> Result<(), OpenError> {
    let path = source.path;
    let mut lines = source.lines(passed);
    for element in before {
        for read in 0..element.count {
            lines.next()?.ok_or_else(|| cut(path, element, read))?;
        }
    }
    for read in 0..vertices.count {
        let (place, line) = lines.next()?.ok_or_else(|| cut(path, vertices, read))?;
        let line = text(line);
        let mut words = line.split_whitespace();
        let mut point = Point::new();
        for name in vertices.properties.keys() {
            let word = words.next().unwrap_or("");
            if let Some(slot) = point.slot(name) {
                *slot = Some(place.number(name, word)?);
            }
        }
        growing.push(point.component(place, options)?)?;
    }
    Ok(())
}

fn from_binary(
    source: Source,
    order: Encoding,
    before: &[&ElementDef],
    vertices: &ElementDef,
    options: &OpenOptions,
    growing: &mut Growing,
) -> Result<(), OpenError> {
    let Source { path, mut stream } = source;
    for element in before.iter().filter(|element| !element.properties.is_empty()) {
        for read in 0..element.count {
            next(path, &mut stream, order, element, read)?;
        }
    }
    for read in 0..vertices.count {
        let point = next(path, &mut stream, order, vertices, read)?;
        let place = Place { path, record: "vertex", number: read as u64 + 1 };
        growing.push(point.component(place, options)?)?;
    }
    Ok(())
}

fn next(
    path: &Path,
    stream: &mut impl BufRead,
    order: Encoding,
    element: &ElementDef,
    read: usize,
) -> Result<Point, OpenError> {
    let parser = Parser::<Point>::new();
    let point = match order {
        Encoding::BinaryBigEndian => parser.read_big_endian_element(stream, element),
        _ => parser.read_little_endian_element(stream, element),
    };
    point.map_err(|error| match error.kind() {
        ErrorKind::UnexpectedEof => cut(path, element, read),
        ErrorKind::InvalidData | ErrorKind::InvalidInput => fault(path, &error, REMEDY),
        _ => reading(path, error.into()),
    })
}

/// What was found of a vertex.
#[derive(Default)]
struct Point {
    position: [Option<f32>; 3],
    radius: Option<f32>,
    scale: Option<f32>,
    weight: Option<f32>,
}

impl Point {
    fn slot(&mut self, name: &str) -> Option<&mut Option<f32>> {
        let [x, y, z] = &mut self.position;
        Some(match name {
            "x" => x,
            "y" => y,
            "z" => z,
            "radius" => &mut self.radius,
            "scale" => &mut self.scale,
            "weight" => &mut self.weight,
            _ => return None,
        })
    }

    fn component(self, place: Place, options: &OpenOptions) -> Result<Component, OpenError> {
        let [x, y, z] = self.position.map(|coordinate| coordinate.unwrap_or(f32::NAN));
        Ok(Component {
            position: [place.finite("x", x)?, place.finite("y", y)?, place.finite("z", z)?],
            radius: match (self.radius, self.scale) {
                (Some(radius), _) => place.positive("radius", radius)?,
                (None, Some(scale)) => place.positive("scale", scale)?,
                (None, None) => options.radius,
            },
            weight: self.weight.map_or(Ok(1.0), |weight| place.finite("weight", weight))?,
        })
    }
}

impl PropertyAccess for Point {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match (self.slot(name), property.to_f32_lossy()) {
            (Some(slot), Some(value)) => {
                *slot = Some(value);
                PropertyAccessResult::Set
            }
            _ => PropertyAccessResult::Ignored,
        }
    }
}
