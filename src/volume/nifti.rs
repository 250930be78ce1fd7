//! NIfTI-1 in one file (`.nii`, `.nii.gz`).

use super::decode::{Coding, Endian, Scalar, fill, read_values};
use super::error::OpenError;
use super::planes::{Located, Starts, no_planes};
use super::source::{Placement, Source, finish, layout, reserve, skip};
use super::{OpenOptions, Opened, opened};
use crate::grid::Grid;
use glam::{DMat3, DVec3};
use nifti::NiftiHeader;
use std::io::BufRead;
use std::path::Path;

/// Bytes of a NIfTI-1 header.
const HEADER: usize = 348;

/// A header, and the stream behind it.
struct Head {
    stream: Box<dyn BufRead>,
    gzip: bool,
    /// Bytes of the file.
    len: u64,
    dims: [u64; 3],
    frames: u64,
    grid: Grid,
    coding: Coding,
    /// First byte of the values.
    offset: u64,
    notes: Vec<String>,
}

pub(super) fn read(path: &Path, options: &OpenOptions) -> Result<Opened, OpenError> {
    let Head { mut stream, gzip, len, dims, frames, grid, coding, offset, mut notes } = head(path, options)?;
    skip(path, &mut stream, offset - HEADER as u64, "extensions before the values")?;
    let reserve = reserve(len, gzip, coding.scalar.size());
    let (values, loss) = read_values(path, &mut stream, dims, &coding, reserve)?;
    loss.notes(&coding, &mut notes);
    if frames > 1 {
        notes.push(first_frame(frames));
    } else {
        finish(path, &mut stream, &mut notes)?;
    }
    opened(path, grid, values, notes)
}

/// Where the values lie.
pub(super) fn locate(path: &Path, options: &OpenOptions) -> Result<Located, OpenError> {
    let Head { gzip, frames, grid, coding, offset, mut notes, .. } = head(path, options)?;
    if gzip {
        return Err(no_planes(path, "compressed"));
    }
    if frames > 1 {
        notes.push(first_frame(frames));
    }
    Ok(Located { path: path.to_owned(), grid, coding, starts: Starts::Together(offset), notes })
}

fn first_frame(frames: u64) -> String {
    format!("{frames} frames in the file; frame 0 is read")
}

fn head(path: &Path, options: &OpenOptions) -> Result<Head, OpenError> {
    let source = Source::open(path)?;
    let gzip = source.gzip;
    // The sizes that bound what the data may be, before the file becomes a stream.
    let most = source.holds(0, gzip);
    let len = source.len;
    let mut stream = source.into_stream(gzip);

    let mut bytes = [0; HEADER];
    let got = fill(&mut stream, &mut bytes).map_err(|e| OpenError::reading(path, e))?;
    let mut notes = Vec::new();
    let (header, endian) = parse(path, &bytes[..got])?;
    let (dims, frames) = dims(path, &header)?;
    let scalar = scalar(path, &header)?;
    if i32::from(header.bitpix) != scalar.size() as i32 * 8 {
        notes.push(format!(
            "bitpix is {}, which does not fit datatype {scalar}; it is ignored",
            header.bitpix
        ));
    }
    let place = placement(&header, &mut notes);
    let offset = offset(path, &header, &mut notes)?;
    let coding = coding(&header, scalar, endian, &mut notes);
    let (grid, need) = layout(path, dims, &coding, &place, options)?;

    if most.saturating_sub(offset) < need {
        let have = match gzip {
            true => format!("the {len} bytes of compressed file unpack to at most {most}"),
            false => format!("there are only {}", most.saturating_sub(offset)),
        };
        return Err(OpenError::Truncated { file: path.to_owned(), need, have });
    }
    Ok(Head { stream, gzip, len, dims, frames, grid, coding, offset, notes })
}

/// Checks everything that tells a NIfTI-1 file and its byte order, then lets the crate parse.
fn parse(path: &Path, bytes: &[u8]) -> Result<(NiftiHeader, Endian), OpenError> {
    let no_nifti = |problem: String| {
        OpenError::header(path, problem, "Check that the file is NIfTI and was copied completely")
    };
    let Some(first) = bytes.first_chunk::<4>() else {
        return Err(no_nifti(format!("it has only {} bytes and a NIfTI header has {HEADER}", bytes.len())));
    };
    let (little, big) = (i32::from_le_bytes(*first), i32::from_be_bytes(*first));
    let endian = match (little, big) {
        (348, _) => Endian::Little,
        (_, 348) => Endian::Big,
        (540, _) | (_, 540) => {
            return Err(OpenError::unsupported(path, "NIfTI-2", "Save the volume as NIfTI-1"));
        }
        _ => {
            return Err(no_nifti(format!("sizeof_hdr is {little}, not 348: this is no NIfTI-1 header")));
        }
    };
    if bytes.len() < HEADER {
        return Err(no_nifti(format!("it ends inside the header, after {} of {HEADER} bytes", bytes.len())));
    }
    match &bytes[344..348] {
        b"n+1\0" => {}
        b"ni1\0" => {
            return Err(OpenError::unsupported(
                path,
                "NIfTI as a pair of .hdr and .img files",
                "Save the volume as one .nii file",
            ));
        }
        other => {
            let magic = other.escape_ascii();
            return Err(no_nifti(format!("the magic is \"{magic}\" where NIfTI-1 has \"n+1\"")));
        }
    }
    // The crate tells the byte order by dim[0] alone: make sure that it comes to the same.
    let order = [bytes[40], bytes[41]];
    let n = if endian == Endian::Little { u16::from_le_bytes(order) } else { u16::from_be_bytes(order) };
    if !(1..=7).contains(&n) {
        return Err(no_nifti(format!("dim[0], the number of dimensions, is {n}; it must be 1 to 7")));
    }
    let header =
        NiftiHeader::from_reader(bytes).map_err(|e| no_nifti(format!("the header does not parse ({e})")))?;
    Ok((header, endian))
}

/// Samples along x, y, z, and how many such volumes there are.
fn dims(path: &Path, header: &NiftiHeader) -> Result<([u64; 3], u64), OpenError> {
    let n = usize::from(header.dim[0]);
    let mut dims = [1; 3];
    let mut frames = 1_u64;
    for (i, &size) in header.dim[1..=n].iter().enumerate() {
        // The format's field is signed; the crate's is not.
        if size > i16::MAX as u16 || (size == 0 && i < 3) {
            return Err(OpenError::header(
                path,
                format!("dim[{}] is {}; a size must be 1 to 32767", i + 1, size as i16),
                "Correct the header or export the volume again",
            ));
        }
        if i < 3 {
            dims[i] = u64::from(size);
        } else {
            // At most 32767^4.
            frames *= u64::from(size.max(1));
        }
    }
    Ok((dims, frames))
}

fn scalar(path: &Path, header: &NiftiHeader) -> Result<Scalar, OpenError> {
    let name = match header.datatype {
        2 => return Ok(Scalar::U8),
        4 => return Ok(Scalar::I16),
        8 => return Ok(Scalar::I32),
        16 => return Ok(Scalar::F32),
        64 => return Ok(Scalar::F64),
        256 => return Ok(Scalar::I8),
        512 => return Ok(Scalar::U16),
        768 => return Ok(Scalar::U32),
        1 => "1-bit values",
        32 => "complex64 values",
        128 => "RGB colours",
        1024 => "int64 values",
        1280 => "uint64 values",
        1536 => "float128 values",
        1792 => "complex128 values",
        2048 => "complex256 values",
        2304 => "RGBA colours",
        _ => "an unknown type",
    };
    Err(OpenError::unsupported(
        path,
        format!("datatype {} ({name})", header.datatype),
        "Save the volume as one of u8, i8, u16, i16, u32, i32, f32 or f64",
    ))
}

/// First byte of the values.
fn offset(path: &Path, header: &NiftiHeader, notes: &mut Vec<String>) -> Result<u64, OpenError> {
    let at = header.vox_offset;
    if !at.is_finite() || at < 0.0 || at.fract() != 0.0 || at > 1e15 {
        return Err(OpenError::header(
            path,
            format!("vox_offset, the place of the first value, is {at}"),
            "Correct the header: without extensions it is 352",
        ));
    }
    if at >= HEADER as f32 {
        return Ok(at as u64);
    }
    if at != 0.0 {
        notes.push(format!("vox_offset is {at}, inside the header; 352 is used"));
    }
    Ok(352)
}

fn coding(header: &NiftiHeader, scalar: Scalar, endian: Endian, notes: &mut Vec<String>) -> Coding {
    let (slope, mut intercept) = (f64::from(header.scl_slope), f64::from(header.scl_inter));
    // The standard: a slope of 0 means no scaling at all. Writers also leave NaN there.
    if slope == 0.0 || !slope.is_finite() {
        return Coding::plain(scalar, endian);
    }
    if !intercept.is_finite() {
        notes.push(format!("scl_inter is {intercept}; 0 is used"));
        intercept = 0.0;
    }
    Coding::scaled(scalar, endian, slope, intercept)
}

/// The affine: sform, else qform, else the voxel sizes alone.
fn placement(header: &NiftiHeader, notes: &mut Vec<String>) -> Placement {
    let rows = [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from));
    if header.sform_code > 0 {
        let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
        return Placement {
            origin: column(3),
            step: DMat3::from_cols(column(0), column(1), column(2)),
            what: "the affine of the sform (srow_x, srow_y, srow_z)".to_owned(),
            remedy: "Correct the three rows, or set sform_code to 0 to use the qform or the voxel sizes",
        };
    }
    let mut size = [1.0; 3];
    for (axis, size) in size.iter_mut().enumerate() {
        let given = f64::from(header.pixdim[axis + 1]);
        *size = if given.is_finite() && given != 0.0 { given.abs() } else { 1.0 };
        if *size != given {
            notes.push(format!("pixdim[{}], a voxel size, is {given}; {size} is used", axis + 1));
        }
    }
    let size = DVec3::from(size);
    if header.qform_code > 0 {
        let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
        let offset = [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from);
        let mirror = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        return Placement {
            origin: DVec3::from(offset),
            step: rotation(b, c, d) * DMat3::from_diagonal(size * DVec3::new(1.0, 1.0, mirror)),
            what: "the affine of the qform (quatern_*, qoffset_*, pixdim)".to_owned(),
            remedy: "Correct the quaternion, or set qform_code to 0 to use the voxel sizes alone",
        };
    }
    Placement {
        origin: DVec3::ZERO,
        step: DMat3::from_diagonal(size),
        what: "the voxel sizes (pixdim)".to_owned(),
        remedy: "Correct pixdim[1] to pixdim[3]",
    }
}

/// The rotation of the unit quaternion (a, b, c, d) with a worked out as the NIfTI-1 standard does.
fn rotation(b: f64, c: f64, d: f64) -> DMat3 {
    let (mut b, mut c, mut d) = (b, c, d);
    let square = b * b + c * c + d * d;
    let mut a = 1.0 - square;
    if a < 1e-7 {
        // A half turn: stored in f32, its length is 1 only roughly.
        let scale = square.sqrt().recip();
        (a, b, c, d) = (0.0, b * scale, c * scale, d * scale);
    } else {
        a = a.sqrt();
    }
    DMat3::from_cols(
        DVec3::new(a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)),
        DVec3::new(2.0 * (b * c - a * d), a * a + c * c - b * b - d * d, 2.0 * (c * d + a * b)),
        DVec3::new(2.0 * (b * d + a * c), 2.0 * (c * d - a * b), a * a + d * d - b * b - c * c),
    )
}
