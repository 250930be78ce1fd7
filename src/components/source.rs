//! What the readers share: lines of bounded length, numbers with their place, and components that grow
//! under a limit.

use super::{Component, Loaded, OpenError, OpenOptions};
use flate2::bufread::MultiGzDecoder;
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// Bytes of the longest line: no row needs more, and a file without line ends must not fill the memory.
const LONGEST_LINE: usize = 1 << 16;

/// A file's bytes, unpacked.
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub stream: Box<dyn BufRead>,
}

impl<'a> Source<'a> {
    pub fn open(path: &'a Path, gzip: bool) -> Result<Self, OpenError> {
        let failed = |source| OpenError::Read { path: path.to_owned(), source };
        // Asked before opening: opening a FIFO for reading would wait for a writer.
        if !std::fs::metadata(path).map_err(failed)?.is_file() {
            return Err(OpenError::NotAFile { path: path.to_owned() });
        }
        let file = BufReader::with_capacity(1 << 16, File::open(path).map_err(failed)?);
        let stream: Box<dyn BufRead> = match gzip {
            true => Box::new(BufReader::with_capacity(1 << 16, MultiGzDecoder::new(file))),
            false => Box::new(file),
        };
        Ok(Self { path, stream })
    }

    /// The file's lines, of which `passed` have been read.
    pub fn lines(self, passed: u64) -> Lines<'a> {
        Lines { source: self, line: Vec::new(), row: passed, again: false }
    }
}

/// Sorts an error met while reading: damage is told apart from the disk's failures.
pub(super) fn reading(path: &Path, source: io::Error) -> OpenError {
    let path = path.to_owned();
    match source.kind() {
        io::ErrorKind::UnexpectedEof => {
            OpenError::Corrupt { path, what: "it ends in the middle of its compressed data".to_owned() }
        }
        io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput => {
            OpenError::Corrupt { path, what: format!("the compressed data does not decode ({source})") }
        }
        _ => OpenError::Read { path, source },
    }
}

/// Lines without their ends.
pub(super) struct Lines<'a> {
    source: Source<'a>,
    line: Vec<u8>,
    row: u64,
    again: bool,
}

impl<'a> Lines<'a> {
    /// The next line and its place; `None` at the end.
    pub fn next(&mut self) -> Result<Option<(Place<'a>, &[u8])>, OpenError> {
        let path = self.source.path;
        if !std::mem::take(&mut self.again) {
            self.line.clear();
            let mut limited = (&mut self.source.stream).take(LONGEST_LINE as u64 + 1);
            if limited.read_until(b'\n', &mut self.line).map_err(|error| reading(path, error))? == 0 {
                return Ok(None);
            }
            self.row += 1;
        }
        let place = self.place();
        if self.line.len() > LONGEST_LINE {
            return Err(place.malformed(
                format!("the line is longer than {LONGEST_LINE} bytes"),
                "Check that this is a text file of the format that its ending says",
            ));
        }
        let line = self.line.strip_suffix(b"\n").unwrap_or(&self.line);
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        // What spreadsheets put before UTF-8.
        let mark = if self.row == 1 { "\u{feff}" } else { "" };
        Ok(Some((place, line.strip_prefix(mark.as_bytes()).unwrap_or(line))))
    }

    /// The place of the line read last.
    pub fn place(&self) -> Place<'a> {
        Place { path: self.source.path, record: "row", number: self.row }
    }

    /// Has the next call give this line again.
    pub fn unread(&mut self) {
        self.again = true;
    }
}

/// The text of a line or field. Bytes that are not UTF-8 matter only where a number is wanted.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// Where something stands in a file.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub path: &'a Path,
    pub record: &'static str,
    pub number: u64,
}

impl Place<'_> {
    pub fn malformed(&self, problem: impl Into<String>, remedy: &'static str) -> OpenError {
        let row = Some(self.number);
        OpenError::Malformed { path: self.path.to_owned(), row, problem: problem.into(), remedy }
    }

    pub fn value(&self, column: &str, found: &str, problem: &'static str) -> OpenError {
        const LONGEST: usize = 40;
        let mut shown: String = found.chars().take(LONGEST).collect();
        if shown.len() < found.len() {
            shown.push('…');
        }
        OpenError::Value {
            path: self.path.to_owned(),
            record: self.record,
            number: self.number,
            column: column.to_owned(),
            found: shown,
            problem,
        }
    }

    /// A finite number.
    pub fn number(&self, column: &str, text: &str) -> Result<f32, OpenError> {
        let number = text.trim().parse().map_err(|_| self.value(column, text.trim(), "is not a number"))?;
        self.finite(column, number).map_err(|_| self.value(column, text.trim(), NOT_FINITE))
    }

    /// A finite number above 0.
    pub fn radius(&self, column: &str, text: &str) -> Result<f32, OpenError> {
        let radius = self.number(column, text)?;
        if radius > 0.0 { Ok(radius) } else { Err(self.value(column, text.trim(), NOT_POSITIVE)) }
    }

    /// The number, if it is finite.
    pub fn finite(&self, column: &str, number: f32) -> Result<f32, OpenError> {
        if number.is_finite() { Ok(number) } else { Err(self.value(column, &number.to_string(), NOT_FINITE)) }
    }

    /// The number, if it is finite and above 0.
    pub fn positive(&self, column: &str, number: f32) -> Result<f32, OpenError> {
        let radius = self.finite(column, number)?;
        if radius > 0.0 { Ok(radius) } else { Err(self.value(column, &radius.to_string(), NOT_POSITIVE)) }
    }

    /// An atom of weight 1.
    pub fn atom<'t>(
        &self,
        element: &str,
        radius: Option<f32>,
        columns: [(&str, Cow<'t, str>); 3],
    ) -> Result<Component, OpenError> {
        let mut position = [0.0; 3];
        for (coordinate, (column, text)) in position.iter_mut().zip(&columns) {
            *coordinate = self.number(column, text)?;
        }
        let unknown = || OpenError::Element {
            path: self.path.to_owned(),
            row: self.number,
            element: element.chars().take(40).collect(),
        };
        Ok(Component { position, radius: radius.ok_or_else(unknown)?, weight: 1.0 })
    }
}

const NOT_FINITE: &str = "is not a finite 32-bit number";
const NOT_POSITIVE: &str = "is not above 0";

/// The components read so far.
pub(super) struct Growing<'a> {
    path: &'a Path,
    limit: Option<u64>,
    components: Vec<Component>,
}

const COMPONENT: u64 = size_of::<Component>() as u64;

impl<'a> Growing<'a> {
    pub fn new(path: &'a Path, options: &OpenOptions) -> Self {
        Self { path, limit: options.max_bytes, components: Vec::new() }
    }

    /// The radius of components without one.
    pub fn default_radius(&self, options: &OpenOptions) -> Result<f32, OpenError> {
        let radius = options.radius;
        let sound = radius.is_finite() && radius > 0.0;
        sound.then_some(radius).ok_or_else(|| OpenError::Radius { path: self.path.to_owned(), radius })
    }

    /// Refuses a promised count that passes the limit. Nothing is set aside for it: it may be a lie.
    pub fn promised(&self, count: u64) -> Result<(), OpenError> {
        let bytes = count.saturating_mul(COMPONENT);
        match self.limit {
            Some(limit) if bytes > limit => {
                Err(OpenError::TooMany { path: self.path.to_owned(), bytes, limit })
            }
            _ => Ok(()),
        }
    }

    pub fn push(&mut self, component: Component) -> Result<(), OpenError> {
        let have = self.components.len();
        if have == self.components.capacity() {
            self.promised(have as u64 + 1)?;
            // Doubled, but never beyond the limit.
            let most = self.limit.map_or(usize::MAX, |limit| (limit / COMPONENT) as usize);
            let want = have.saturating_mul(2).max(1 << 10).min(most);
            self.components.try_reserve_exact(want - have).map_err(|_| OpenError::Memory {
                path: self.path.to_owned(),
                bytes: want as u64 * COMPONENT,
            })?;
        }
        self.components.push(component);
        Ok(())
    }

    pub fn len(&self) -> usize {
        self.components.len()
    }

    /// The result; `why` and `remedy` are for an empty one.
    pub fn finish(self, notes: Vec<String>, why: &str, remedy: &'static str) -> Result<Loaded, OpenError> {
        if self.components.is_empty() {
            return Err(OpenError::Empty { path: self.path.to_owned(), why: why.to_owned(), remedy });
        }
        Ok(Loaded { components: self.components, notes })
    }
}
