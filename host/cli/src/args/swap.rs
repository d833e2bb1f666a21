//! Arguments of the commands that change the components of a running plant.

use super::operate::{Change, Reach};
use clap::Args as ClapArgs;

/// `latchwork swap`
#[derive(ClapArgs, Debug)]
#[command(after_help = "\
Examples:
  latchwork swap tank target/tank-2.wasm --dry-run                what would change?
  latchwork swap tank target/tank-2.wasm --shadow 1000            compare 1000 executions, then exchange
  latchwork swap a new-a.wasm b new-b.wasm --yes                  both in one scan, or none
  latchwork swap sink.day csv-2.wasm --yes                        a logger, between two batches")]
pub(crate) struct Swap {
    /// Each block with the file of its new component; several are exchanged in one scan, all or none. `sink.NAME` for a
    /// sink of kind `component`.
    #[arg(value_names = ["BLOCK", "NEW.wasm"], required = true, num_args = 2..)]
    pub(crate) parts: Vec<String>,
    /// Run the new version in the shadow of the running one for so many executions first; a difference ends the swap.
    #[arg(long, value_name = "N", default_value = "0")]
    pub(crate) shadow: u64,
    /// How far an output may be off in the shadow, in its own unit; a tag or a glob in quotes; may be repeated.
    #[arg(long, value_name = "TAG=NUMBER", value_parser = tolerance)]
    pub(crate) tolerance: Vec<(String, f64)>,
    /// Executions after the exchange within which a fault puts the old version back, 1000 if nothing is said; of a sink,
    /// batches of records, 3 if nothing is said.
    #[arg(long, value_name = "N")]
    pub(crate) probation: Option<u64>,
    /// A setting of the new version that is to be another than now, as in tank.settings.gain=1.5; may be repeated.
    #[arg(long = "set", value_name = "BLOCK.settings.NAME=VALUE", value_parser = setting)]
    pub(crate) settings: Vec<Setting>,
    /// Clamp retained values that do not fit the new type, instead of refusing the swap.
    #[arg(long)]
    pub(crate) allow_lossy: bool,
    /// Do not ask; needed where nobody can be asked.
    #[arg(long, short)]
    pub(crate) yes: bool,
    /// Only show what would change; with --save also whether it could be saved.
    #[arg(long, conflicts_with_all = ["yes", "shadow", "tolerance"])]
    pub(crate) dry_run: bool,
    /// When the probation is over, copy the component into the plant's first component folder and name it in the plant file.
    #[arg(long)]
    pub(crate) save: bool,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `BLOCK.settings.NAME=VALUE`
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Setting {
    pub(crate) block: String,
    pub(crate) name: String,
    pub(crate) value: String,
}

fn setting(text: &str) -> Result<Setting, String> {
    let parts = text.split_once('=').and_then(|(tag, value)| Some((tag.split_once(".settings.")?, value)));
    match parts {
        Some(((block, name), value)) if !block.is_empty() && !name.is_empty() => {
            Ok(Setting { block: block.into(), name: name.into(), value: value.into() })
        }
        _ => Err("expected BLOCK.settings.NAME=VALUE, as in tank.settings.gain=1.5".into()),
    }
}

fn tolerance(text: &str) -> Result<(String, f64), String> {
    let parts = text.rsplit_once('=').and_then(|(tag, within)| Some((tag, within.parse::<f64>().ok()?)));
    match parts {
        Some((tag, within)) if !tag.is_empty() && within.is_finite() && within >= 0.0 => Ok((tag.into(), within)),
        _ => Err("expected TAG=NUMBER with a number that is not negative, as in tank.outputs.level=1e-6".into()),
    }
}

/// `latchwork rollback`
#[derive(ClapArgs, Debug)]
pub(crate) struct Rollback {
    /// The block, or `sink.NAME`.
    #[arg(value_name = "BLOCK")]
    pub(crate) block: String,
    /// How many versions back.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) steps: u64,
    /// The version with this hash, or its first digits, instead; `latchwork status --json` lists them.
    #[arg(long, value_name = "HASH", conflicts_with = "steps")]
    pub(crate) to: Option<String>,
    /// Do not ask; needed where nobody can be asked.
    #[arg(long, short)]
    pub(crate) yes: bool,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork swaps`
#[derive(ClapArgs, Debug)]
pub(crate) struct Swaps {
    /// Number of a swap: follow it to its end.
    #[arg(value_name = "NUMBER")]
    pub(crate) number: Option<u64>,
    /// Call it off; only before the exchange.
    #[arg(long, requires = "number")]
    pub(crate) cancel: bool,
    #[command(flatten)]
    pub(crate) reach: Reach,
}
