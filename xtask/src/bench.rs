//! `cargo xtask bench`: the figures of docs/performance.md.

use crate::cargo::{cargo, run};
use crate::guests;
use anyhow::Result;
use clap::Args;

/// Arguments of `cargo xtask bench`.
#[derive(Args, Debug)]
pub(crate) struct Bench {
    /// Only the benches whose names contain this.
    filter: Option<String>,
}

/// Calls of single blocks, then whole scans. Guests first: a bench of yesterday's blocks tells nothing.
pub(crate) fn execute(args: &Bench) -> Result<()> {
    guests::execute(&guests::Guests::default())?;
    for (package, bench) in [("latchwork-block", "call"), ("latchwork-tests-plant", "scan")] {
        let mut command = cargo();
        command.args(["bench", "--package", package, "--bench", bench, "--"]).args(&args.filter);
        run(&mut command)?;
    }
    Ok(())
}
