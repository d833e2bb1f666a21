//! What operators can do with a running plant, whoever brings their wishes.
//!
//! A wish is an [`Operation`] by an [`Operator`]; it goes through a [`Console`] to the thread that looks after the plant, which
//! answers once it is done. Everything that changes something becomes a record with the operator's name, refused or not.

mod answer;
mod commands;
mod console;
mod desk;
mod forces;
mod policy;
mod restore;
mod serve;
mod settings;
mod status;
mod tags;

use crate::swap::SwapOrder;
pub use answer::{AlarmRow, Answer, ForceRow, Refused, TagRow};
pub use console::{Console, Pending, Wishes, console};
pub use desk::{Desk, Wish};
pub use policy::{Policy, Whom, WhomError};

/// Who wants something.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Operator {
    /// Name of the user.
    pub user: String,
    /// Where the wish comes from: `cli`, `api`, `panel`, `script`.
    pub origin: String,
    /// Why, if it was said.
    pub reason: String,
}

/// A wish.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation {
    /// Values of tags; globs are allowed. Nothing is recorded.
    Read {
        /// Names or globs.
        tags: Vec<String>,
    },
    /// Stages values of settings (`BLOCK.settings.NAME`), or sets points of `sim` drivers at once.
    Set {
        /// Tags with their new values, as text.
        values: Vec<(String, String)>,
        /// Also writes the settings of these blocks (`write-values`).
        write: bool,
    },
    /// Takes the staged settings of a block through its `configure`.
    WriteValues {
        /// Block.
        block: String,
    },
    /// Forgets the staged settings of a block.
    DiscardValues {
        /// Block.
        block: String,
    },
    /// The settings of a block: in effect and staged.
    ReadValues {
        /// Block.
        block: String,
    },
    /// Holds a tag at a value.
    Force {
        /// Tag.
        tag: String,
        /// Value, as text.
        value: String,
    },
    /// Takes a force away; of all tags that a glob names.
    Unforce {
        /// Tag or glob.
        tag: String,
    },
    /// What is forced.
    Forces,
    /// A command to a block: `BLOCK.commands.NAME`.
    Command {
        /// Tag.
        tag: String,
        /// On or off, for toggle and retained commands; `None`: a one-shot, or the other state of a toggle.
        on: Option<bool>,
    },
    /// The list of alarms; all of them, or those that are listed or hidden.
    Alarms {
        /// Normal ones, too.
        all: bool,
    },
    /// Acknowledges alarms.
    Acknowledge {
        /// Name or glob.
        alarm: String,
        /// Number of the newest record the operator has seen: an alarm raised after it is not acknowledged.
        seen: Option<u64>,
    },
    /// Resets alarms.
    Reset {
        /// Name or glob.
        alarm: String,
    },
    /// Hides an alarm for a time.
    Shelve {
        /// Name or glob.
        alarm: String,
        /// How long, ns.
        duration: u64,
    },
    /// Shows it again.
    Unshelve {
        /// Name or glob.
        alarm: String,
    },
    /// Takes an alarm out of service, or puts it back.
    OutOfService {
        /// Name or glob.
        alarm: String,
        /// Out or back.
        out: bool,
    },
    /// The supervision is alive.
    Heartbeat,
    /// How the plant is: lanes, blocks, alarms, forces.
    Status,
    /// What the flight recorder has in memory, as a file.
    Recording,
    /// Another version of a block, or of several; answered at once with the swap's number, then it goes its way.
    Swap(Box<SwapOrder>),
    /// Calls a swap off that has not reached its lane.
    CancelSwap {
        /// Its number.
        number: u64,
    },
    /// Swaps and how far they are: one, or those that the plant still knows.
    Swaps {
        /// Its number.
        number: Option<u64>,
    },
    /// Puts an earlier version of a block back, with the state it had.
    Rollback {
        /// Block.
        block: String,
        /// How many versions back, from 1.
        steps: u64,
    },
}

impl Operation {
    /// The right it needs, as the plant file's policy names it.
    pub fn right(&self) -> &'static str {
        match self {
            Self::Read { .. } | Self::ReadValues { .. } | Self::Forces | Self::Alarms { .. } => "view",
            Self::Status | Self::Swaps { .. } | Self::Recording => "view",
            Self::Set { .. } | Self::WriteValues { .. } | Self::DiscardValues { .. } => "set",
            Self::Force { .. } | Self::Unforce { .. } => "force",
            Self::Swap(_) | Self::CancelSwap { .. } | Self::Rollback { .. } => "swap",
            Self::Command { .. } | Self::Heartbeat => "command",
            Self::Acknowledge { .. } | Self::Reset { .. } => "alarm",
            Self::Shelve { .. } | Self::Unshelve { .. } | Self::OutOfService { .. } => "shelve",
        }
    }
}

/// Rights that a policy can give, in the order of their weight.
pub const RIGHTS: &[&str] = &["view", "alarm", "command", "shelve", "set", "force", "swap"];
