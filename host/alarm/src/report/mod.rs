//! The figures of ISA-18.2 (IEC 62682) and EEMUA 191 over a history of alarms, with the limits that they recommend.
//!
//! ```text
//! Event, Event, … ──► Collector ──► Report ──figures()──► Figure with its recommended limit
//!                       ├─ Life: one alarm; where it stands, how fast it repeats, how long it waited
//!                       └─ Floods: the last eleven alarms of all
//! ```
//!
//! One pass, in the order of the journal. Memory grows with the number of alarms and of ten-minute periods in which one was
//! raised, never with the number of events.

mod chatter;
mod collect;
mod figure;
mod flood;
mod life;

pub use collect::{Collector, Event};
pub use figure::{Figure, Limit, Unit, Verdict};
pub use flood::Flood;

use crate::State;

/// A second, ns.
pub const SECOND: u64 = 1_000_000_000;
/// The period of the standard's rates, and the window in which floods begin and end, ns.
pub const TEN_MINUTES: u64 = 600 * SECOND;
/// An hour, ns.
pub const HOUR: u64 = 3600 * SECOND;
/// A day, ns.
pub const DAY: u64 = 24 * HOUR;
/// More alarms than this in ten minutes are a flood.
pub const FLOOD_BEGINS: usize = 10;
/// A flood ends when there are fewer than this in ten minutes.
pub const FLOOD_ENDS: usize = 5;
/// More alarms than this make an hour one of the busy hours.
pub const BUSY_HOUR: u64 = 30;
/// An alarm chatters when it is raised three times within this, ns.
pub const CHATTERING: u64 = 60 * SECOND;
/// An alarm is fleeting when it returns within this, ns.
pub const FLEETING: u64 = SECOND;
/// An alarm is stale when it has been active for longer than this, ns.
pub const STALE: u64 = DAY;
/// A clock that goes back by more than this has jumped, ns: what it said before was wrong, or what it says now.
pub const JUMP_BACK: u64 = DAY;
/// A clock that goes ahead by more than this between two records has jumped, ns: no plant is silent for so long.
pub const JUMP_AHEAD: u64 = 90 * DAY;
/// So many of the most frequent alarms are listed.
pub const FREQUENT: usize = 10;

/// The ranks of priority that the standard distributes alarms over: around the four words of a plant file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rank {
    /// Priorities 0 to 99.
    Low,
    /// Priorities 100 to 159.
    Medium,
    /// Priorities 160 to 223.
    High,
    /// Priorities 224 to 255.
    Urgent,
}

impl Rank {
    /// All of them, the lowest first.
    pub const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::Urgent];

    /// The rank of a priority.
    pub fn of(priority: u8) -> Self {
        match priority {
            0..=99 => Self::Low,
            100..=159 => Self::Medium,
            160..=223 => Self::High,
            224..=255 => Self::Urgent,
        }
    }

    /// The word in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::Urgent => "urgent",
        }
    }

    /// Its recommended share of all alarms, percent: at least for the lowest, at most for the others.
    pub fn recommended(self) -> f64 {
        match self {
            Self::Low => 80.0,
            Self::Medium => 15.0,
            Self::High => 5.0,
            Self::Urgent => 1.0,
        }
    }
}

/// Ten minutes in which alarms were raised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bin {
    /// When it begins, ns since 1970; a multiple of ten minutes.
    pub start: u64,
    /// Alarms raised, by rank.
    pub raised: [u32; 4],
}

impl Bin {
    /// All alarms raised in it.
    pub fn total(&self) -> u64 {
        self.raised.iter().map(|n| u64::from(*n)).sum()
    }
}

/// An alarm and how often it was raised.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frequent {
    /// Name.
    pub alarm: Box<str>,
    /// How often.
    pub raised: u64,
}

/// An alarm that is raised again and again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chattering {
    /// Name.
    pub alarm: Box<str>,
    /// How often it was raised as one of three within a minute.
    pub raised: u64,
    /// How many runs of such there were.
    pub runs: u64,
    /// The shortest time in which it was raised three times, ns.
    pub fastest: u64,
}

/// An alarm that is gone before anybody can look.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fleeting {
    /// Name.
    pub alarm: Box<str>,
    /// How often it was gone within a second.
    pub count: u64,
    /// The shortest time it was active, ns.
    pub shortest: u64,
}

/// An alarm that was active for more than a day.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stale {
    /// Name.
    pub alarm: Box<str>,
    /// Since when, ns since 1970, of the longest time.
    pub since: u64,
    /// How long, ns.
    pub lasted: u64,
    /// It is active still, and shown.
    pub standing: bool,
}

/// An alarm that is not normal at the end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Standing {
    /// Name.
    pub alarm: Box<str>,
    /// How it stands.
    pub state: State,
    /// Since when, ns since 1970: when it was raised, was hidden, or began to wait for the operator.
    pub since: u64,
    /// Priority, 0 to 255.
    pub priority: u8,
}

/// How long operators took to acknowledge, ns; the quantiles are right to a thousandth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acknowledged {
    /// How often.
    pub count: u64,
    /// On average.
    pub mean: u64,
    /// Half of them took no longer.
    pub p50: u64,
    /// 95 % of them took no longer.
    pub p95: u64,
    /// The longest.
    pub longest: u64,
}

/// What a history of alarms comes to.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Where the period begins, ns since 1970.
    pub from: u64,
    /// Where it ends.
    pub to: u64,
    /// Alarms raised.
    pub raised: u64,
    /// How many different alarms were raised.
    pub different: usize,
    /// By priority, 0 to 255.
    pub by_priority: Box<[u64; 256]>,
    /// The ten-minute periods in which alarms were raised, in the order of time.
    pub bins: Vec<Bin>,
    /// The floods, in the order of time.
    pub floods: Vec<Flood>,
    /// The most frequent alarms, the first is the most frequent; at most [`FREQUENT`].
    pub frequent: Vec<Frequent>,
    /// The alarms that chattered, the worst first.
    pub chattering: Vec<Chattering>,
    /// The fleeting ones, the worst first.
    pub fleeting: Vec<Fleeting>,
    /// The stale ones, the longest first.
    pub stale: Vec<Stale>,
    /// Every alarm that is not normal at the end, the highest priority first.
    pub now: Vec<Standing>,
    /// Time to acknowledge; none when nothing was acknowledged.
    pub acknowledged: Option<Acknowledged>,
    /// Events whose transition is none that this knows.
    pub unknown: u64,
    /// How often the clock was set back by more than ten minutes: floods are not followed across that.
    pub set_back: u64,
    /// How often the clock jumped, by more than [`JUMP_BACK`] or [`JUMP_AHEAD`]: a period that was not asked for begins after
    /// the last of them.
    pub jumps: u64,
    /// Records that are missing from the journal.
    pub lost: u64,
}

impl Report {
    /// Length of the period, ns.
    pub fn length(&self) -> u64 {
        self.to - self.from
    }

    /// How many ten-minute periods of the clock it touches.
    pub fn periods(&self) -> u64 {
        self.touched(TEN_MINUTES)
    }

    /// How many periods of the clock it touches, of a length in ns that is a multiple of ten minutes.
    fn touched(&self, length: u64) -> u64 {
        // A report that ends with its last event contains that, which may be the first moment of a period.
        let to = self.bins.last().map_or(0, |b| b.start + 1).max(self.from + 1).max(self.to);
        to.div_ceil(length) - self.from / length
    }

    /// The ten minutes with the most alarms; the earlier one of equals.
    pub fn peak(&self) -> Option<Bin> {
        self.bins.iter().copied().min_by_key(|b| (u64::MAX - b.total(), b.start))
    }

    /// Alarms raised, by rank.
    pub fn by_rank(&self) -> [u64; 4] {
        let mut ranks = [0; 4];
        for (priority, count) in (0..=u8::MAX).zip(self.by_priority.iter()) {
            ranks[Rank::of(priority) as usize] += count;
        }
        ranks
    }

    /// How many are in a state at the end.
    pub fn standing(&self, state: State) -> usize {
        self.now.iter().filter(|s| s.state == state).count()
    }
}
