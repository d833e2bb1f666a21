//! `latchwork fuzz` and `latchwork check-block`

use clap::Args;
use latchwork_schema::parse_size;
use latchwork_testbed::case::keys::{BUDGET, MEMORY};
use latchwork_testbed::fuzz::Kind;
use std::path::PathBuf;

/// `latchwork fuzz`
#[derive(Args, Debug)]
#[command(after_help = "\
Exit codes: 0 nothing found, 1 something found or the component cannot be loaded, 2 the command line is wrong.")]
pub(crate) struct Fuzz {
    /// What is fuzzed.
    #[command(flatten)]
    pub(crate) block: Block,
    /// Time to search [default: 30s, or without an end with --runs].
    #[arg(long = "for", value_name = "TIME", value_parser = super::duration)]
    pub(crate) time: Option<u64>,
    /// Sequences to try; with this, the same seed finds the same.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) runs: Option<u64>,
    /// Where the cases go that show what was found [default: COMPONENT-fuzz-SEED.test.toml].
    #[arg(long, value_name = "FILE.test.toml")]
    pub(crate) out: Option<PathBuf>,
    /// What is meant to be so, as in `--ignore not-restored`; may be given several times.
    #[arg(long, value_name = "KIND", value_parser = kind)]
    pub(crate) ignore: Vec<Kind>,
}

/// `latchwork check-block`
#[derive(Args, Debug)]
#[command(after_help = "\
Exit codes: 0 a plant takes it, if with reservations, 1 it does not, or with --strict has reservations, \
2 the command line is wrong.")]
pub(crate) struct CheckBlock {
    /// What is checked.
    #[command(flatten)]
    pub(crate) block: Block,
    /// Sequences of random inputs to try.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) runs: u64,
    /// Exit code 1 for reservations too: a block that is taken, but whose retained state, refused settings or replay cannot be
    /// trusted.
    #[arg(long)]
    pub(crate) strict: bool,
}

/// A block, its limits, and the form of the output.
#[derive(Args, Debug)]
pub(crate) struct Block {
    /// The component, a .wasm file.
    #[arg(value_name = "COMPONENT")]
    pub(crate) component: PathBuf,
    /// Device class; only where the component exports several.
    #[arg(long, value_name = "CLASS")]
    pub(crate) class: Option<String>,
    /// Seed of the random numbers [default: another each time].
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Longest execution, 1ms to 1m.
    #[arg(long, value_name = "TIME", default_value = "1ms", value_parser = budget)]
    pub(crate) budget: u64,
    /// Most memory, at most 1GiB.
    #[arg(long, value_name = "SIZE", default_value = "4MiB", value_parser = size)]
    pub(crate) memory: u64,
    /// Print as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

fn size(text: &str) -> Result<u64, String> {
    let size = parse_size(text).ok_or("expected a whole number with a unit B, KiB, MiB or GiB, as in 4MiB")?;
    if size <= *MEMORY.end() { Ok(size) } else { Err("expected at most 1GiB, as in a test file".into()) }
}

fn budget(text: &str) -> Result<u64, String> {
    let budget = super::duration(text)?;
    if BUDGET.contains(&budget) { Ok(budget) } else { Err("expected 1ms to 1m, as in a test file".into()) }
}

fn kind(text: &str) -> Result<Kind, String> {
    let known = Kind::ALL.iter().copied();
    let list = || known.clone().map(Kind::name).collect::<Vec<_>>().join(", ");
    known.clone().find(|k| k.name() == text).ok_or_else(|| format!("expected one of {}", list()))
}
