//! Running a plant: by the machine's clock on threads of its own, or at virtual time in one.

mod clock;
mod drain;
mod machine;
mod real_time;
mod stimulus;
mod thread;
mod virtual_time;
mod watchdog;

pub use clock::{Clock, MachineClock};
pub use real_time::run_real;
pub use stimulus::{StimulusError, resolve as resolve_stimulus};
pub use virtual_time::{VirtualRun, run_virtual};

use crate::lane::{BlockState, Change, Lane, LaneState, Statistics};
use crate::model::Model;
use crate::sim::Stimulus;
use latchwork_record::{Kept, Record};

/// When a run ends by itself, and what moves its sim points.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Plant time to run, ns.
    pub duration: Option<u64>,
    /// Scans of the first lane to run.
    pub scans: Option<u64>,
    /// Changes of sim points, by time.
    pub stimulus: Vec<Stimulus>,
}

/// Whether to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// Stop in order.
    Stop,
}

/// Who watches a run. Called off the lanes.
pub trait Observer {
    /// A record, in order, with what is to outlive the run together with it.
    fn record(&mut self, record: &Record, kept: &[Kept]);
    /// A row of the trace.
    fn change(&mut self, change: &Change);
    /// Now and then: at least once per scan at virtual time, every few milliseconds otherwise.
    fn tick(&mut self, now: u64) -> Control;
}

/// What became of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Plant time that passed, ns.
    pub time: u64,
    /// Per lane.
    pub lanes: Vec<LaneOutcome>,
    /// Blocks that faulted, in the order of the file.
    pub faulted: Vec<BlockOutcome>,
    /// Records that this run made; their numbers may go on after those of earlier runs.
    pub records: u64,
    /// Trace rows that found their queue full.
    pub trace_lost: u64,
}

/// What became of a lane.
#[derive(Clone, Debug)]
pub struct LaneOutcome {
    /// Name.
    pub name: String,
    /// State at the end.
    pub state: LaneState,
    /// Figures.
    pub statistics: Statistics,
}

/// What became of a block that faulted.
#[derive(Clone, Debug)]
pub struct BlockOutcome {
    /// Name.
    pub name: String,
    /// State at the end.
    pub state: BlockState,
    /// Faults in all.
    pub faults: u64,
}

impl Outcome {
    fn new(model: &Model, lanes: &mut [Lane], time: u64, records: u64) -> Self {
        let mut faulted = Vec::new();
        for lane in lanes.iter_mut() {
            for block in lane.blocks_mut() {
                if block.rest.faults > 0 {
                    let name = model.blocks[block.rest.model].name.clone();
                    faulted.push((
                        block.rest.model,
                        BlockOutcome { name, state: block.rest.state, faults: block.rest.faults },
                    ));
                }
            }
        }
        faulted.sort_by_key(|(index, _)| *index);
        Self {
            time,
            trace_lost: lanes.iter().map(Lane::trace_lost).sum(),
            lanes: lanes
                .iter()
                .map(|l| LaneOutcome { name: l.name().into(), state: l.state(), statistics: l.statistics().clone() })
                .collect(),
            faulted: faulted.into_iter().map(|(_, b)| b).collect(),
            records,
        }
    }

    /// True when a lane was stopped by a fault.
    pub fn faulted(&self) -> bool {
        self.lanes.iter().any(|l| l.state == LaneState::Faulted)
    }
}

/// The next deadline after `due`: the grid stays; deadlines that have passed are left out, not made up for.
fn next_due(due: u64, now: u64, every: u64) -> u64 {
    let passed = now.saturating_sub(due) / every;
    due.saturating_add(every.saturating_mul(passed.max(1)))
}

#[cfg(test)]
mod tests {
    use super::next_due;

    #[test]
    fn deadlines_stay_on_their_grid() {
        for (what, now, next) in [
            ("in time", 1_003, 1_010),
            ("at the very end of the period", 1_010, 1_010),
            ("an overrun: the next scan begins at once, late", 1_012, 1_010),
            ("two periods long: one deadline is left out", 1_025, 1_020),
            ("a clock that went back", 990, 1_010),
        ] {
            assert_eq!(next_due(1_000, now, 10), next, "{what}");
        }
        assert_eq!(next_due(u64::MAX - 3, u64::MAX, 10), u64::MAX);
    }
}
