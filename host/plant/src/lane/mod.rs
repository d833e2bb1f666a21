//! A lane: blocks that execute together, once per scan.
//!
//! A scan is: take requests → latch inputs → execute blocks in order → alarms → statistics → publish. In steady state it
//! allocates nothing, takes no lock, makes no system call but the clock's (and, where an interrupt lane runs with it, the
//! one that wakes that lane), and logs nothing. Time comes in as an argument, so the same code runs on a real-time thread
//! and at virtual time. An interrupt lane is a lane with an [`Interrupt`]: see there.

mod adapter;
mod alarm;
mod block;
mod condition;
mod exchange;
mod fault;
mod follow;
mod grow;
mod interrupt;
mod message;
mod probation;
mod report;
mod request;
mod save;
mod statistics;
mod status;
mod tap;
mod trace;

pub use adapter::Adapter;
pub use block::{Block, BlockState, Rest};
pub use condition::Condition;
pub use exchange::{Carry, End, Exchange, Exchanged, Exchanging, Handed, Standing, Ticket};
pub use fault::{BACK_OFF, STRIKES};
pub use follow::{EdgeKind, Event, Feed, Follower, Sender, Simulated, Wake};
pub use grow::Growth;
pub use interrupt::{
    Arrival, Arrivals, Cause, DirectInput, DirectNames, DirectOutput, DirectPart, EdgeInput, FOLLOW, Interrupt, Watched,
};
pub use report::Report;
pub use request::{Configured, Mode, Reply, Request, RestartRequest};
pub use save::{PUT_OFF, Recent, Save, SaveAnswer, SaveResult};
pub use statistics::Statistics;
pub use status::Register;
pub use tap::{
    Frame, State as TapState, Tap, TapReader, TapSlot, Tape, Taps, Timer, on_tape, room, tap, tape, words as tap_words,
};
pub use trace::{Change, Tracer, Watch};

use crate::layout::{Convert, STATE};
use latchwork_image::{ForceInbox, RegionReader, RegionWriter};
use latchwork_record::{Entry, Kind, Recorder, SourceId};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Reports that may find no room at once, besides two per block.
const REPORTS: usize = 64;

/// State of a lane, first cell of its region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum LaneState {
    /// No scan yet.
    Starting = 0,
    /// Scanning; its outputs are live.
    Running = 1,
    /// Stopped in order.
    Stopped = 2,
    /// Stopped by a fault.
    Faulted = 3,
}

impl LaneState {
    /// From the cell.
    pub fn from_cell(cell: u64) -> Self {
        match cell {
            0 => Self::Starting,
            1 => Self::Running,
            2 => Self::Stopped,
            _ => Self::Faulted,
        }
    }

    /// The word for displays.
    pub fn name(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Running => "running",
            Self::Stopped => "stopped",
            Self::Faulted => "faulted",
        }
    }
}

/// What a lane is made of; assembled by [`crate::assemble`].
pub struct LaneParts {
    /// Name.
    pub name: String,
    /// Index in the model.
    pub index: usize,
    /// Period, ns.
    pub every: u64,
    /// Longest scan, ns.
    pub watchdog: u64,
    /// All cells, the published ones first.
    pub cells: Vec<u64>,
    /// Number of cells that are published; the region may be longer.
    pub used: usize,
    /// The lane's region.
    pub region: RegionWriter,
    /// Regions it reads, each with `(slot, cell)`.
    pub imports: Vec<(RegionReader, Vec<(u32, u32)>)>,
    /// Its blocks in order.
    pub blocks: Vec<Block>,
    /// Argument cells of all blocks.
    pub ins: Vec<u32>,
    /// Conversions of all blocks.
    pub converts: Vec<Convert>,
    /// Plain real outputs of all blocks with their exponent masks.
    pub reals: Vec<(u32, u64)>,
    /// Forces on its cells.
    pub forces: ForceInbox,
    /// Its records.
    pub recorder: Recorder,
    /// Its name as a source of records.
    pub source: SourceId,
    /// Requests from operators and the supervisor.
    pub requests: rtrb::Consumer<Request>,
    /// Blocks to be restarted.
    pub restarts: rtrb::Producer<RestartRequest>,
    /// What blocks said to new settings.
    pub configured: rtrb::Producer<Configured>,
    /// What else goes back to the plant.
    pub reports: rtrb::Producer<Report>,
    /// Bool tags that alarms hang on.
    pub conditions: Vec<Condition>,
    /// Traced tags.
    pub tracer: Tracer,
    /// What the flight recorder's taps on its blocks write.
    pub tape: Tape,
    /// Interrupt lanes that hear of the end of its scans.
    pub followers: Vec<Follower>,
    /// What makes it an interrupt lane.
    pub interrupt: Option<Box<Interrupt>>,
    /// Time of the oldest record it may still make, ns; all ones without any: younger records of others wait for it.
    pub oldest: Arc<AtomicU64>,
}

/// The times of one execution of a lane, ns of plant time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Moment {
    /// When it was due: the grid's deadline, or the edge.
    due: u64,
    /// When it began.
    start: u64,
    /// The time that blocks and records get: its start, or the edge.
    stamp: u64,
}

/// A lane that can scan.
pub struct Lane {
    parts: LaneParts,
    state: LaneState,
    statistics: Statistics,
    moment: Moment,
    /// Blocks that wait for a new instance or for the end of their back-off.
    waiting: Vec<u32>,
    /// Blocks whose one-shot commands go back after their next execution.
    one_shots: Vec<u32>,
    /// A block whose state is wanted.
    saving: Option<save::Waiting>,
    /// Taps that wait for the states of their blocks, in order.
    keyframes: Vec<save::Keyframe>,
    /// Exchanges that are timed, and those whose old versions wait.
    #[expect(clippy::vec_box, reason = "each goes back in the box that it came in: nothing is allocated here")]
    trials: Vec<Box<Exchange>>,
    /// Their blocks, in order.
    timed: Vec<u32>,
    /// Blocks that went back last, in order: those before the one that failed execute once more in that scan.
    back: Vec<u32>,
    /// Time of this scan that will not come again, ns: exchanges, and what versions took that are gone since.
    excess: u64,
    /// What the thread has worked, ns: see [`Lane::time_work_by`].
    work: Option<fn() -> u64>,
    /// One-shot commands were taken back since the last execution; those that are set now have not been seen.
    released: bool,
    /// Reports that found no room.
    unsent: report::Unsent<Report>,
}

impl Lane {
    /// A lane before its first scan.
    pub fn new(parts: LaneParts) -> Self {
        let blocks = parts.blocks.len();
        Self {
            // Edges have no grid that a scan could overrun.
            statistics: Statistics::new(if parts.every == 0 { u64::MAX } else { parts.every }),
            moment: Moment::default(),
            parts,
            state: LaneState::Starting,
            waiting: Vec::with_capacity(blocks),
            one_shots: Vec::with_capacity(blocks),
            saving: None,
            keyframes: Vec::with_capacity(Self::KEYFRAMES_PER_BLOCK * blocks),
            trials: Vec::with_capacity(blocks),
            timed: Vec::with_capacity(blocks),
            back: Vec::with_capacity(blocks),
            excess: 0,
            work: None,
            released: false,
            unsent: report::Unsent::new(2 * blocks + REPORTS),
        }
    }

    /// Name.
    pub fn name(&self) -> &str {
        &self.parts.name
    }

    /// Index in the model.
    pub fn index(&self) -> usize {
        self.parts.index
    }

    /// Period, ns.
    pub fn every(&self) -> u64 {
        self.parts.every
    }

    /// State.
    pub fn state(&self) -> LaneState {
        self.state
    }

    /// Figures so far.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Rows of the trace that found no room.
    pub fn trace_lost(&self) -> u64 {
        self.parts.tracer.lost()
    }

    /// Tells the other threads that records as old as `time` (plant time, ns) may still come; all ones when none will.
    pub fn mark(&self, time: u64) {
        // Whoever sees the mark taken back sees the records, too.
        self.parts.oldest.store(time, Ordering::Release);
    }

    /// Before the first scan: the bits of a block's alarms that were told last, in an earlier run.
    pub(crate) fn expect_alarms(&mut self, block: usize, mask: u64) {
        if let Some((_, previous)) = &mut self.parts.blocks[block].alarms {
            *previous |= mask;
        }
    }

    /// Before the first scan: what was told last of a watched tag, in an earlier run.
    pub(crate) fn expect_condition(&mut self, source: SourceId, on: Option<bool>) {
        for condition in self.parts.conditions.iter_mut().filter(|c| c.source == source) {
            condition.previous = on;
        }
    }

    /// Time that the thread which scans has worked so far, ns: what a new version is judged by. Without it that is the clock of
    /// the scan, and a version pays for what the machine did while it executed.
    pub fn time_work_by(&mut self, work: fn() -> u64) {
        self.work = Some(work);
    }

    /// Makes a record about the lane itself; not from within a scan.
    pub fn note(&mut self, now: u64, transition: &'static str, text: std::fmt::Arguments<'_>) {
        let entry = Entry::new(now, Kind::Lane, self.parts.source, transition).priority(100).text(text);
        self.parts.recorder.push(entry);
    }

    /// Its blocks, after the run.
    pub fn blocks_mut(&mut self) -> &mut [Block] {
        &mut self.parts.blocks
    }

    /// One scan at plant time `now`, due at `due` (ns); `clock` tells how long it took.
    pub fn scan(&mut self, due: u64, now: u64, clock: impl Fn() -> u64) -> LaneState {
        if self.begin_scan(due, now, &clock) { self.end_scan(clock()) } else { self.state }
    }

    /// The first half of a scan: inputs latched, blocks executed; nobody sees the outputs yet. False when the lane does not
    /// run any more. `clock` times what must be timed; one that stands still times nothing.
    pub fn begin_scan(&mut self, due: u64, now: u64, clock: &dyn Fn() -> u64) -> bool {
        if !self.begin(Moment { due, start: now, stamp: now }, clock) {
            return false;
        }
        self.parts.import();
        for index in 0..self.parts.blocks.len() {
            self.step(index, now, clock);
            self.report(index, now);
            // A block may have stopped the lane (`on-fault = "stop-lane"`).
            if self.state != LaneState::Running {
                break;
            }
        }
        true
    }

    /// The second half, at plant time `end`: outputs published.
    pub fn end_scan(&mut self, end: u64) -> LaneState {
        self.finish(end);
        self.state
    }

    /// What every execution of a lane begins with; false when it does not run any more.
    fn begin(&mut self, moment: Moment, clock: &dyn Fn() -> u64) -> bool {
        if matches!(self.state, LaneState::Stopped | LaneState::Faulted) {
            return false;
        }
        self.moment = moment;
        self.excess = 0;
        let first = self.state == LaneState::Starting;
        if first {
            self.state = LaneState::Running;
            self.parts.recorder.push(Entry::new(moment.stamp, Kind::Lane, self.parts.source, "started"));
        }
        self.parts.forces.update();
        if !std::mem::take(&mut self.released) {
            self.release_one_shots();
        }
        // An interrupt lane takes its requests while it waits: nothing stands between an edge and the reaction to it.
        if first || !self.is_interrupt() {
            self.take_requests(moment.stamp, clock);
        } else {
            self.restart_waiting(moment.stamp);
        }
        true
    }

    /// Executes a block; the ones that are timed are.
    #[inline]
    fn step(&mut self, index: usize, now: u64, clock: &dyn Fn() -> u64) {
        if self.trials.is_empty() {
            self.execute(index, now);
        } else {
            self.execute_timed(index, now, clock);
        }
    }

    /// Statistics, watchdog, trace, publication.
    fn finish(&mut self, end: u64) {
        let Moment { due, start, stamp } = self.moment;
        let scan_time = end.saturating_sub(start);
        self.statistics.scan(due, start, end);
        self.statistics.report(stamp, &mut self.parts.recorder, self.parts.source);
        // What is over is nothing to stop a lane for.
        let counts = scan_time.saturating_sub(self.excess);
        let excused = !self.trials.is_empty() && self.judge(stamp, counts);
        if self.state == LaneState::Running && counts > self.parts.watchdog && !excused {
            let watchdog = self.parts.watchdog;
            self.fail(
                stamp,
                format_args!("the scan took {} us, the watchdog allows {} us", scan_time / 1000, watchdog / 1000),
            );
        }
        self.parts.cells[STATE as usize] = self.state as u64;
        self.statistics.write(&mut self.parts.cells);
        self.parts.tracer.scan(stamp, &self.parts.cells);
        self.parts.watch_conditions(stamp);
        self.parts.recorder.settle(stamp);
        self.parts.publish(stamp);
        for follower in &mut self.parts.followers {
            follower.notify(end, &self.parts.cells);
        }
    }

    /// Stops in order: outputs become safe through the drivers, the last values stay visible.
    pub fn stop(&mut self, now: u64) {
        if matches!(self.state, LaneState::Starting | LaneState::Running) {
            self.state = LaneState::Stopped;
            self.statistics.settle(now, &mut self.parts.recorder, self.parts.source);
            self.settle_messages(now);
            self.settle_arrivals(now);
            self.parts.recorder.push(Entry::new(now, Kind::Lane, self.parts.source, "stopped"));
            self.publish_state(now);
            self.write_points(now);
            self.mark(u64::MAX);
        }
    }

    fn publish_state(&mut self, now: u64) {
        self.parts.cells[STATE as usize] = self.state as u64;
        self.parts.recorder.settle(now);
        self.parts.publish(now);
    }
}

impl LaneParts {
    /// Takes a snapshot of every foreign region: lanes first, then drivers, so that no effect is seen without its cause.
    #[inline]
    fn import(&mut self) {
        for (reader, wanted) in &self.imports {
            reader.gather(wanted, &mut self.cells);
        }
    }

    /// Shows everybody the published cells as they are now.
    #[inline]
    fn publish(&mut self, time: u64) {
        self.region.publish(&self.cells[..self.used], time);
    }
}

impl Drop for Lane {
    /// A lane that goes away while running has panicked: whoever reads its region must see that it is dead.
    fn drop(&mut self) {
        if self.state == LaneState::Running {
            self.state = LaneState::Faulted;
            self.parts.cells[STATE as usize] = self.state as u64;
            self.parts.publish(0);
        }
        self.mark(u64::MAX);
    }
}
