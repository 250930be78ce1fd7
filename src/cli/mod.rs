//! The command line: arguments, and what each command does with the library.
//!
//! The exit codes are told by `isoforge --help`.

mod accuracy;
mod args;
mod backend;
mod bench;
mod blobs;
mod check;
mod colour;
mod compare;
mod extract;
mod gallery;
mod lists;
mod mesh_tools;
mod method;
mod picture;
mod planes;
mod progress;
mod source;
mod stats;
mod values;
mod watchdog;

use crate::extract::ExtractError;
use crate::field::NoForm;
use args::{Cli, Command};
use clap::Parser;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Why a command ended without doing its work.
#[derive(Debug)]
enum Failure {
    /// The command line is wrong.
    Usage(String),
    /// The run failed.
    Run(String),
    /// The run needs more than the memory budget.
    Budget(OverBudget),
    /// The run did its work, and what it found is the answer 1: a defect, a disagreement.
    Negative,
}

impl Failure {
    fn usage(message: impl ToString) -> Self {
        Self::Usage(message.to_string())
    }

    fn run(message: impl ToString) -> Self {
        Self::Run(message.to_string())
    }

    /// The same with its message changed.
    fn map(self, change: impl Fn(String) -> String) -> Self {
        match self {
            Self::Usage(message) => Self::Usage(change(message)),
            Self::Run(message) => Self::Run(change(message)),
            Self::Budget(_) | Self::Negative => self,
        }
    }

    /// Of an extraction: what helps against a budget that is too small depends on its source.
    fn extract(error: ExtractError) -> Self {
        match error {
            ExtractError::Budget { what, needed, budget } => {
                Self::Budget(OverBudget { what, needed, budget })
            }
            ExtractError::NoForm(NoForm::Cpu) => Self::run(format!("{error} (--backend gpu)")),
            ExtractError::NoForm(NoForm::Gpu) | ExtractError::FieldData { .. } => {
                Self::run(format!("{error} (--backend cpu)"))
            }
            error => Self::run(error),
        }
    }
}

/// More bytes than the memory budget.
#[derive(Debug, thiserror::Error)]
#[error("{what} needs {needed} bytes, over the memory budget of {budget} bytes")]
struct OverBudget {
    what: &'static str,
    needed: u64,
    budget: u64,
}

/// Runs the program with the process's arguments; returns its exit code.
pub fn run() -> i32 {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come this way too, with code 0.
            return match error.print() {
                Err(unprinted) if !error.use_stderr() && unprinted.kind() != ErrorKind::BrokenPipe => {
                    end(Err(unsaid(&unprinted)))
                }
                _ => error.exit_code(),
            };
        }
    };
    let result = match &cli.command {
        Command::Extract(args) => extract::run(args),
        Command::Check(args) => check::run(args),
        Command::MeshTools(args) => mesh_tools::run(args),
        Command::Info => lists::info(),
        Command::Fields => lists::fields(),
        Command::Nodes => lists::nodes(),
        Command::Gallery(args) => gallery::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Accuracy(args) => accuracy::run(args),
        Command::Bench(args) => bench::run(args),
    };
    end(result)
}

/// Says why a command failed, if it did; returns the exit code.
fn end(result: Result<(), Failure>) -> i32 {
    match result {
        Ok(()) => 0,
        Err(Failure::Negative) => 1,
        Err(Failure::Run(message)) => complain(&message, 1),
        Err(Failure::Budget(over)) => {
            complain(&format!("{over}: raise the budget (--memory-budget) or coarsen the grid"), 1)
        }
        Err(Failure::Usage(message)) => complain(&message, 2),
    }
}

fn complain(message: &str, code: i32) -> i32 {
    tell(message);
    code
}

/// Prints a line of ours to standard error; a reader that has gone away is not an error there either.
fn tell(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "isoforge: {text}");
}

/// Prints to standard output; a reader that has gone away (`| head`) is not an error.
fn say(text: impl std::fmt::Display) -> Result<(), Failure> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(unsaid(&error)),
        _ => Ok(()),
    }
}

/// Why standard output was not written.
fn unsaid(error: &std::io::Error) -> Failure {
    Failure::run(format!("standard output cannot be written: {error}; make room, or send it elsewhere"))
}

/// Writes a line to `path`, whole or not at all, or to standard output for `-`.
fn write_text(text: &str, path: &Path) -> Result<(), Failure> {
    if path == Path::new("-") {
        return say(text);
    }
    crate::atomic::write(path, |file| writeln!(file, "{text}")).map_err(Failure::run)
}

/// Refuses a path that [`write_text`] could not write to, before long work.
fn check_text_target(path: &Path) -> Result<(), Failure> {
    if path == Path::new("-") { Ok(()) } else { crate::atomic::check(path).map_err(Failure::run) }
}

/// Refuses one name for two outputs, and outputs that would replace what is read; - is none.
fn check_distinct(inputs: &[&Path], outputs: &[(&str, &Option<PathBuf>)]) -> Result<(), Failure> {
    let named = outputs.iter().filter_map(|(flag, path)| Some((*flag, path.as_deref()?)));
    let named: Vec<(&str, &Path)> = named.filter(|(_, path)| *path != Path::new("-")).collect();
    let place = |path: &Path| path.canonicalize().ok();
    for (i, (flag, path)) in named.iter().enumerate() {
        if let Some((other, _)) = named[..i].iter().find(|(_, before)| before == path) {
            return Err(Failure::usage(format!(
                "{other} and {flag} name the same file, {}: name another for one of them",
                path.display()
            )));
        }
        if inputs.iter().any(|input| place(input).is_some_and(|input| place(path) == Some(input))) {
            return Err(Failure::usage(format!(
                "{flag} {}: this is the file that is read: name another",
                path.display()
            )));
        }
    }
    Ok(())
}
