//! Arguments of the commands that work on a running plant.

use super::{duration, instant};
use clap::Args as ClapArgs;
use std::path::PathBuf;

/// Which plant, and in what form it answers.
#[derive(ClapArgs, Debug)]
pub(crate) struct Reach {
    /// Control socket of the plant, as given to `run --socket` [default: the only one in /run/latchwork or
    /// $XDG_RUNTIME_DIR/latchwork that a plant serves].
    #[arg(long, value_name = "PATH", env = "LATCHWORK_SOCKET", hide_env_values = true)]
    pub(crate) socket: Option<PathBuf>,
    /// Print as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Which plant, and why: for what becomes a record.
#[derive(ClapArgs, Debug)]
pub(crate) struct Change {
    #[command(flatten)]
    pub(crate) reach: Reach,
    /// Why, in one line, for the record.
    #[arg(long, value_name = "TEXT")]
    pub(crate) reason: Option<String>,
}

/// `latchwork status`
#[derive(ClapArgs, Debug)]
pub(crate) struct Status {
    #[command(flatten)]
    pub(crate) reach: Reach,
}

/// `latchwork watch`
#[derive(ClapArgs, Debug)]
pub(crate) struct Watch {
    /// Tags, or globs in quotes: 'unit.outputs.*'.
    #[arg(value_name = "TAG", default_value = "*")]
    pub(crate) tags: Vec<String>,
    /// How often the plant is looked at, 50ms to 1h.
    #[arg(long, value_name = "TIME", default_value = "200ms")]
    pub(crate) every: String,
    #[command(flatten)]
    pub(crate) reach: Reach,
}

/// `TAG=VALUE`
#[derive(Clone, Debug)]
pub(crate) struct Assignment {
    pub(crate) tag: String,
    pub(crate) value: String,
}

fn assignment(text: &str) -> Result<Assignment, String> {
    match text.split_once('=') {
        Some((tag, value)) if !tag.is_empty() => Ok(Assignment { tag: tag.into(), value: value.into() }),
        _ => Err("expected TAG=VALUE, as in unit.settings.pulse=300ms".into()),
    }
}

/// `latchwork set`
#[derive(ClapArgs, Debug)]
#[group(id = "what", required = true, multiple = false, args = ["values", "write", "discard", "show"])]
pub(crate) struct Set {
    /// Settings with their new values, as in unit.settings.pulse=300ms; also input points of `sim` drivers.
    #[arg(value_name = "TAG=VALUE", value_parser = assignment)]
    pub(crate) values: Vec<Assignment>,
    /// Only stage the values: they take effect with --write.
    #[arg(long, requires = "values")]
    pub(crate) stage: bool,
    /// Write what is staged for a block: its `configure` takes all of it, or refuses.
    #[arg(long, value_name = "BLOCK")]
    pub(crate) write: Option<String>,
    /// Forget what is staged for a block.
    #[arg(long, value_name = "BLOCK")]
    pub(crate) discard: Option<String>,
    /// Show the settings of a block, in effect and staged.
    #[arg(long, value_name = "BLOCK")]
    pub(crate) show: Option<String>,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork force`
#[derive(ClapArgs, Debug)]
pub(crate) struct Force {
    /// Tags with the values they are held at, as in field.level=12000; none: list what is forced.
    #[arg(value_name = "TAG=VALUE", value_parser = assignment)]
    pub(crate) values: Vec<Assignment>,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork unforce`
#[derive(ClapArgs, Debug)]
pub(crate) struct Unforce {
    /// Tags, or globs in quotes; '*' takes every force away.
    #[arg(value_name = "TAG", required = true)]
    pub(crate) tags: Vec<String>,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork command`
#[derive(ClapArgs, Debug)]
pub(crate) struct Give {
    /// The command, as in pump.commands.start.
    #[arg(value_name = "TAG")]
    pub(crate) tag: String,
    /// Switch a toggle or retained command on.
    #[arg(long, conflicts_with = "off")]
    pub(crate) on: bool,
    /// Switch it off. Without either: a one-shot, or the other state of a toggle.
    #[arg(long)]
    pub(crate) off: bool,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork alarms`
#[derive(ClapArgs, Debug)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Alarms {
    /// Something else than the list.
    #[command(subcommand)]
    pub(crate) command: Option<super::AlarmsCommand>,
    /// Normal ones, too.
    #[arg(long)]
    pub(crate) all: bool,
    #[command(flatten)]
    pub(crate) reach: Reach,
}

/// `latchwork ack`
#[derive(ClapArgs, Debug)]
#[group(id = "which", required = true, multiple = false, args = ["alarms", "all"])]
pub(crate) struct Acknowledge {
    /// Alarms, or globs in quotes.
    #[arg(value_name = "ALARM")]
    pub(crate) alarms: Vec<String>,
    /// Acknowledge every alarm that is listed.
    #[arg(long)]
    pub(crate) all: bool,
    /// Nothing that came after this number, which `latchwork alarms` shows [default: the newest at this moment].
    #[arg(long, value_name = "NUMBER")]
    pub(crate) seen: Option<u64>,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork reset`, `unshelve`, `out-of-service`, `in-service`
#[derive(ClapArgs, Debug)]
pub(crate) struct Which {
    /// Alarms, or globs in quotes.
    #[arg(value_name = "ALARM", required = true)]
    pub(crate) alarms: Vec<String>,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork shelve`
#[derive(ClapArgs, Debug)]
pub(crate) struct Shelve {
    /// Alarms, or globs in quotes.
    #[arg(value_name = "ALARM", required = true)]
    pub(crate) alarms: Vec<String>,
    /// For how long, at most 168h: then they come back by themselves.
    #[arg(long = "for", value_name = "TIME", value_parser = duration)]
    pub(crate) duration: u64,
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork heartbeat`
#[derive(ClapArgs, Debug)]
pub(crate) struct Heartbeat {
    #[command(flatten)]
    pub(crate) change: Change,
}

/// `latchwork records`
#[derive(ClapArgs, Debug)]
pub(crate) struct Records {
    /// Go on with new records as they come.
    #[arg(long, short, conflicts_with_all = ["to", "limit"])]
    pub(crate) follow: bool,
    /// Only records after this number.
    #[arg(long, value_name = "NUMBER")]
    pub(crate) after: Option<u64>,
    /// Only records from this time on: 2026-11-27 (midnight UTC) or 2026-11-27T09:30:00Z.
    #[arg(long, value_name = "TIME", value_parser = instant)]
    pub(crate) from: Option<u64>,
    /// Only records before this time.
    #[arg(long, value_name = "TIME", value_parser = instant)]
    pub(crate) to: Option<u64>,
    /// Only records of this kind: alarm, command, setting, event, message, io, lane, fault, swap, audit, heartbeat, lost.
    #[arg(long, value_name = "KIND")]
    pub(crate) kind: Option<String>,
    /// Only records about this: a name, or a glob in quotes.
    #[arg(long, value_name = "NAME")]
    pub(crate) source: Option<String>,
    /// At most so many: the newest, or the first after --after or --from.
    #[arg(long, short = 'n', value_name = "N", default_value = "50")]
    pub(crate) limit: usize,
    #[command(flatten)]
    pub(crate) reach: Reach,
}
