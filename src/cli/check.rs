//! `isoforge check`.

use super::args::CheckArgs;
use super::{Failure, say};
use crate::mesh::read::{ReadError, read};

/// Reads a mesh and tells what it is and where it breaks.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let mesh = read(&args.file).map_err(|error| match error {
        ReadError::UnknownEnding { .. } => Failure::usage(error),
        _ => Failure::run(error),
    })?;
    let report = mesh.check();
    if args.json {
        say(serde_json::to_string(&report).map_err(Failure::run)?);
    } else {
        say(report.to_string().trim_end());
    }
    if args.strict && report.has_defects() { Err(Failure::Negative) } else { Ok(()) }
}
