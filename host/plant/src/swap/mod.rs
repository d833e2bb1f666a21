//! Hot swap: another version of a block under a running plant.
//!
//! ```text
//! order ─► prepare (own thread: load, check, compile, instantiate, configure) ─► plan
//!       ─► shadow (candidate fed by a tap of the lane, off it) ─► exchange (in the lane, between two scans)
//!       ─► probation (the old instance waits) ─► done, or rolled back
//! ```

mod broken;
mod exchange;
mod loggers;
mod manage;
mod order;
mod ports;
mod prepare;
mod rollback;
pub mod save;
mod saving;
mod settings;
mod shade;
mod shadow;
mod sinks;
mod status;
mod told;
mod turn;
mod versions;
mod workers;

pub use order::{PROBATION, Part, SINK_PROBATION, SwapOrder, Tolerance, WayBack, usual_probation};
pub use shadow::{Candidate, Shadow, Verdict};
pub use status::{BlockPlan, Deviation, FailedRun, ShadowReport, Stage, SwapStatus, Version};

use crate::operate::Operator;
use prepare::{Job, Prepared, Ready};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::mpsc::Receiver;
use versions::History;
use workers::{Wish, Workers};

/// Swaps that have ended and are still told.
const ENDED: usize = 32;
/// Swaps under way at once.
const UNDER_WAY: usize = 16;

/// All swaps of a plant: what is under way, and the versions of each block.
#[derive(Default)]
pub struct Swaps {
    /// Number of the last one.
    number: u64,
    /// Number of the last version.
    version: u64,
    under_way: Vec<Swap>,
    ended: VecDeque<SwapStatus>,
    /// Swaps that have ended while their exchange was on its way: number, blocks, what was to become of each.
    not_done: VecDeque<(u64, Vec<usize>, Vec<Coming>)>,
    /// By block of the model; one that was never swapped has none.
    histories: BTreeMap<usize, History>,
    workers: Workers,
    /// What writes into the plant file, once something was to be saved.
    saver: Option<save::Saver>,
    /// By block: hash of the component that the plant file names since it was saved.
    of_file: BTreeMap<usize, String>,
    /// The sinks, if they work.
    sinks: Option<latchwork_sink::Swapper>,
    of_sinks: Vec<sinks::SinkSwap>,
    /// By name of the sink, of kind `component`.
    loggers: BTreeMap<String, loggers::Logger>,
    untaps: shade::Untaps,
}

/// A swap under way.
struct Swap {
    status: SwapStatus,
    operator: Operator,
    lane: usize,
    /// Blocks of the model, in the order of the parts.
    blocks: Vec<usize>,
    /// Executions in the shadow first.
    shadow: u64,
    tolerances: Vec<Tolerance>,
    lossy: bool,
    /// Executions of the probation.
    probation: u64,
    dry_run: bool,
    /// What is to be saved when its probation is over.
    keep: Vec<save::Keep>,
    /// An operator takes an earlier version back.
    back: bool,
    /// Executions that the probation has before it still.
    left: Arc<AtomicU64>,
    /// To call it off before the lane has done it.
    ticket: Arc<crate::lane::Ticket>,
    phase: Phase,
}

/// Where a swap is.
enum Phase {
    /// On a thread of its own, which tells how long it took, ns.
    Preparing(Receiver<(Prepared, u64)>, Wish),
    /// The same at virtual time: it is done in the next turn.
    Waiting(Box<Job>),
    /// Prepared, and seen in the shadow if that was wanted; settings that are on their way to the block come first.
    Ready(Vec<Ready>),
    /// The candidates run in the shadow of the running ones.
    Shadow(Vec<Ready>, Vec<Shadow>),
    /// On its way to the lane.
    Exchanging(Vec<Coming>),
    /// The version before waits in the lane.
    Probation,
    /// The lane was asked to end the probation of that swap.
    TakingBack(u64),
    /// Its probation is over, and what runs is written into the plant file.
    Saving(saving::Saving),
    /// It has ended.
    Over,
}

/// What becomes of a block's history when its lane has exchanged it.
struct Coming {
    component: latchwork_block::Component,
    recipe: crate::supervisor::Recipe,
    /// Number of the earlier version that it is.
    was: Option<u64>,
}
