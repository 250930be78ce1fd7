//! Tables separated by commas, semicolons or tabs, by `csv-core`: the parser beneath `csv`, fed a line
//! at a time. So a stray quotation mark cannot swallow the rest of the file, and rows are the file's
//! lines, comments and empty ones counted.

use super::source::{Growing, Lines, Place, Source, text};
use super::{Component, Loaded, OpenError, OpenOptions};
use csv_core::{ReadRecordResult, Reader, ReaderBuilder};
use std::borrow::Cow;

const SEPARATORS: [u8; 3] = [b'\t', b';', b','];

pub(super) fn read(source: Source, options: &OpenOptions) -> Result<Loaded, OpenError> {
    let mut growing = Growing::new(source.path, options);
    let mut notes = Vec::new();
    let mut lines = source.lines(0);
    let mut table: Option<(Fields, Columns)> = None;
    while let Some((place, line)) = content(&mut lines)? {
        let (fields, columns) = match &mut table {
            Some(table) => table,
            None => {
                let mut fields = Fields::new(separator(line));
                fields.split(place, line)?;
                let (columns, is_header) = Columns::of(place, &fields, &mut notes)?;
                if columns.radius.is_none() {
                    let radius = growing.default_radius(options)?;
                    notes.push(format!("there is no column radius: every component has radius {radius}"));
                }
                table = Some((fields, columns));
                if !is_header {
                    lines.unread();
                }
                continue;
            }
        };
        fields.split(place, line)?;
        growing.push(columns.component(place, fields, options)?)?;
    }
    let why = if table.is_some() { ": there is no row below the header" } else { "" };
    growing.finish(notes, why, "Give rows of x,y,z and, where wanted, radius and weight")
}

/// The next line that is neither empty nor all comment.
fn content<'l>(lines: &'l mut Lines) -> Result<Option<(Place<'l>, &'l [u8])>, OpenError> {
    loop {
        let Some((_, line)) = lines.next()? else { return Ok(None) };
        if !uncommented(line).trim_ascii().is_empty() {
            lines.unread();
            let line = lines.next()?;
            return Ok(line.map(|(place, line)| (place, uncommented(line))));
        }
    }
}

/// The line without its comment. Within quotes `#` may be part of a name. Blanks stay: a tab at either
/// end parts off an empty field.
fn uncommented(line: &[u8]) -> &[u8] {
    if line.contains(&b'"') && !line.trim_ascii_start().starts_with(b"#") {
        return line;
    }
    line.split(|&byte| byte == b'#').next().unwrap_or_default()
}

/// Tabs and semicolons before commas, which may stand for the decimal point.
fn separator(line: &[u8]) -> u8 {
    SEPARATORS.into_iter().find(|separator| line.contains(separator)).unwrap_or(b',')
}

/// The fields of one row.
struct Fields {
    parser: Reader,
    bytes: Vec<u8>,
    ends: Vec<usize>,
    count: usize,
}

impl Fields {
    fn new(separator: u8) -> Self {
        let parser = ReaderBuilder::new().delimiter(separator).build();
        Self { parser, bytes: Vec::new(), ends: Vec::new(), count: 0 }
    }

    fn split(&mut self, place: Place, line: &[u8]) -> Result<(), OpenError> {
        // A line has no more fields than bytes, and one.
        if self.ends.len() < line.len() + 2 {
            self.bytes.resize(line.len() + 1, 0);
            self.ends.resize(line.len() + 2, 0);
        }
        self.parser.reset();
        let (_, _, bytes, ends) = self.parser.read_record(line, &mut self.bytes, &mut self.ends);
        let (rest, more) = (&mut self.bytes[bytes..], &mut self.ends[ends..]);
        let (result, _, _, last) = self.parser.read_record(b"\n", rest, more);
        if result != ReadRecordResult::Record {
            return Err(place.malformed("a quotation mark is not closed", "Close it or leave it out"));
        }
        self.count = ends + last;
        Ok(())
    }

    fn get(&self, at: usize) -> Cow<'_, str> {
        let start = at.checked_sub(1).map_or(0, |before| self.ends[before]);
        text(&self.bytes[start..self.ends[at]])
    }
}

/// Which fields mean what.
struct Columns {
    position: [usize; 3],
    radius: Option<usize>,
    weight: Option<usize>,
    count: usize,
}

impl Columns {
    /// The columns that the first row stands for, and whether it is a header.
    fn of(place: Place, first: &Fields, notes: &mut Vec<String>) -> Result<(Self, bool), OpenError> {
        let names: Vec<String> = (0..first.count).map(|at| first.get(at).trim().to_lowercase()).collect();
        // A number in the first row makes it data, unless the coordinates are named beside it.
        let named = ["x", "y", "z"].iter().all(|name| names.iter().any(|found| found == name));
        if !named && names.iter().any(|name| name.parse::<f32>().is_ok()) {
            return Ok((Self::unnamed(place, names.len())?, false));
        }
        let mut position = [0; 3];
        let find = |wanted: &[&str]| {
            let mut found = (0..names.len()).filter(|&at| wanted.contains(&names[at].as_str()));
            match (found.next(), found.next()) {
                (at, None) => Ok(at),
                (_, Some(_)) => Err(place.malformed(
                    format!("two columns are named {}", wanted.join(" or ")),
                    "Rename the one that is not meant",
                )),
            }
        };
        for (slot, name) in position.iter_mut().zip(["x", "y", "z"]) {
            *slot = find(&[name])?.ok_or_else(|| {
                let shown: String = names.join(", ").chars().take(80).collect();
                place.malformed(
                    format!("the header names no column {name} (it names {shown})"),
                    "Name the columns x, y, z and, where wanted, radius and weight, or leave the header out",
                )
            })?;
        }
        let columns = Self {
            position,
            radius: find(&["radius", "r"])?,
            weight: find(&["weight", "w"])?,
            count: names.len(),
        };
        let unused: Vec<&str> =
            (0..names.len()).filter(|&at| !columns.uses(at)).map(|at| names[at].as_str()).collect();
        if !unused.is_empty() {
            let shown: String = unused.join(", ").chars().take(80).collect();
            notes.push(format!("{} other columns are not used: {shown}", unused.len()));
        }
        Ok((columns, true))
    }

    fn unnamed(place: Place, count: usize) -> Result<Self, OpenError> {
        if !(3..=5).contains(&count) {
            return Err(place.malformed(
                format!("{count} columns, and no header that names them"),
                "Without a header there must be 3 to 5: x, y, z, radius, weight, separated by comma, \
                 semicolon or tab",
            ));
        }
        let present = |at| (at < count).then_some(at);
        Ok(Self { position: [0, 1, 2], radius: present(3), weight: present(4), count })
    }

    fn uses(&self, at: usize) -> bool {
        self.position.contains(&at) || self.radius == Some(at) || self.weight == Some(at)
    }

    fn component(&self, place: Place, row: &Fields, options: &OpenOptions) -> Result<Component, OpenError> {
        if row.count != self.count {
            return Err(place.malformed(
                format!("{} columns, but the first row has {}", row.count, self.count),
                "Give every row the same columns, with a point before decimals",
            ));
        }
        let [x, y, z] = self.position;
        Ok(Component {
            position: [
                place.number("x", &row.get(x))?,
                place.number("y", &row.get(y))?,
                place.number("z", &row.get(z))?,
            ],
            radius: self.radius.map_or(Ok(options.radius), |at| place.radius("radius", &row.get(at)))?,
            weight: self.weight.map_or(Ok(1.0), |at| place.number("weight", &row.get(at)))?,
        })
    }
}
