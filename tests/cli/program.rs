//! Running the program in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::Command;

pub struct Run {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

/// Runs the program in `folder`.
pub fn isoforge(folder: &Path, args: &[&str]) -> Run {
    let output = Command::new(env!("CARGO_BIN_EXE_isoforge"))
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    Run { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// Runs it and demands success.
pub fn done(folder: &Path, args: &[&str]) -> Run {
    let run = isoforge(folder, args);
    assert_eq!(run.code, Some(0), "{args:?}: {}", run.err);
    run
}

/// A fresh folder.
pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// What the folder holds.
pub fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("the folder");
    let mut names: Vec<_> =
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The small volume that comes with the tests.
pub fn volume() -> PathBuf {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let name = files(&data).into_iter().find(|n| n.ends_with(".nii.gz")).expect("a volume in tests/data");
    data.join(name)
}

/// Whether GPU runs are left out on the person's word.
pub fn cpu_alone() -> bool {
    std::env::var("ISOFORGE_TESTS").is_ok_and(|v| v == "cpu")
}
