//! Files made for one test.

use std::fs;
use std::io::Write;

use isoforge::components::{Component, Loaded, OpenError, OpenOptions, open};

pub struct Folder(tempfile::TempDir);

/// The radius for files without radii.
pub const RADIUS: f32 = 0.25;

impl Folder {
    pub fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    pub fn open(&self, ending: &str, bytes: impl AsRef<[u8]>) -> Result<Loaded, OpenError> {
        self.open_with(ending, bytes, &OpenOptions { radius: RADIUS, max_bytes: None })
    }

    pub fn open_with(
        &self,
        ending: &str,
        bytes: impl AsRef<[u8]>,
        options: &OpenOptions,
    ) -> Result<Loaded, OpenError> {
        let path = self.0.path().join(format!("x.{ending}"));
        fs::write(&path, bytes).unwrap();
        open(&path, options)
    }

    /// The error without the path.
    pub fn fault(&self, ending: &str, bytes: impl AsRef<[u8]>) -> String {
        without_path(ending, &self.open(ending, bytes).unwrap_err())
    }
}

pub fn without_path(ending: &str, error: &OpenError) -> String {
    let error = error.to_string();
    let place = error.find(&format!("x.{ending}")).expect("the error names the file");
    error[place + 2 + ending.len()..].to_string()
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn blob(x: f32, y: f32, z: f32, radius: f32, weight: f32) -> Component {
    Component { position: [x, y, z], radius, weight }
}
