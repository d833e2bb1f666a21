//! Arguments and their help.

mod alarms;
pub(crate) mod author;
pub(crate) mod fuzz;
pub(crate) mod operate;
pub(crate) mod replay;
pub(crate) mod swap;
pub(crate) mod test;

pub(crate) use alarms::{AlarmsCommand, Codes, CodesFormat, Report, ReportFormat};
use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

const AFTER: &str = "\
Exit codes:
  0  fine
  1  found wanting: errors in the plant file, a component that does not fit, a machine not ready
  2  the command line is wrong
  3  a lane of the plant was stopped by a fault

Start here:
  latchwork check examples/alarm-unit/plant.toml        is the plant file right?
  latchwork run examples/alarm-unit/plant.toml --sim    run it without its hardware
  latchwork inspect target/components/ton.wasm          what ports does a block have?";

/// A soft-PLC whose function blocks are WebAssembly components.
///
/// A plant file (TOML) names the blocks, the wires between them, the lanes that scan them and the drivers that connect
/// them to the field. `run` runs it, in real time or as fast as the machine goes at virtual time.
#[derive(Parser, Debug)]
#[command(name = "latchwork", version, after_help = AFTER, max_term_width = 110)]
pub(crate) struct Args {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Folder for compiled components [default: latchwork in the user's cache folder].
    #[arg(
        long,
        global = true,
        value_name = "DIR",
        env = "LATCHWORK_CACHE",
        hide_env_values = true,
        help_heading = "For all commands"
    )]
    pub(crate) cache: Option<PathBuf>,
    /// Compile every component anew and keep nothing.
    #[arg(long, global = true, conflicts_with = "cache", help_heading = "For all commands")]
    pub(crate) no_cache: bool,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub(crate) enum Command {
    /// Run a plant until Ctrl-C, SIGTERM or the end of its time.
    Run(Run),
    /// Check a plant file and its components; every error at once.
    Check(Check),
    /// Show what a component is: classes, ports, imports, size, hash.
    Inspect(Inspect),
    /// List every tag of a plant with its type and its writer.
    Tags(Tags),
    /// Tell how ready this machine is for real-time control, and what mends each shortcoming.
    Doctor(Doctor),
    /// List the GPIO chips of this machine, their lines, and who holds them.
    ///
    /// A plant file's `gpio` driver names a chip by path, name or label, and its lines by number or name: here they are.
    /// Nothing is taken or changed, so this may be used while a plant runs. Where the user may not open a chip, it says
    /// which group or udev rule helps.
    Gpio(Gpio),
    /// Verify or export the journal that `run --data` keeps.
    Journal(Journal),
    /// Run again what the flight recorder has recorded: the same outputs, bit for bit, or what is different.
    Replay(replay::Replay),
    /// Save what the flight recorder of a running plant has in memory.
    Record(replay::Record),
    /// Tell how a running plant is: lanes, blocks, alarms, forces.
    Status(operate::Status),
    /// Show values of a running plant as they change.
    Watch(operate::Watch),
    /// Change settings of blocks; the block's own check takes or refuses them.
    Set(operate::Set),
    /// Hold tags at values, or list what is held.
    Force(operate::Force),
    /// Take forces away.
    Unforce(operate::Unforce),
    /// Give a command to a block.
    #[command(name = "command")]
    Give(operate::Give),
    /// List the alarms of a running plant; report on those of a journal; list the codes of a plant's alarms.
    Alarms(operate::Alarms),
    /// Acknowledge alarms.
    Ack(operate::Acknowledge),
    /// Reset alarms whose condition is gone.
    Reset(operate::Which),
    /// Hide alarms for a time.
    Shelve(operate::Shelve),
    /// Show shelved alarms again.
    Unshelve(operate::Which),
    /// Take alarms out of service until they are put back.
    OutOfService(operate::Which),
    /// Put alarms back into service.
    InService(operate::Which),
    /// Tell a running plant that its supervision is alive, once; `[heartbeat]` in the plant file says how often it must come.
    Heartbeat(operate::Heartbeat),
    /// Show records of a running plant: what happened, and who did it.
    Records(operate::Records),
    /// Write the project of a new block, in one of several languages.
    ///
    /// The folder NAME holds the block's source with the ports of its class, its WIT, a test that passes, a README and
    /// block.toml. Asks on a terminal for what is not given.
    New(author::New),
    /// Build the component of a project that `new` wrote, with the language's own tool.
    Build(author::Build),
    /// Give a block of a running plant another version of its component, between two scans and with its state.
    ///
    /// The new version is read, checked, compiled and set up beside the lanes; with --shadow it runs beside the old one first.
    /// What would break stops it before anything is touched, and a fault within its probation puts the old version back. At a
    /// terminal the plan is shown and one is asked; Ctrl-C leaves the swap on its way.
    Swap(swap::Swap),
    /// Put an earlier version of a block back, with the state it had.
    Rollback(swap::Rollback),
    /// List the swaps of a running plant, follow one, or call it off.
    Swaps(swap::Swaps),
    /// Test blocks without a plant: cases of steps at virtual time, from files FILE.test.toml.
    ///
    /// A case starts a new instance of the component, gives it inputs, commands and settings at times of its own, and says
    /// what outputs, alarms and state are to be. docs/testing-a-block.md shows how such a file is written. The subject may
    /// be a whole plant as well, `plant = "plant.toml"`: docs/testing-a-plant.md.
    Test(test::Test),
    /// Search for what is wrong with a block: random inputs, times, commands, settings, restarts.
    ///
    /// Finds traps, executions that take too long, memory that grows for ever, instances that differ though they were told the
    /// same, and blocks that go on otherwise after a restart. What fails is shrunk to the smallest story and written as a test
    /// file, which `latchwork test` runs. docs/fuzzing-a-block.md tells more.
    Fuzz(fuzz::Fuzz),
    /// Tell whether a plant would take a block: class, imports, size, memory, time, restart.
    CheckBlock(fuzz::CheckBlock),
    /// Print the JSON Schema of the plant file, for editors.
    ///
    /// In VS Code with the Even Better TOML extension, put `#:schema plant.schema.json` in the first line of the plant
    /// file after `latchwork schema > plant.schema.json`.
    Schema,
}

/// `latchwork journal`
#[derive(ClapArgs, Debug)]
pub(crate) struct Journal {
    /// What to do with it.
    #[command(subcommand)]
    pub(crate) command: JournalCommand,
}

/// The commands of a journal.
#[derive(Subcommand, Debug)]
pub(crate) enum JournalCommand {
    /// Tell whether a journal is whole: no damage, no number missing without a `lost` record that says so.
    Verify(VerifyJournal),
    /// Write records as CSV or JSON Lines, to the output or into a file such as one on a USB stick.
    Export(Export),
}

/// `latchwork journal verify`
#[derive(ClapArgs, Debug)]
pub(crate) struct VerifyJournal {
    /// The folder that `run --data` was given; a plant may be running with it.
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// Print as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// How records are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// A header and a row per record, for spreadsheets.
    Csv,
    /// A JSON object per line.
    Jsonl,
}

/// `latchwork journal export`
#[derive(ClapArgs, Debug)]
pub(crate) struct Export {
    /// The folder that `run --data` was given; a plant may be running with it.
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// Only records from this time on: 2026-11-27 (midnight UTC) or 2026-11-27T09:30:00Z.
    #[arg(long, value_name = "TIME", value_parser = instant)]
    pub(crate) from: Option<u64>,
    /// Only records before this time.
    #[arg(long, value_name = "TIME", value_parser = instant)]
    pub(crate) to: Option<u64>,
    /// Form of the output.
    #[arg(long, value_enum, default_value = "jsonl")]
    pub(crate) format: Format,
    /// Write into this file instead of the output; it is on the disk when the program ends.
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}

/// A point in time, ns since 1970.
fn instant(text: &str) -> Result<u64, String> {
    let midnight = |date: jiff::civil::Date| {
        jiff::tz::TimeZone::UTC.to_timestamp(date.to_datetime(jiff::civil::Time::midnight())).ok()
    };
    let time = text.parse::<jiff::Timestamp>().ok().or_else(|| midnight(text.parse().ok()?));
    time.and_then(|t| u64::try_from(t.as_nanosecond()).ok())
        .ok_or_else(|| "expected a time since 1970, as in 2026-11-27 or 2026-11-27T09:30:00Z".into())
}

/// Which clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Speed {
    /// The machine's clock, a thread per lane.
    Real,
    /// Virtual time, as fast as it goes; the same result every time, to the byte.
    Max,
}

/// `latchwork run`
#[derive(ClapArgs, Debug)]
pub(crate) struct Run {
    /// The plant file.
    #[arg(value_name = "PLANT")]
    pub(crate) plant: PathBuf,
    /// Replace every driver by `sim` points, and add the blocks and feeds of [sim].
    #[arg(long)]
    pub(crate) sim: bool,
    /// Plant time to run, such as 10s or 1m 30s.
    #[arg(long = "for", value_name = "TIME", value_parser = duration, conflicts_with = "scans")]
    pub(crate) duration: Option<u64>,
    /// Scans of the first lane to run.
    #[arg(long, value_name = "N")]
    pub(crate) scans: Option<u64>,
    /// `max` needs a plant of `sim` drivers only, or --sim.
    #[arg(long, value_enum, default_value = "real")]
    pub(crate) speed: Speed,
    /// CSV `time,tag,value` that moves input points of sim drivers and sends commands to blocks.
    #[arg(long, value_name = "FILE")]
    pub(crate) stimulus: Option<PathBuf>,
    /// Write a CSV row `time_ns,lane,tag,value` whenever a tag has changed at the end of a scan.
    #[arg(long, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
    /// Tags to trace; lane.* only when named.
    #[arg(long, value_name = "GLOB", default_value = "*", requires = "trace")]
    pub(crate) trace_tags: String,
    /// Keep every record in a journal in this folder, on the disk within 100 ms; numbers go on from run to run.
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Write every record as a line of JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) records: Option<PathBuf>,
    /// Serve a control socket there, for `latchwork status`, `set`, `alarms` and others; at the machine's clock only.
    #[arg(long, value_name = "PATH")]
    pub(crate) socket: Option<PathBuf>,
    /// Print the summary as JSON, and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing while the plant runs.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

/// `latchwork check`
#[derive(ClapArgs, Debug)]
pub(crate) struct Check {
    /// The plant file.
    #[arg(value_name = "PLANT")]
    pub(crate) plant: PathBuf,
    /// Check it as `run --sim` would run it.
    #[arg(long)]
    pub(crate) sim: bool,
    /// Print the findings as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `latchwork inspect`
#[derive(ClapArgs, Debug)]
pub(crate) struct Inspect {
    /// The component, a .wasm file.
    #[arg(value_name = "COMPONENT")]
    pub(crate) component: PathBuf,
    /// Print as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `latchwork tags`
#[derive(ClapArgs, Debug)]
pub(crate) struct Tags {
    /// The plant file.
    #[arg(value_name = "PLANT")]
    pub(crate) plant: PathBuf,
    /// List them as `run --sim` would have them.
    #[arg(long)]
    pub(crate) sim: bool,
    /// Print as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `latchwork doctor`
#[derive(ClapArgs, Debug)]
pub(crate) struct Doctor {
    /// A plant file: only what this plant needs is bad when it is missing, the rest is a note.
    #[arg(value_name = "PLANT")]
    pub(crate) plant: Option<PathBuf>,
    /// Print as JSON: a list of {check, status, found, why, mend}.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `latchwork gpio`
#[derive(ClapArgs, Debug)]
pub(crate) struct Gpio {
    /// Only this chip: its path, name or label, as in /dev/gpiochip0, gpiochip0 or pinctrl-bcm2711.
    #[arg(long, value_name = "CHIP")]
    pub(crate) chip: Option<String>,
    /// Print as JSON: a list of {path, name, label, lines}.
    #[arg(long)]
    pub(crate) json: bool,
}

fn duration(text: &str) -> Result<u64, String> {
    latchwork_image::parse_duration(text).map_err(|e| e.to_string())
}
