//! `latchwork replay` and `latchwork record`

use super::operate::Reach;
use clap::Args as ClapArgs;
use std::path::PathBuf;

/// `latchwork replay`
///
/// A recording is what `[recorder]` of a plant file asks for: the folder `recorder` in that of `run --data`, or a file.
/// Each block is given again what it got then, at full speed. With the component that was recorded the outputs must be equal
/// bit for bit; with another one the differences are listed, as the shadow of a swap lists them.
#[derive(ClapArgs, Debug)]
pub(crate) struct Replay {
    /// File or folder of a recording.
    #[arg(value_name = "RECORDING")]
    pub(crate) recording: PathBuf,
    /// Only this block.
    #[arg(long, value_name = "BLOCK")]
    pub(crate) block: Option<String>,
    /// Another component in the place of the recorded one.
    #[arg(long, value_name = "NEW.wasm", requires = "block")]
    pub(crate) with: Option<PathBuf>,
    /// Run of the plant [default: the last one in the recording].
    #[arg(long, value_name = "N")]
    pub(crate) run: Option<u64>,
    /// Only from this time on: plant time (1m 30s) or a date and time (2026-11-27T09:30:00Z).
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub(crate) from: Option<Time>,
    /// Only up to this time.
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub(crate) to: Option<Time>,
    /// Deviation of a real output that does not count, with another component; globs are allowed, and it may be repeated.
    #[arg(long, value_name = "TAG=X", value_parser = tolerance, requires = "with")]
    pub(crate) tolerance: Vec<(String, f64)>,
    /// Retained values and settings that do not fit the other component are clamped.
    #[arg(long, requires = "with")]
    pub(crate) allow_lossy: bool,
    /// Write the recorded time as a component test, and the component beside it; nothing is compared.
    #[arg(long, value_name = "FILE.test.toml", requires = "block", conflicts_with = "with")]
    pub(crate) export: Option<PathBuf>,
    /// Print as JSON: a list of reports.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `latchwork record`
#[derive(ClapArgs, Debug)]
pub(crate) struct Record {
    /// File to write; `latchwork replay` reads it.
    #[arg(long, value_name = "FILE")]
    pub(crate) save: PathBuf,
    #[command(flatten)]
    pub(crate) reach: Reach,
}

/// A time of the plant or of the world, ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Time {
    /// Since the start of the run.
    Plant(u64),
    /// Since 1970.
    World(u64),
}

fn time(text: &str) -> Result<Time, String> {
    match latchwork_image::parse_duration(text) {
        Ok(ns) => Ok(Time::Plant(ns)),
        Err(_) => super::instant(text).map(Time::World).map_err(|_| {
            "expected plant time, as in 1m 30s, or a date and time, as in 2026-11-27T09:30:00Z".to_string()
        }),
    }
}

fn tolerance(text: &str) -> Result<(String, f64), String> {
    let parsed = text.rsplit_once('=').and_then(|(tag, x)| Some((tag.trim().to_string(), x.trim().parse().ok()?)));
    parsed.ok_or_else(|| "expected TAG=NUMBER, as in unit.outputs.level=1e-6".into())
}
