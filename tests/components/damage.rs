//! Endings, files that are none, damage: an error that says what, but never a panic.

use std::path::Path;

use isoforge::components::{ENDINGS, OpenError, OpenOptions, is_component_ending, open};
use proptest::prelude::*;

use crate::folder::{Folder, gzip};

#[test]
fn endings() {
    for ending in ENDINGS {
        assert!(is_component_ending(Path::new(&format!("a/b{ending}"))), "{ending}");
        assert!(is_component_ending(Path::new(&format!("B{}", ending.to_uppercase()))), "{ending}");
    }
    for name in ["a.ply.gz", "a.gz", "csv", "a.off", "", "..", "a.csv.bz2"] {
        assert!(!is_component_ending(Path::new(name)), "{name}");
        assert!(
            matches!(open(Path::new(name), &OpenOptions::default()), Err(OpenError::Ending { .. })),
            "{name}"
        );
    }
}

#[test]
fn no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let error = open(&path, &OpenOptions::default()).unwrap_err();
    assert!(matches!(error, OpenError::Read { .. }), "{error}");
    std::fs::create_dir(&path).unwrap();
    let error = open(&path, &OpenOptions::default()).unwrap_err();
    assert!(matches!(error, OpenError::NotAFile { .. }), "{error}");
}

#[test]
fn damaged_gzip() {
    let folder = Folder::new();
    let whole = gzip("1,2,3,4\n5,6,7,8\n".repeat(99).as_bytes());
    for bytes in [&whole[..whole.len() - 3], &whole[..20], b"1,2,3\n", b"\x1f\x8b"] {
        let error = folder.open("csv.gz", bytes).unwrap_err();
        assert!(matches!(error, OpenError::Corrupt { .. }), "{error}");
    }
    let mut bent = whole.clone();
    let checksum = bent.len() - 8;
    bent[checksum] ^= 1;
    let error = folder.open("csv.gz", &bent).unwrap_err();
    assert!(matches!(error, OpenError::Corrupt { .. }), "{error}");
}

/// A file that compresses a thousandfold is stopped by the limit, or by the longest line.
#[test]
fn bombs() {
    let folder = Folder::new();
    let options = OpenOptions { max_bytes: Some(1 << 20), ..OpenOptions::default() };
    let rows = gzip("1,2,3,4\n".repeat(1 << 20).as_bytes());
    assert!(matches!(folder.open_with("csv.gz", rows, &options), Err(OpenError::TooMany { .. })));
    let zeros = gzip(&vec![0; 1 << 24]);
    for ending in ["csv.gz", "xyz.gz", "pdb.gz"] {
        let error = folder.open_with(ending, &zeros, &options).unwrap_err().to_string();
        assert!(error.contains("row 1: the line is longer than 65536 bytes"), "{error}");
    }
}

const STARTS: &[&str] = &[
    "",
    "x,y,z,r,w\n",
    "\"x\";y;z\n",
    "1,2,3\n",
    "2\n\nH 0 0 0\n",
    "1 2 3\n",
    "ATOM      1  CA  GLY A   1       1.000   2.000   3.000  1.00  0.00           C\nATOM  ",
    "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
    "ply\nformat binary_big_endian 1.0\nelement a 3\nproperty short b\nelement vertex 2\nproperty float x\n\
     property double y\nproperty uchar z\nend_header\n",
    "ply\nformat binary_little_endian 1.0\nelement vertex 2\n",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn arbitrary_bytes_never_panic(
        start in prop::sample::select(STARTS),
        rest in prop_oneof![
            prop::collection::vec(any::<u8>(), 0..300),
            "[-+0-9eEinfa.,;\t\" #\r\nxyzrwHCO]{0,300}".prop_map(String::into_bytes),
        ],
        cut in 0.0..1.0_f64,
        zip in any::<bool>(),
    ) {
        let folder = Folder::new();
        let mut bytes = [start.as_bytes(), &rest].concat();
        if zip {
            bytes = gzip(&bytes);
        }
        for bytes in [&bytes[..], &bytes[..(cut * bytes.len() as f64) as usize]] {
            for ending in ENDINGS {
                let options = OpenOptions { max_bytes: Some(100), ..OpenOptions::default() };
                if let Ok(loaded) = folder.open_with(&ending[1..], bytes, &options) {
                    prop_assert!((1..=5).contains(&loaded.components.len()));
                    prop_assert!(loaded.components.iter().all(|component| component.radius > 0.0
                        && component.radius.is_finite()
                        && component.weight.is_finite()
                        && component.position.iter().all(|coordinate| coordinate.is_finite())));
                }
            }
        }
    }
}
