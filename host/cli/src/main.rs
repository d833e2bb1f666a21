//! `latchwork` — the command line.
//!
//! Owns arguments, files, terminals and exit codes, and reads the machine's clock for everything below it. It must hold no
//! control logic: what it can do, a program using the crates below can do too.

mod args;
mod commands;
mod doctor;
mod report;
mod run;

use clap::Parser;
use std::process::ExitCode;

/// Exit codes, for scripts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// All is well.
    Fine = 0,
    /// Something was found wanting: errors in a plant file, a component that does not fit.
    Wanting = 1,
    /// The command itself was wrong.
    Usage = 2,
    /// A lane of the plant was stopped by a fault.
    Faulted = 3,
}

fn main() -> ExitCode {
    let args = args::Args::parse();
    let exit = match commands::execute(args) {
        Ok(exit) => exit,
        Err(error) => {
            report::error(&error);
            Exit::Wanting
        }
    };
    ExitCode::from(exit as u8)
}
