//! `latchwork alarms …`

use super::instant;
use clap::{Args as ClapArgs, Subcommand, ValueEnum};
use globset::Glob;
use std::path::PathBuf;

/// The commands about alarms.
#[derive(Subcommand, Debug)]
pub(crate) enum AlarmsCommand {
    /// Tell the ISA-18.2 figures of a journal's alarms: rates, floods, chattering, stale, most frequent.
    ///
    /// Each figure stands beside the limit that ISA-18.2 (IEC 62682) and EEMUA 191 recommend. The journal may be a running
    /// plant's. Without --from and --to the report is about all of it.
    Report(Report),
    /// Tell which variable of a plant has which 16-bit code by which rule, which has none, which rule matched nothing.
    Codes(Codes),
}

/// Form of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReportFormat {
    /// For a terminal.
    Table,
    /// For programs.
    Json,
    /// One file with plots, for browsers and paper.
    Html,
}

/// `latchwork alarms report`
#[derive(ClapArgs, Debug)]
pub(crate) struct Report {
    /// The folder that `run --data` was given; a plant may be running with it.
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// Only what happened from this time on: 2026-11-27 (midnight UTC) or 2026-11-27T09:30:00Z.
    #[arg(long, value_name = "TIME", value_parser = instant)]
    pub(crate) from: Option<u64>,
    /// Only what happened before this time.
    #[arg(long, value_name = "TIME", value_parser = instant)]
    pub(crate) to: Option<u64>,
    /// Form of the report.
    #[arg(long, value_enum, default_value = "table")]
    pub(crate) format: ReportFormat,
    /// Write into this file instead of the output; it is on the disk when the program ends.
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Only alarms whose names match; may be repeated.
    #[arg(long, value_name = "GLOB")]
    pub(crate) only: Vec<Glob>,
    /// No alarms whose names match; may be repeated.
    #[arg(long, value_name = "GLOB")]
    pub(crate) exclude: Vec<Glob>,
}

/// Form of the list of codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum CodesFormat {
    /// Variables, those without a code, rules that matched nothing; for a terminal.
    Table,
    /// A row per variable with a code: id, tag name, code, memory type, data type.
    Csv,
    /// The alarms for an HMI.
    Xml,
    /// For programs.
    Json,
}

/// `latchwork alarms codes`
#[derive(ClapArgs, Debug)]
pub(crate) struct Codes {
    /// The plant file.
    #[arg(value_name = "PLANT")]
    pub(crate) plant: PathBuf,
    /// List them as `run --sim` would have them.
    #[arg(long)]
    pub(crate) sim: bool,
    /// Form of the list.
    #[arg(long, value_enum, default_value = "table", conflicts_with = "import")]
    pub(crate) format: CodesFormat,
    /// Write into this file instead of the output; it is on the disk when the program ends.
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Print the rules for the plant file that give each variable of this CSV list its code.
    #[arg(long, value_name = "FILE")]
    pub(crate) import: Option<PathBuf>,
}
