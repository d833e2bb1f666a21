//! `cargo xtask guests`: every function block of the project as a component.

use anyhow::Result;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `cargo xtask guests`.
#[derive(Args, Debug, Default)]
pub(crate) struct Guests {
    /// Where the components go, instead of `components` in cargo's target folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Only these, by name (`ton`) or crate name (`latchwork-ton`)
    pub(crate) names: Vec<String>,
}

/// Builds the components that `args` name.
pub(crate) fn execute(_args: &Guests) -> Result<()> {
    anyhow::bail!("not built yet")
}
