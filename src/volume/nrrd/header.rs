//! The lines of an NRRD header.

use super::super::error::OpenError;
use std::collections::HashMap;
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};

/// Longer than any header in earnest.
const LONGEST: u64 = 1 << 20;

/// The fields of the format, written without spaces as the lookup has them.
const FIELDS: &[&str] = &[
    "axismaxs",
    "axismins",
    "blocksize",
    "byteskip",
    "centerings",
    "centers",
    "content",
    "datafile",
    "dimension",
    "encoding",
    "endian",
    "kinds",
    "labels",
    "lineskip",
    "max",
    "measurementframe",
    "min",
    "number",
    "oldmax",
    "oldmin",
    "sampleunits",
    "sizes",
    "space",
    "spacedimension",
    "spacedirections",
    "spaceorigin",
    "spaceunits",
    "spacings",
    "thicknesses",
    "type",
    "units",
];

/// A field's value and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Field {
    /// As written in the header.
    pub name: String,
    pub value: String,
    pub line: usize,
}

/// The fields of a header, by lower-case name without spaces.
#[derive(Debug)]
pub(super) struct Header {
    file: PathBuf,
    fields: HashMap<String, Field>,
    /// Bytes of the header, its closing blank line included.
    pub bytes: u64,
    /// Whether a blank line ended the header: attached data begin after it.
    pub closed: bool,
}

impl Header {
    /// Reads up to and including the blank line, or to the end.
    pub fn read(file: &Path, reader: &mut dyn BufRead, notes: &mut Vec<String>) -> Result<Self, OpenError> {
        let mut header = Self { file: file.to_owned(), fields: HashMap::new(), bytes: 0, closed: false };
        let mut line = Vec::new();
        for number in 1.. {
            line.clear();
            let room = LONGEST - header.bytes;
            let got = reader
                .take(room)
                .read_until(b'\n', &mut line)
                .map_err(|source| OpenError::Read { file: file.to_owned(), source })?;
            header.bytes += got as u64;
            if number == 1 {
                magic(file, &line)?;
                continue;
            }
            if got == 0 && room > 0 {
                break;
            }
            if header.bytes >= LONGEST {
                return Err(OpenError::header(
                    file,
                    format!("the header does not end within {LONGEST} bytes"),
                    "Check that a blank line separates header and data",
                ));
            }
            let text = String::from_utf8_lossy(&line);
            let text = text.trim_end_matches(['\n', '\r']);
            if text.is_empty() {
                header.closed = true;
                break;
            }
            header.take(text, number, notes)?;
            // The names of a LIST follow, to the end.
            if header
                .get("datafile")
                .is_some_and(|files| files.value.split_whitespace().next() == Some("LIST"))
            {
                break;
            }
        }
        Ok(header)
    }

    fn take(&mut self, text: &str, line: usize, notes: &mut Vec<String>) -> Result<(), OpenError> {
        if text.starts_with('#') {
            return Ok(());
        }
        let Some((name, value)) = text.split_once(':') else {
            return Err(OpenError::header(
                &self.file,
                format!("line {line} is no `field: value`: \"{}\"", shorten(text)),
                "Correct the line, or put a blank line between header and data",
            ));
        };
        // `key:=value` is the user's own.
        if value.starts_with('=') {
            return Ok(());
        }
        let name = name.trim();
        let key: String = name.to_ascii_lowercase().split_whitespace().collect();
        if !FIELDS.contains(&key.as_str()) {
            notes.push(format!("line {line}: the unknown field \"{}\" is ignored", shorten(name)));
            return Ok(());
        }
        let key = if key == "centerings" { "centers".to_owned() } else { key };
        let field = Field { name: name.to_owned(), value: value.trim().to_owned(), line };
        if let Some(first) = self.fields.insert(key, field) {
            return Err(OpenError::header(
                &self.file,
                format!("the field \"{name}\" stands twice, in lines {} and {line}", first.line),
                "Remove one of the lines",
            ));
        }
        Ok(())
    }

    /// A field, if the header has it.
    pub fn get(&self, key: &str) -> Option<&Field> {
        self.fields.get(key)
    }

    /// A field that must be there.
    pub fn need(&self, key: &str) -> Result<&Field, OpenError> {
        self.get(key).ok_or_else(|| {
            OpenError::header(
                &self.file,
                format!("the header has no field \"{key}\""),
                "Add the line to the header or export the volume again",
            )
        })
    }

    /// An error about a field.
    pub fn bad(&self, field: &Field, problem: impl AsRef<str>) -> OpenError {
        OpenError::header(
            &self.file,
            format!(
                "line {}: the field \"{}\" is \"{}\": {}",
                field.line,
                field.name,
                shorten(&field.value),
                problem.as_ref()
            ),
            "Correct the line or export the volume again",
        )
    }

    /// A field's numbers, exactly `count` of them.
    pub fn numbers(&self, field: &Field, count: usize) -> Result<Vec<f64>, OpenError> {
        let numbers: Result<Vec<f64>, _> = field.value.split_whitespace().map(str::parse).collect();
        match numbers {
            Ok(numbers) if numbers.len() == count => Ok(numbers),
            Ok(numbers) => Err(self.bad(
                field,
                format!("it has {} numbers, not one for each of the {count} axes", numbers.len()),
            )),
            Err(_) => Err(self.bad(field, "not everything in it is a number")),
        }
    }

    /// A field's vectors `(x,y,z)`; `none` gives `None`.
    pub fn vectors(&self, field: &Field) -> Result<Vec<Option<[f64; 3]>>, OpenError> {
        let mut vectors = Vec::new();
        let mut rest = field.value.trim_start();
        while !rest.is_empty() {
            if let Some(after) = rest.strip_prefix("none") {
                vectors.push(None);
                rest = after.trim_start();
                continue;
            }
            let Some((inside, after)) = rest.strip_prefix('(').and_then(|r| r.split_once(')')) else {
                return Err(self.bad(field, "vectors are written (x,y,z)"));
            };
            let numbers: Result<Vec<f64>, _> = inside.split(',').map(|n| n.trim().parse()).collect();
            let Some(numbers) = numbers.ok().and_then(|n| <[f64; 3]>::try_from(n).ok()) else {
                return Err(self.bad(field, "a vector must have three numbers, as in (1,0,0)"));
            };
            vectors.push(Some(numbers));
            rest = after.trim_start();
        }
        Ok(vectors)
    }
}

fn magic(file: &Path, line: &[u8]) -> Result<(), OpenError> {
    let line = line.trim_ascii_end();
    match line.strip_prefix(b"NRRD000") {
        Some([b'1'..=b'5']) => Ok(()),
        _ => Err(OpenError::header(
            file,
            format!(
                "line 1 is \"{}\" where NRRD0001 to NRRD0005 must stand",
                shorten(&line.escape_ascii().to_string())
            ),
            "Check that the file is NRRD and was copied completely",
        )),
    }
}

/// Keeps a message to one line whatever a file holds.
fn shorten(text: &str) -> String {
    let mut short: String = text.chars().filter(|c| !c.is_control()).take(60).collect();
    if text.chars().count() > 60 {
        short.push_str("...");
    }
    short
}
