//! NRRD, with attached (`.nrrd`) or detached (`.nhdr`) header.

mod header;

use super::decode::{Coding, Endian, Loss, Scalar, read_values};
use super::error::OpenError;
use super::planes::{Located, Starts, no_planes};
use super::source::{Placement, Source, finish, layout, reserve, skip};
use super::{OpenOptions, Opened, Values, opened};
use crate::grid::Grid;
use glam::{DMat3, DVec3};
use header::{Field, Header};
use std::io::{BufRead, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

#[derive(Debug, Clone, Copy, PartialEq)]
enum Encoding {
    Raw,
    Gzip,
    Text,
}

/// What a header says, and the file with the values.
struct Head {
    source: Source,
    header: Header,
    /// First byte behind the header, where the values are in the same file.
    start: u64,
    encoding: Encoding,
    coding: Coding,
    sizes: [u64; 3],
    grid: Grid,
    /// Bytes of the values.
    need: u64,
    notes: Vec<String>,
}

pub(super) fn read(path: &Path, options: &OpenOptions) -> Result<Opened, OpenError> {
    let mut head = head(path, options)?;
    let skips = find(&mut head)?;
    let (grid, coding) = (head.grid, head.coding);
    let (values, loss, mut notes) = values(head, skips)?;
    loss.notes(&coding, &mut notes);
    opened(path, grid, values, notes)
}

/// Where the values lie.
pub(super) fn locate(path: &Path, options: &OpenOptions) -> Result<Located, OpenError> {
    let mut head = head(path, options)?;
    if head.encoding != Encoding::Raw {
        return Err(no_planes(path, "compressed, or text"));
    }
    let [at, bytes] = find(&mut head)?;
    head.source.must_hold(head.need.saturating_add(bytes), at, false)?;
    let Head { source, grid, coding, notes, .. } = head;
    Ok(Located { path: source.path, grid, coding, starts: Starts::Together(at + bytes), notes })
}

fn head(path: &Path, options: &OpenOptions) -> Result<Head, OpenError> {
    let mut notes = Vec::new();
    let mut source = Source::open(path)?;
    let header = Header::read(path, &mut source.reader, &mut notes)?;

    let scalar = scalar(path, &header)?;
    let encoding = encoding(path, &header)?;
    let endian = match header.get("endian") {
        Some(field) => field.value.parse().map_err(|_| header.bad(field, "it must be little or big"))?,
        None if scalar.size() == 1 || encoding == Encoding::Text => Endian::Little,
        None => {
            return Err(OpenError::header(
                path,
                format!("the header has no field \"endian\", which values of type {scalar} need"),
                "Add the line \"endian: little\" or \"endian: big\"",
            ));
        }
    };
    let axes = axes(path, &header)?;
    let place = placement(&header, &axes, &mut notes)?;
    let coding = Coding { text: encoding == Encoding::Text, ..Coding::plain(scalar, endian) };
    let (grid, need) = layout(path, axes.sizes, &coding, &place, options)?;

    let mut start = header.bytes;
    if let Some(field) = header.get("datafile") {
        source = Source::open(&data_file(path, &header, field)?)?;
        start = 0;
    } else if !header.closed {
        return Err(OpenError::header(
            path,
            "the header is not followed by a blank line and data, and has no field \"data file\"",
            "Name the data file, or use the file that the data are attached to",
        ));
    }
    Ok(Head { source, header, start, encoding, coding, sizes: axes.sizes, grid, need, notes })
}

fn scalar(path: &Path, header: &Header) -> Result<Scalar, OpenError> {
    let field = header.need("type")?;
    let words: Vec<&str> = field.value.split_whitespace().collect();
    Ok(match words.join(" ").to_ascii_lowercase().as_str() {
        "signed char" | "int8" | "int8_t" => Scalar::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Scalar::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Scalar::U16,
        "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        _ => {
            return Err(OpenError::unsupported(
                path,
                format!("line {}: the type \"{}\"", field.line, field.value),
                "Save the volume as (u)int8, (u)int16, (u)int32, float or double",
            ));
        }
    })
}

fn encoding(path: &Path, header: &Header) -> Result<Encoding, OpenError> {
    let field = header.need("encoding")?;
    Ok(match field.value.to_ascii_lowercase().as_str() {
        "raw" => Encoding::Raw,
        "gzip" | "gz" => Encoding::Gzip,
        "txt" | "text" | "ascii" => Encoding::Text,
        _ => {
            return Err(OpenError::unsupported(
                path,
                format!("line {}: the encoding \"{}\"", field.line, field.value),
                "Save the volume with encoding raw, gzip or ascii",
            ));
        }
    })
}

/// The three axes of space among those of the file.
struct Axes {
    /// Samples along them.
    sizes: [u64; 3],
    /// Which of the file's axes they are.
    of: Vec<usize>,
    /// How many axes the file has.
    count: usize,
}

/// Whether a kind names the parts of one sample, not a direction to go.
fn is_component(kind: &str) -> bool {
    let kind = kind.to_ascii_lowercase();
    kind.starts_with(|c: char| c.is_ascii_digit())
        || ["complex", "vector", "color", "normal", "gradient", "quaternion", "matrix", "tensor"]
            .iter()
            .any(|part| kind.contains(part))
}

fn axes(path: &Path, header: &Header) -> Result<Axes, OpenError> {
    let field = header.need("dimension")?;
    let count: usize = field.value.parse().map_err(|_| header.bad(field, "it must be a whole number"))?;
    if !(3..=4).contains(&count) {
        return Err(header.bad(field, "a volume has 3 dimensions (or 4, one of them of size 1)"));
    }
    let field = header.need("sizes")?;
    let sizes: Result<Vec<u64>, _> = field.value.split_whitespace().map(str::parse).collect();
    let sizes = sizes.map_err(|_| header.bad(field, "sizes must be whole numbers"))?;
    if sizes.len() != count {
        return Err(header.bad(field, format!("it has {} sizes where dimension is {count}", sizes.len())));
    }
    if sizes.contains(&0) {
        return Err(header.bad(field, "no size may be 0"));
    }
    let kinds: Vec<&str> = header.get("kinds").map_or(Vec::new(), |f| f.value.split_whitespace().collect());
    let component = kinds.iter().position(|kind| is_component(kind));
    let mut of: Vec<usize> = (0..count).collect();
    if count == 3 {
        if let (Some(axis), Some(field)) = (component, header.get("kinds")) {
            return Err(
                header.bad(field, format!("axis {axis} does not lie in space, so the file is no volume"))
            );
        }
    } else {
        let mut without = None;
        if let Some(field) = header.get("spacedirections") {
            without = header.vectors(field)?.iter().position(Option::is_none);
        }
        // Told by the directions, else by the kinds, else by its size at either end of the list.
        let time = kinds
            .iter()
            .position(|kind| ["list", "time", "stub"].contains(&kind.to_ascii_lowercase().as_str()));
        let guess = if sizes[0] == 1 { 0 } else { 3 };
        let dropped = without.or(component).or(time).unwrap_or(guess).min(3);
        if sizes[dropped] != 1 {
            return Err(OpenError::unsupported(
                path,
                format!("line {}: a fourth axis of more than one sample ({})", field.line, field.value),
                "Extract one component or one time step (with teem: unu slice)",
            ));
        }
        of.remove(dropped);
    }
    Ok(Axes { sizes: [sizes[of[0]], sizes[of[1]], sizes[of[2]]], of, count })
}

fn placement(header: &Header, axes: &Axes, notes: &mut Vec<String>) -> Result<Placement, OpenError> {
    if let Some(field) = header.get("spacedirections") {
        let all = header.vectors(field)?;
        if all.len() != axes.count {
            let problem =
                format!("it has {} vectors, not one for each of the {} axes", all.len(), axes.count);
            return Err(header.bad(field, problem));
        }
        let mut columns = [DVec3::ZERO; 3];
        for (column, &axis) in columns.iter_mut().zip(&axes.of) {
            let Some(vector) = all[axis] else {
                return Err(header.bad(field, format!("axis {axis} has no direction in space")));
            };
            *column = DVec3::from(vector);
        }
        let mut origin = DVec3::ZERO;
        if let Some(field) = header.get("spaceorigin") {
            match header.vectors(field)?.as_slice() {
                [Some(at)] => origin = DVec3::from(*at),
                _ => return Err(header.bad(field, "it must be one vector")),
            }
        }
        return Ok(Placement {
            origin,
            step: DMat3::from_cols(columns[0], columns[1], columns[2]),
            what: format!("line {}: the field \"{}\" (with its origin)", field.line, field.name),
            remedy: "Give three finite vectors that span a volume",
        });
    }

    let mut spacing = [1.0; 3];
    let mut origin = [0.0; 3];
    let list = |key: &str| -> Result<Option<[f64; 3]>, OpenError> {
        let Some(field) = header.get(key) else { return Ok(None) };
        let all = header.numbers(field, axes.count)?;
        Ok(Some([all[axes.of[0]], all[axes.of[1]], all[axes.of[2]]]))
    };
    let (spacings, mins, maxs) = (list("spacings")?, list("axismins")?, list("axismaxs")?);
    let centers: Vec<&str> =
        header.get("centers").map_or(Vec::new(), |f| f.value.split_whitespace().collect());
    for axis in 0..3 {
        let name = ["x", "y", "z"][axis];
        // A cell-centred axis goes from border to border, any other from sample to sample.
        let cell = centers.get(axes.of[axis]).is_some_and(|c| c.eq_ignore_ascii_case("cell"));
        let min = mins.map(|m| m[axis]).filter(|m| m.is_finite());
        let max = maxs.map(|m| m[axis]).filter(|m| m.is_finite());
        let samples = axes.sizes[axis] as f64;
        let steps = if cell { samples } else { samples - 1.0 };
        let given = spacings.map(|s| s[axis]);
        spacing[axis] = match (given.filter(|s| !s.is_nan()), min, max) {
            (Some(spacing), ..) => spacing,
            (None, Some(min), Some(max)) if steps > 0.0 => (max - min) / steps,
            _ => {
                if given.is_some() {
                    notes.push(format!("the spacing along {name} is unknown (nan); 1 is used"));
                }
                1.0
            }
        };
        if let Some(min) = min {
            origin[axis] = if cell { min + 0.5 * spacing[axis] } else { min };
        }
    }
    if let Some(field) = header.get("spaceorigin") {
        match header.vectors(field)?.as_slice() {
            [Some(at)] => origin = *at,
            _ => return Err(header.bad(field, "it must be one vector")),
        }
    }
    if header.get("spacings").is_none() && maxs.is_none() {
        notes.push("the header gives no spacing; 1 is used".to_owned());
    }
    Ok(Placement {
        origin: DVec3::from(origin),
        step: DMat3::from_diagonal(DVec3::from(spacing)),
        what: "the fields \"spacings\" and \"axis mins\" or \"axis maxs\"".to_owned(),
        remedy: "Give finite spacings that are not zero",
    })
}

/// The one file that a detached header names.
fn data_file(path: &Path, header: &Header, field: &Field) -> Result<PathBuf, OpenError> {
    let value = &field.value;
    let many = |what: &str| {
        Err(OpenError::unsupported(
            path,
            format!("line {}: {what} of data files", field.line),
            "Join the slices into one file (with teem: unu save)",
        ))
    };
    let first = value.split_whitespace().next().unwrap_or("");
    if first.is_empty() {
        return Err(header.bad(field, "it names no file"));
    }
    if first == "LIST" {
        return many("a LIST");
    }
    let file = path.parent().unwrap_or(Path::new("")).join(value);
    // "name%03d.raw 1 20 1": told from a file that has a percent sign in its name.
    if first.contains('%') && !file.exists() {
        return many("a numbered pattern");
    }
    Ok(file)
}

/// Finds the values: the byte that the file is now read up to, and how many more are to be skipped.
fn find(head: &mut Head) -> Result<[u64; 2], OpenError> {
    let Head { source, header, encoding, .. } = head;
    let whole = |key: &str, lowest: i64| -> Result<i64, OpenError> {
        let Some(field) = header.get(key) else { return Ok(0) };
        match field.value.parse::<i64>() {
            Ok(n) if n >= lowest => Ok(n),
            _ => Err(header.bad(field, format!("it must be a whole number, {lowest} or more"))),
        }
    };
    let lines = whole("lineskip", 0)?;
    let bytes = whole("byteskip", -1)?;
    let path = source.path.clone();
    let mut at = head.start;
    if bytes == -1 {
        if *encoding != Encoding::Raw {
            let field = header.need("byteskip")?;
            return Err(header.bad(field, "-1 goes with encoding raw only"));
        }
        // The values are the last thing in the file, whatever stands before them.
        source.must_hold(head.need, at, false)?;
        at = source.len - head.need;
        source.reader.seek(SeekFrom::Start(at)).map_err(|e| OpenError::reading(&path, e))?;
    } else {
        for line in 0..lines {
            let passed = source.reader.skip_until(b'\n').map_err(|e| OpenError::reading(&path, e))?;
            if passed == 0 {
                return Err(OpenError::corrupt(
                    &path,
                    format!("it ends after {line} of {lines} lines to skip"),
                ));
            }
            at += passed as u64;
        }
    }
    Ok([at, u64::try_from(bytes).unwrap_or(0)])
}

fn values(head: Head, [at, bytes]: [u64; 2]) -> Result<(Values, Loss, Vec<String>), OpenError> {
    let Head { source, encoding, coding, sizes, need, mut notes, .. } = head;
    let path = source.path.clone();
    let gzip = encoding == Encoding::Gzip;
    let reserve = reserve(source.len, gzip, coding.scalar.size());
    if encoding == Encoding::Text {
        let mut stream = source.into_stream(false);
        skip(&path, &mut stream, bytes, "bytes to skip")?;
        let (values, loss) = text(&path, &mut stream, sizes, &coding)?;
        return Ok((values, loss, notes));
    }
    source.must_hold(need.saturating_add(bytes), at, gzip)?;
    let mut stream = source.into_stream(gzip);
    skip(&path, &mut stream, bytes, "bytes to skip")?;
    let (values, loss) = read_values(&path, &mut stream, sizes, &coding, reserve)?;
    finish(&path, &mut stream, &mut notes)?;
    Ok((values, loss, notes))
}

/// Numbers between white space.
fn text(
    path: &Path,
    stream: &mut dyn Read,
    dims: [u64; 3],
    coding: &Coding,
) -> Result<(Values, Loss), OpenError> {
    let mut text = Vec::new();
    stream.read_to_end(&mut text).map_err(|e| OpenError::reading(path, e))?;
    let count = dims[0] * dims[1] * dims[2];
    let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    // A number and the space behind it take two bytes or more.
    let truncated = |have: u64| OpenError::Truncated {
        file: path.to_owned(),
        need: 2 * count - 1,
        have: format!("as text, there are only {have} numbers"),
    };
    if count > text.len() as u64 {
        return Err(truncated(words.count() as u64));
    }
    let mut values = Vec::new();
    values.try_reserve(count as usize).map_err(|_| OpenError::no_memory(path, dims))?;
    let mut loss = Loss::default();
    for _ in 0..count {
        let Some(word) = words.next() else {
            return Err(truncated(values.len() as u64));
        };
        let parsed = std::str::from_utf8(word).ok().and_then(|word| match coding.scalar {
            // Straight to f32: through f64 it would be rounded twice.
            Scalar::F32 => word.parse::<f32>().ok(),
            _ => word.parse::<f64>().ok().map(|value| loss.convert(value)),
        });
        let Some(value) = parsed else {
            let word: String = word.iter().take(30).flat_map(|b| b.escape_ascii()).map(char::from).collect();
            return Err(OpenError::corrupt(path, format!("value {} is \"{word}\", no number", values.len())));
        };
        values.push(value);
    }
    if words.next().is_some() {
        return Err(OpenError::header(
            path,
            format!("there are more numbers than the {count} that sizes asks for"),
            "Correct the sizes",
        ));
    }
    Ok((values.into(), loss))
}
