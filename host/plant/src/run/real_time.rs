//! Real time: a thread per lane with absolute deadlines, one for I/O, and the caller's for everything else.

use super::machine::Machine;
use super::watchdog::Watchdog;
use super::{Clock, Control, Observer, Outcome, RunOptions};
use crate::assemble::{DriverParts, Plant};
use crate::lane::{Lane, LaneState, Wake};
use crate::operate::Wish;
use latchwork_block::Ticker;
use latchwork_image::Quality;
use latchwork_io::IoThread;
use latchwork_io::driver::{DriverContext, IoEvent};
use latchwork_record::{Draft, Entry, Kind, Recorder, SourceId};
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Period of the caller's housekeeping: restarts, records, display, ns.
const HOUSEKEEPING: u64 = 5_000_000;
/// Records wait this long for older ones of other lanes, ns.
const SETTLE: u64 = 20_000_000;
/// No longer than this do records wait for those of a scan that has not ended, ns: beyond it, order is worth less than
/// alarms that are seen. What comes later keeps its time and follows.
const HOLD: u64 = 3_000_000_000;
/// Lanes wait this long for the first reading of every driver, ns: a block need not see zeros that nobody has read.
const FIRST_READING: u64 = 1_000_000_000;
/// Time the drivers have to write their safe values.
const DRIVERS_STOP: Duration = Duration::from_secs(3);

/// What a lane's thread ends with.
type Driven = (Lane, Option<Watchdog>);

/// The lanes' threads. Dropped, it ends them in order: also when whoever watches them panics.
struct Threads {
    stop: Arc<AtomicBool>,
    wakes: Vec<Arc<Wake>>,
    lanes: Vec<(usize, JoinHandle<Driven>)>,
}

impl Threads {
    fn finished(&self, lane: usize) -> bool {
        self.lanes.iter().all(|(index, thread)| *index != lane || thread.is_finished())
    }

    /// Time of the oldest record that a lane may still make, ns.
    fn oldest(&self, marks: &[Arc<AtomicU64>]) -> u64 {
        let alive = self.lanes.iter().filter(|(_, thread)| !thread.is_finished());
        alive.map(|(lane, _)| marks[*lane].load(Ordering::Acquire)).min().unwrap_or(u64::MAX)
    }

    /// Ends the lanes, and gives back those that did not panic.
    fn end(&mut self) -> (Vec<Lane>, Option<Watchdog>) {
        self.stop.store(true, Ordering::Relaxed);
        self.wakes.iter().for_each(|w| w.wake());
        let (mut lanes, watchdogs): (Vec<Lane>, Vec<_>) =
            self.lanes.drain(..).filter_map(|(_, thread)| thread.join().ok()).unzip();
        lanes.sort_by_key(Lane::index);
        (lanes, watchdogs.into_iter().flatten().next())
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.end();
    }
}

/// Runs a plant by a clock until its time is over, `stop` turns true, or no lane runs any more. Lanes look at `stop`
/// themselves: a caller that hangs in its observer keeps no output from being safe.
pub fn run_real(
    mut plant: Plant,
    options: &RunOptions,
    clock: Arc<dyn Clock>,
    stop: &Arc<AtomicBool>,
    observer: &mut dyn Observer,
) -> Outcome {
    let _ticker = Ticker::start(&plant.engine, Duration::from_nanos(plant.tick));
    let before = plant.router.last_seq();
    plant.begin_recorder();
    let io = start_drivers(std::mem::take(&mut plant.drivers), &clock);
    wait_for_readings(&plant, &*clock, stop);
    let counted = plant.lanes.iter().position(|l| !l.is_interrupt()).unwrap_or(0);
    let interrupts = plant.lanes.iter().any(Lane::is_interrupt);
    let (machine, refused) = if interrupts { Machine::prepare() } else { (Machine::default(), None) };
    let mut threads = Threads { stop: Arc::default(), wakes: plant.wakes.clone(), lanes: Vec::new() };
    // Interrupt lanes first: cyclic ones see their inputs as they are, too.
    let (first, then): (Vec<_>, Vec<_>) = std::mem::take(&mut plant.lanes).into_iter().partition(Lane::is_interrupt);
    let (mut waited, mut failed) = (false, false);
    for mut lane in first.into_iter().chain(then) {
        if !lane.is_interrupt() && !std::mem::replace(&mut waited, true) {
            wait_for_interrupts(&plant, &*clock, stop);
        }
        if let (true, Some(refused)) = (lane.is_interrupt(), &refused) {
            lane.note(
                clock.now(),
                "not-locked",
                format_args!(
                    "memory was not locked into RAM ({refused}): a page that is not there may delay the lane; \
                     `latchwork doctor` tells what to do"
                ),
            );
        }
        let index = lane.index();
        // It counts from here on: nothing slow stands between this and the first scan.
        let watchdog = if index == counted { arm(&plant, &mut lane, &*clock) } else { None };
        let config = plant.model.lanes[index].clone();
        let scans = options.scans.filter(|_| index == counted);
        let (at, own, callers) = (Arc::clone(&clock), Arc::clone(&threads.stop), Arc::clone(stop));
        let name = config.name.clone();
        let body = move || {
            let stop = || own.load(Ordering::Relaxed) || callers.load(Ordering::Relaxed);
            let drive = super::thread::Drive { config: &config, scans, clock: &*at, stop: &stop };
            super::thread::drive(lane, watchdog, &drive)
        };
        match std::thread::Builder::new().name(format!("lane-{name}")).spawn(body) {
            Ok(thread) => threads.lanes.push((index, thread)),
            Err(error) => {
                failed = true;
                let mut draft = Draft::new(
                    clock.now(),
                    Kind::Lane,
                    crate::layout::lane_source(&plant.model.lanes[index]),
                    "faulted",
                );
                (draft.priority, draft.text) = (255, format!("the lane got no thread: {error}; the plant stops"));
                plant.router.insert(clock.now(), Wish::Record(Box::new(draft), Vec::new()));
            }
        }
    }
    let mut stimulus = options.stimulus.iter().peekable();
    let mut at = clock.now();
    loop {
        let now = clock.now();
        while let Some(next) = stimulus.next_if(|s| s.time <= now) {
            plant.stimulate(&next.action, next.time);
        }
        plant.serve(now);
        plant.sim.publish(now);
        plant.supervisor.pump();
        let oldest = threads.oldest(&plant.oldest).max(now.saturating_sub(HOLD));
        plant.drain(now.saturating_sub(SETTLE).min(oldest), now, observer);
        let over = options.duration.is_some_and(|d| now >= d)
            || (options.scans.is_some() && threads.finished(counted))
            || threads.lanes.iter().all(|(_, t)| t.is_finished())
            || stop.load(Ordering::Relaxed);
        if observer.tick(now) == Control::Stop || over || failed {
            break;
        }
        at = (at + HOUSEKEEPING).max(now);
        let next = stimulus.peek().map_or(at, |s| s.time.min(at));
        clock.sleep_until(next);
    }
    let (mut lanes, mut watchdog) = threads.end();
    if let Some(watchdog) = &mut watchdog {
        // For as long as the drivers may take.
        let _ = watchdog.pet();
    }
    io.stop(DRIVERS_STOP);
    // Lines that lanes serve themselves have had their safe values since their lanes ended.
    let in_order = lanes.iter().any(|l| l.index() == counted && l.state() == LaneState::Stopped);
    if let Some(watchdog) = watchdog.filter(|_| in_order) {
        // A device that does not take the letter resets the machine; nobody is left to tell.
        let _ = watchdog.disarm();
    }
    drop(machine);
    let end = clock.now();
    plant.serve(end);
    plant.drain(u64::MAX, end, observer);
    let mut outcome = Outcome::new(&plant.model, &mut lanes, clock.now(), plant.router.last_seq() - before);
    // A lane whose thread panicked or never was there left no figures; it still counts.
    for config in &plant.model.lanes {
        if !outcome.lanes.iter().any(|l| l.name == config.name) {
            let statistics = crate::lane::Statistics::new(config.every);
            outcome.lanes.push(super::LaneOutcome { name: config.name.clone(), state: LaneState::Faulted, statistics });
        }
    }
    outcome
}

/// Opens and arms the hardware watchdog that the plant names, for the lane that pets it.
fn arm(plant: &Plant, lane: &mut Lane, clock: &dyn Clock) -> Option<Watchdog> {
    let (path, timeout) = plant.model.watchdog.as_ref().filter(|_| !plant.model.sim)?;
    let opened = Watchdog::open(path, Duration::from_nanos(*timeout));
    match &opened {
        Ok(watchdog) => {
            if let Some(shortfall) = watchdog.shortfall() {
                lane.note(clock.now(), "watchdog", format_args!("{}: {shortfall}", path.display()));
            }
        }
        Err(error) => lane.note(clock.now(), "no-watchdog", format_args!("nothing resets the machine: {error}")),
    }
    opened.ok()
}

/// Waits until each interrupt lane has executed once, but not for ever.
fn wait_for_interrupts(plant: &Plant, clock: &dyn Clock, stop: &AtomicBool) {
    let waiting = |lane: usize| plant.model.lanes[lane].interrupt.is_some() && plant.regions[lane].publications() == 0;
    let end = clock.now().saturating_add(FIRST_READING);
    while (0..plant.model.lanes.len()).any(waiting) && clock.now() < end && !stop.load(Ordering::Relaxed) {
        clock.sleep_until(clock.now().saturating_add(200_000));
    }
}

/// Waits until each driver has read its inputs once or knows that it cannot, but not for ever.
fn wait_for_readings(plant: &Plant, clock: &dyn Clock, stop: &AtomicBool) {
    let waiting = |driver: usize| {
        let config = &plant.model.drivers[driver];
        let inputs = plant.model.region_inputs(driver).count() as u32;
        let region = &plant.regions[plant.layout.driver_region(driver) as usize];
        let good = |n: u32| Quality::from_cell(region.cell(2 * n + 1)) == Quality::Good;
        // The first publication says that nothing has been read yet, the second how the first reading went.
        !config.simulated(plant.model.sim) && region.publications() < 2 && !(0..inputs).any(good) && inputs > 0
    };
    let end = clock.now().saturating_add(FIRST_READING);
    while (0..plant.model.drivers.len()).any(waiting) && clock.now() < end && !stop.load(Ordering::Relaxed) {
        clock.sleep_until(clock.now().saturating_add(1_000_000));
    }
}

fn start_drivers(drivers: Vec<DriverParts>, clock: &Arc<dyn Clock>) -> IoThread {
    let made = drivers.into_iter().map(|d| {
        let clock = Arc::clone(clock);
        let at = Arc::clone(&clock);
        let report = reporter(d.recorder, d.sources, d.name.clone(), at);
        move |stop| {
            let now: Arc<dyn Fn() -> u64 + Send + Sync> = Arc::new(move || clock.now());
            (d.driver, DriverContext { inputs: d.region, outputs: d.outputs, clock: now, report, stop })
        }
    });
    IoThread::start(made.collect())
}

/// Turns a driver's events into records.
fn reporter(
    mut recorder: Recorder,
    sources: HashMap<String, SourceId>,
    name: String,
    clock: Arc<dyn Clock>,
) -> Box<dyn FnMut(IoEvent) + Send> {
    Box::new(move |event: IoEvent| {
        let source = sources.get(&event.source).or_else(|| sources.get(&name));
        if let Some(source) = source {
            let entry = Entry::new(clock.now(), Kind::Io, *source, event.transition).priority(event.priority);
            recorder.push(entry.text(format_args!("{}", event.text)));
        }
    })
}
