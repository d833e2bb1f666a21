//! Virtual time: one thread, everything in the order of its time, the same result on every machine.
//!
//! What happens next is the earliest of: a row of the stimulus, the end of a scan (`[sim.scan-time]` makes scans take time),
//! the beginning of one, an edge or tick that waits for an interrupt lane, the end of a storm. At the same time they come in
//! that order; lanes by priority, then as in the file.

use super::{Control, Observer, Outcome, RunOptions};
use crate::assemble::Plant;
use crate::lane::{Lane, LaneState};
use crate::model;
use crate::sim::Action;
use latchwork_block::Ticker;
use std::cmp::Reverse;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What a lane does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    /// Its scan ends.
    End,
    /// Its scan begins, or an execution for what waits.
    Begin,
    /// Held edges, ends of storms.
    Calm,
}

/// Where a lane is.
struct Progress {
    /// When its next scan or poll is due.
    due: u64,
    /// The scan that has begun, while it lasts.
    busy: Option<Busy>,
    /// Scans begun, to choose the next scan time.
    begun: usize,
}

/// A scan that takes time.
#[derive(Clone, Copy)]
struct Busy {
    /// When it ends.
    end: u64,
    /// The time of its records.
    stamp: u64,
    /// The lane's grid was what began it: the next deadline follows.
    of_grid: bool,
}

impl Progress {
    /// The next step of a lane and its time; `now` is the earliest.
    fn next(&self, lane: &Lane, now: u64) -> Option<(u64, Step)> {
        if matches!(lane.state(), LaneState::Stopped | LaneState::Faulted) {
            return None;
        }
        if let Some(busy) = self.busy {
            return Some((busy.end, Step::End));
        }
        let Some(arrivals) = lane.arrivals() else { return Some((self.due, Step::Begin)) };
        let waiting = arrivals.peek().map(|time| (time.max(now), Step::Begin));
        let poll = lane.polls().then_some((self.due, Step::Begin));
        let calm = arrivals.deadline().map(|time| (time.max(now), Step::Calm));
        [waiting, poll, calm].into_iter().flatten().min()
    }

    /// Ends what has begun.
    fn end(&mut self, lane: &mut Lane, config: &model::Lane, of_grid: bool, now: u64) {
        if lane.is_interrupt() {
            lane.end_activation(now);
        } else {
            lane.end_scan(now);
        }
        if of_grid {
            self.due = super::next_due(self.due, now, config.every.max(1));
        }
        lane.calm(now);
    }
}

/// A plant at virtual time, under way: whoever holds it says how far it goes, and looks at it in between.
pub struct VirtualRun {
    plant: Plant,
    progress: Vec<Progress>,
    now: u64,
    /// Number of the last record before the run.
    before: u64,
    /// Plant time stands still in a scan, but a block that never ends must be stopped by some clock.
    _ticker: Ticker,
}

impl VirtualRun {
    /// Begins at plant time 0; nothing has been scanned yet.
    pub fn begin(mut plant: Plant) -> Self {
        let ticker = Ticker::start(&plant.engine, Duration::from_nanos(plant.tick));
        let progress: Vec<_> = plant.lanes.iter().map(|_| Progress { due: 0, busy: None, begun: 0 }).collect();
        let before = plant.router.last_seq();
        plant.begin_recorder();
        plant.lanes.iter_mut().for_each(|lane| lane.begin_interrupts(0));
        Self { plant, progress, now: 0, before, _ticker: ticker }
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Plant time, ns.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// When something happens next by itself, ns; `None` when no lane runs any more.
    pub fn next(&self) -> Option<u64> {
        self.alive().then(|| self.due().map(|(time, ..)| time)).flatten()
    }

    /// Does what a row of a stimulus says, at plant time `at`, ns: before everything else that is due then.
    pub fn stimulate(&mut self, action: &Action, at: u64) {
        self.now = self.now.max(at);
        self.plant.stimulate(action, self.now);
        self.plant.settle(&self.progress, self.now);
    }

    /// Hears what operators want through the console, at plant time `at`, ns: before everything else that is due then.
    pub fn serve(&mut self, at: u64) {
        self.now = self.now.max(at);
        self.plant.serve(self.now);
    }

    /// Does everything that is due up to plant time `until`, ns, and at it; then all records up to it are told.
    pub fn advance(&mut self, until: u64, observer: &mut dyn Observer) {
        while let Some((time, step, index)) = self.due().filter(|(time, ..)| *time <= until && self.alive()) {
            self.step(time, step, index, observer);
        }
        self.now = self.now.max(until);
        self.plant.serve(self.now);
        self.plant.sim.publish(self.now);
        let settled = self.settled().unwrap_or(u64::MAX).min(self.now.saturating_add(1));
        self.plant.drain(settled, self.now.saturating_add(1), observer);
    }

    /// Stops the lanes in order.
    pub fn end(mut self, observer: &mut dyn Observer) -> Outcome {
        let (now, plant) = (self.now, &mut self.plant);
        for lane in &mut plant.lanes {
            lane.stop(now);
        }
        plant.serve(now);
        let mut lanes = std::mem::take(&mut plant.lanes);
        plant.retain_last(&mut lanes, now);
        plant.lanes = lanes;
        plant.drain(u64::MAX, now, observer);
        Outcome::new(&plant.model, &mut plant.lanes, now, plant.router.last_seq() - self.before)
    }

    /// Without a lane that runs, nothing would ever happen again.
    fn alive(&self) -> bool {
        self.plant.lanes.iter().any(|l| matches!(l.state(), LaneState::Starting | LaneState::Running))
    }

    /// What lanes do next: when, what, which.
    fn due(&self) -> Option<(u64, Step, usize)> {
        let Self { plant, progress, now, .. } = self;
        (0..plant.lanes.len())
            .filter_map(|i| progress[i].next(&plant.lanes[i], *now).map(|(time, step)| (time, step, i)))
            .min_by_key(|(time, step, i)| (*time, *step, Reverse(plant.model.lanes[*i].priority), *i))
    }

    fn step(&mut self, time: u64, step: Step, index: usize, observer: &mut dyn Observer) {
        let Self { plant, progress, now, .. } = self;
        *now = time.max(*now);
        let now = *now;
        plant.serve(now);
        plant.sim.publish(now);
        plant.step(&mut progress[index], index, step, now);
        plant.settle(progress, now);
        plant.supervisor.pump();
        let settled = self.settled().map_or(now, |oldest| oldest.min(now));
        self.plant.drain(settled, now, observer);
    }

    /// A record may still come with the time of the oldest edge that waits, or of a scan that has not ended.
    fn settled(&self) -> Option<u64> {
        let running = |l: &&Lane| matches!(l.state(), LaneState::Starting | LaneState::Running);
        let waiting = self.plant.lanes.iter().filter(running).filter_map(|l| l.arrivals()?.oldest());
        let scanning = self.progress.iter().filter_map(|p| p.busy.map(|busy| busy.stamp));
        waiting.chain(scanning).min()
    }
}

/// Runs a plant as fast as it goes.
pub fn run_virtual(plant: Plant, options: &RunOptions, stop: &AtomicBool, observer: &mut dyn Observer) -> Outcome {
    let counted = plant.lanes.iter().position(|l| !l.is_interrupt()).unwrap_or(0);
    let mut run = VirtualRun::begin(plant);
    let mut stimulus = options.stimulus.iter().peekable();
    loop {
        let (next, alive) = (run.due(), run.alive());
        let row = stimulus.peek().map(|row| row.time).filter(|row| alive && next.is_none_or(|(time, ..)| *row <= time));
        let Some(time) = row.or(next.map(|(time, ..)| time)) else { break };
        if options.duration.is_some_and(|d| time >= d) {
            run.now = options.duration.unwrap_or(run.now);
            break;
        }
        if options.scans.is_some_and(|n| run.plant.lanes[counted].statistics().scans >= n) {
            break;
        }
        if let Some(row) = stimulus.next_if(|_| row.is_some()) {
            run.stimulate(&row.action, time);
            continue;
        }
        let Some((time, step, index)) = next else { break };
        run.step(time, step, index, observer);
        if observer.tick(run.now) == Control::Stop || stop.load(Ordering::Relaxed) {
            break;
        }
    }
    run.end(observer)
}

impl Plant {
    /// Lanes hear of what has happened; those that rest show the levels that no edge brings.
    fn settle(&mut self, progress: &[Progress], now: u64) {
        for (lane, progress) in self.lanes.iter_mut().zip(progress) {
            lane.collect();
            if progress.busy.is_none() && lane.has_levels() {
                lane.refresh(now);
            }
            if progress.busy.is_none() {
                lane.spare(progress.next(lane, now).map_or(u64::MAX, |(time, _)| time), || now);
            }
        }
    }

    /// Takes a step of a lane at plant time `now`.
    fn step(&mut self, progress: &mut Progress, index: usize, step: Step, now: u64) {
        let (lane, config) = (&mut self.lanes[index], &self.model.lanes[index]);
        let clock = &|| now;
        match step {
            Step::Calm => lane.calm(now),
            Step::End => {
                let of_grid = progress.busy.take().is_some_and(|busy| busy.of_grid);
                progress.end(lane, config, of_grid, now);
            }
            Step::Begin => {
                let arrival = lane.next_arrival(now);
                let (stamp, begun) = match arrival {
                    Some(arrival) => (arrival.time, lane.begin_activation(arrival, now, clock)),
                    None if lane.is_interrupt() => (now, lane.begin_poll(progress.due, now, clock)),
                    None => (now, lane.begin_scan(progress.due, now, clock)),
                };
                let of_grid = arrival.is_none();
                if !begun {
                    if of_grid {
                        progress.due = super::next_due(progress.due, now, config.every.max(1));
                    }
                    return;
                }
                let times = &config.scan_times;
                let takes = if times.is_empty() { 0 } else { times[progress.begun % times.len()] };
                progress.begun += 1;
                if takes > 0 {
                    progress.busy = Some(Busy { end: now.saturating_add(takes), stamp, of_grid });
                    return;
                }
                progress.end(lane, config, of_grid, now);
            }
        }
    }
}
