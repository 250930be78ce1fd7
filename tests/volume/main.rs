//! Reading sampled volumes: every format, scalar type and byte order, written here by hand.
#![allow(missing_docs)]

mod damage;
mod nifti;
mod nrrd;
mod raw;
mod real;
mod tiff;

use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{Mat3, Vec3};
use isoforge::volume::{Endian, OpenError, OpenOptions, Opened, Scalar};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

pub const ORDERS: [Endian; 2] = [Endian::Little, Endian::Big];
/// Sizes that differ along every axis, so that a swapped axis shows.
pub const DIMS: [usize; 3] = [5, 4, 3];
pub const POINTS: usize = 60;

/// Values that the type and `f32` both hold exactly, extremes among them.
pub fn values(scalar: Scalar) -> Vec<f64> {
    let (lo, hi): (f64, f64) = match scalar {
        Scalar::U8 => (0.0, 255.0),
        Scalar::I8 => (-128.0, 127.0),
        Scalar::U16 => (0.0, 65535.0),
        Scalar::I16 => (-32768.0, 32767.0),
        Scalar::U32 => (0.0, 4294967040.0),
        Scalar::I32 => (-2147483648.0, 2147483520.0),
        Scalar::F32 | Scalar::F64 => (-1.0e30_f32 as f64, 0.1_f32 as f64),
    };
    let mut values: Vec<f64> = (0..POINTS).map(|i| ((i * 7) % 61) as f64).collect();
    values[1] = lo;
    values[58] = hi;
    if lo < 0.0 {
        values[7] = -3.0;
    }
    values
}

pub fn encode(values: &[f64], scalar: Scalar, endian: Endian) -> Vec<u8> {
    let mut out = Vec::new();
    for &v in values {
        let start = out.len();
        match scalar {
            Scalar::U8 => out.push(v as u8),
            Scalar::I8 => out.extend((v as i8).to_le_bytes()),
            Scalar::U16 => out.extend((v as u16).to_le_bytes()),
            Scalar::I16 => out.extend((v as i16).to_le_bytes()),
            Scalar::U32 => out.extend((v as u32).to_le_bytes()),
            Scalar::I32 => out.extend((v as i32).to_le_bytes()),
            Scalar::F32 => out.extend((v as f32).to_le_bytes()),
            Scalar::F64 => out.extend(v.to_le_bytes()),
        }
        if endian == Endian::Big {
            out[start..].reverse();
        }
    }
    out
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn write(dir: &TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

pub fn open(path: &Path) -> Result<Opened, OpenError> {
    isoforge::volume::open(path, &OpenOptions::default())
}

pub fn open_bytes(name: &str, bytes: &[u8]) -> Result<Opened, OpenError> {
    let dir = TempDir::new().unwrap();
    open(&write(&dir, name, bytes))
}

pub fn open_spaced(name: &str, bytes: &[u8], spacing: [f32; 3]) -> Result<Opened, OpenError> {
    let dir = TempDir::new().unwrap();
    let options = OpenOptions { spacing: Some(spacing), ..OpenOptions::default() };
    isoforge::volume::open(&write(&dir, name, bytes), &options)
}

/// The message of a refusal, checked to name the file and to be one paragraph.
pub fn refusal(name: &str, bytes: &[u8]) -> String {
    let message = open_bytes(name, bytes).map(|o| o.notes).unwrap_err().to_string();
    assert!(message.contains(name), "{message}");
    assert!(!message.contains('\n'), "{message}");
    message
}

#[track_caller]
pub fn assert_values(opened: &Opened, expected: &[f64]) {
    let expected: Vec<f32> = expected.iter().map(|v| *v as f32).collect();
    let values = opened.volume.values();
    assert_eq!(values.to_f32(), expected);
    assert!(values.iter().eq(expected.iter().copied()) && values.len() == expected.len());
    assert_eq!(values.bytes().len(), values.len() * values.scalar().size());
}

/// The type that a file's samples have in memory, if the file does not scale them.
pub fn kept(scalar: Scalar) -> Scalar {
    if scalar.size() < 4 { scalar } else { Scalar::F32 }
}

#[track_caller]
pub fn assert_grid(opened: &Opened, origin: [f32; 3], columns: [[f32; 3]; 3]) {
    let grid = opened.volume.grid();
    let step = Mat3::from_cols(columns[0].into(), columns[1].into(), columns[2].into());
    assert!((grid.origin() - Vec3::from(origin)).abs().max_element() < 1e-4, "{:?}", grid.origin());
    assert!(grid.step().abs_diff_eq(step, 1e-5), "{:?} is not {step:?}", grid.step());
}

pub fn assert_plain_grid(opened: &Opened, origin: [f32; 3], spacing: [f32; 3]) {
    let [x, y, z] = spacing;
    assert_grid(opened, origin, [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
}

#[test]
fn endings_are_told_in_either_case() {
    use isoforge::volume::{ENDINGS, is_volume_ending};
    for ending in ENDINGS {
        assert!(is_volume_ending(Path::new(&format!("dir.x/brain{}", ending.to_uppercase()))));
    }
    for other in ["a.obj", "a.gz", "nii", "a.nii.zip", "", "a.nii/b"] {
        assert!(!is_volume_ending(Path::new(other)), "{other}");
    }
    let message = open(Path::new("a.vti")).unwrap_err().to_string();
    assert!(message.contains("a.vti") && message.contains(".nhdr"), "{message}");
}

#[test]
fn missing_files_and_directories_are_named() {
    let dir = TempDir::new().unwrap();
    let message = open(&dir.path().join("no.nii")).unwrap_err().to_string();
    assert!(message.contains("no.nii") && message.contains("cannot be read"), "{message}");
    let folder = dir.path().join("folder.tif");
    std::fs::create_dir(&folder).unwrap();
    assert!(matches!(open(&folder), Err(OpenError::NotAFile { .. })));
    for ending in isoforge::volume::ENDINGS {
        assert!(open(&write(&dir, &format!("empty{ending}"), b"")).is_err());
    }
}

#[test]
fn scalars_and_byte_orders_have_names() {
    for scalar in Scalar::ALL {
        assert_eq!(scalar.to_string().parse(), Ok(scalar));
        assert_eq!(encode(&[0.0], scalar, Endian::Little).len(), scalar.size());
    }
    assert_eq!("Float32".parse(), Ok(Scalar::F32));
    assert!("i64".parse::<Scalar>().unwrap_err().to_string().contains("i64"));
    assert_eq!("BE".parse(), Ok(Endian::Big));
    assert_eq!(Endian::Little.to_string().parse(), Ok(Endian::Little));
    assert!("middle".parse::<Endian>().is_err());
}
