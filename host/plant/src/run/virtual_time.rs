//! Virtual time: one thread, lanes in the order of their deadlines, the same result on every machine.

use super::{Control, Observer, Outcome, RunOptions};
use crate::assemble::Plant;
use crate::lane::LaneState;
use latchwork_block::Ticker;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Runs a plant as fast as it goes. Lanes due at the same time run by priority, then in the order of the file.
pub fn run_virtual(mut plant: Plant, options: &RunOptions, stop: &AtomicBool, observer: &mut dyn Observer) -> Outcome {
    // Plant time stands still in a scan, but a block that never ends must be stopped by some clock.
    let _ticker = Ticker::start(&plant.engine, Duration::from_nanos(plant.tick));
    let mut due: Vec<u64> = vec![0; plant.lanes.len()];
    let mut stimulus = options.stimulus.iter().peekable();
    let mut now = 0;
    loop {
        let next = (0..plant.lanes.len())
            .filter(|i| !matches!(plant.lanes[*i].state(), LaneState::Stopped | LaneState::Faulted))
            .min_by_key(|i| (due[*i], std::cmp::Reverse(plant.model.lanes[*i].priority), *i));
        // Without a lane that runs, nothing would ever happen again.
        let Some(lane) = next else { break };
        if options.duration.is_some_and(|d| due[lane] >= d) {
            now = options.duration.unwrap_or(now);
            break;
        }
        if options.scans.is_some_and(|n| plant.lanes[0].statistics().scans >= n) {
            break;
        }
        now = due[lane];
        while let Some(next) = stimulus.next_if(|s| s.time <= now) {
            plant.stimulate(next.action);
        }
        plant.sim.publish(now);
        plant.lanes[lane].scan(now, now, || now);
        due[lane] = now.saturating_add(plant.lanes[lane].every());
        plant.supervisor.pump();
        plant.drain(now, observer);
        if observer.tick(now) == Control::Stop || stop.load(Ordering::Relaxed) {
            break;
        }
    }
    for lane in &mut plant.lanes {
        lane.stop(now);
    }
    plant.drain(u64::MAX, observer);
    Outcome::new(&plant.model, &mut plant.lanes, now, plant.router.last_seq())
}

impl Plant {
    /// Passes on the trace rows there are and the records older than `before`.
    pub(super) fn drain(&mut self, before: u64, observer: &mut dyn Observer) {
        for changes in &mut self.trace {
            while let Ok(change) = changes.pop() {
                observer.change(&change);
            }
        }
        self.router.release(before, |record| observer.record(record));
    }
}
