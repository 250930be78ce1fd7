//! `isoforge check`.

use super::args::CheckArgs;
use super::{Failure, say, tell};
use crate::mesh::Mesh;
use crate::mesh::read::{ReadError, read};
use std::path::Path;

/// Reads a mesh and tells what it is and where it breaks.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let report = read_mesh(&args.file, &|text| tell(text))?.check();
    if args.json {
        say(serde_json::to_string(&report).map_err(Failure::run)?)?;
    } else {
        say(report.to_string().trim_end())?;
    }
    match args.strict {
        true if report.triangles == 0 => Err(Failure::run(format!(
            "{}: there is no triangle, and --strict wants a surface",
            args.file.display()
        ))),
        true if report.has_defects() => Err(Failure::Negative),
        _ => Ok(()),
    }
}

/// Reads a mesh for any command, and remarks on what of the file it is without.
pub fn read_mesh(file: &Path, remark: &dyn Fn(&str)) -> Result<Mesh, Failure> {
    let contents = read(file).map_err(|error| match error {
        ReadError::UnknownEnding { .. } => Failure::usage(error),
        _ => Failure::run(error),
    })?;
    if contents.left_out > 0 {
        let faces = if contents.left_out == 1 { "face" } else { "faces" };
        let count = contents.left_out;
        remark(&format!("{}: {count} {faces} of fewer than three corners left out", file.display()));
    }
    Ok(contents.mesh)
}
