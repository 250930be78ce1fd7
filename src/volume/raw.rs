//! Raw files: values with no header, laid out as the caller says.

use super::decode::{Coding, Endian, Scalar, read_values};
use super::error::OpenError;
use super::planes::{Located, Starts};
use super::source::{Placement, Source, layout, reserve, skip};
use super::{OpenOptions, Opened, opened};
use crate::grid::Grid;
use glam::{DMat3, Vec3};
use std::path::Path;

/// How a raw file is laid out. Values are stored x fastest, then y, then z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawLayout {
    /// Samples along x, y, z; at least 2 each.
    pub dims: [u32; 3],
    /// The type of a value.
    pub scalar: Scalar,
    /// The byte order of a value.
    pub endian: Endian,
    /// Way from a sample to the next along x, y, z, in world units.
    pub spacing: [f32; 3],
    /// World position of sample (0, 0, 0).
    pub origin: [f32; 3],
    /// Bytes before the first value.
    pub skip_bytes: u64,
}

impl RawLayout {
    /// Little-endian values from the first byte on, 1 unit apart, the first at the world's origin.
    pub fn new(dims: [u32; 3], scalar: Scalar) -> Self {
        Self { dims, scalar, endian: Endian::Little, spacing: [1.0; 3], origin: [0.0; 3], skip_bytes: 0 }
    }
}

/// A file that is as long as its layout says.
struct Head<'a> {
    raw: &'a RawLayout,
    source: Source,
    grid: Grid,
    coding: Coding,
    notes: Vec<String>,
}

pub(super) fn read(path: &Path, options: &OpenOptions) -> Result<Opened, OpenError> {
    let Head { raw, source, grid, coding, mut notes } = head(path, options)?;
    let reserve = reserve(source.len, false, raw.scalar.size());
    let mut stream = source.into_stream(false);
    skip(path, &mut stream, raw.skip_bytes, "header that are skipped")?;
    let (values, loss) = read_values(path, &mut stream, raw.dims.map(u64::from), &coding, reserve)?;
    loss.notes(&coding, &mut notes);
    opened(path, grid, values, notes)
}

/// Where the values lie.
pub(super) fn locate(path: &Path, options: &OpenOptions) -> Result<Located, OpenError> {
    let Head { raw, source, grid, coding, notes } = head(path, options)?;
    Ok(Located { path: source.path, grid, coding, starts: Starts::Together(raw.skip_bytes), notes })
}

fn head<'a>(path: &Path, options: &'a OpenOptions) -> Result<Head<'a>, OpenError> {
    let Some(raw) = &options.raw else {
        return Err(OpenError::NoLayout { file: path.to_owned() });
    };
    let source = Source::open(path)?;
    let place = Placement {
        origin: Vec3::from(raw.origin).as_dvec3(),
        step: DMat3::from_diagonal(Vec3::from(raw.spacing).as_dvec3()),
        what: "the spacing or origin given for the raw file".to_owned(),
        remedy: "Give finite numbers and a spacing that is not zero",
    };
    let dims = raw.dims.map(u64::from);
    let coding = Coding::plain(raw.scalar, raw.endian);
    let (grid, need) = layout(path, dims, &coding, &place, options)?;
    source.must_hold(need, raw.skip_bytes, false)?;
    let rest = source.len - raw.skip_bytes - need;
    let mut notes = Vec::new();
    if rest > 0 && rest % need != 0 {
        return Err(OpenError::header(
            path,
            format!(
                "{} x {} x {} values of type {} take {need} bytes, but {} follow the {} that are skipped",
                dims[0],
                dims[1],
                dims[2],
                raw.scalar,
                rest + need,
                raw.skip_bytes
            ),
            "Correct the dimensions or the type, or skip the file's header",
        ));
    }
    if rest > 0 {
        notes.push(format!("the file holds {} volumes of this size; the first is read", rest / need + 1));
    }
    Ok(Head { raw, source, grid, coding, notes })
}
