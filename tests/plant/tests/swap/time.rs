//! Time that a new version takes: a lane driven by a clock in the test's hand.

use super::*;
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::LaneState;
use latchwork_plant::model::TagRef;
use latchwork_plant::operate::Operation;
use latchwork_plant::run::resolve_stimulus;
use latchwork_record::Turn;
use std::cell::Cell;
use std::time::{Duration, Instant};

/// A plant whose scans take what the test says.
struct Bench {
    plant: Plant,
    now: u64,
    records: Vec<String>,
}

impl Bench {
    /// A counter in a lane of 10 ms with a watchdog of 50 ms, and an order for its next version.
    fn new() -> Self {
        let rig = Rig::new(
            "[lane.main]\nevery = \"10ms\"\nwatchdog = \"50ms\"\n[block.count]\ncomponent = \"v1.wasm\"\n\
             lane = \"main\"\nbudget = \"5s\"\n",
        );
        let rig = rig.with("v1", &Counter::new(1).component()).with("v2", &Counter::new(2).component());
        let mut plant = rig.trace(None).plant(Time::Real);
        let rows = latchwork_io::stimulus::read(&b"time,tag,value\n0s,swap.count,v2.wasm\n"[..]).expect("a row");
        let rows = resolve_stimulus(&plant, &rows).expect("a row that fits");
        assert!(matches!(&rows[0].action, latchwork_plant::sim::Action::Operate(Operation::Swap(_))));
        plant.stimulate(&rows[0].action, 0);
        let mut bench = Self { plant, now: 0, records: Vec::new() };
        // It is prepared on a thread of its own.
        let end = Instant::now() + Duration::from_secs(120);
        while bench.version() != 2 {
            assert!(Instant::now() < end, "never exchanged: {:#?}", bench.records);
            bench.scan(1_000, 2_000);
            std::thread::sleep(Duration::from_millis(1));
        }
        bench
    }

    /// A scan in which the block takes so long, ns, where it is timed; the whole takes as long as told.
    fn scan(&mut self, block: u64, whole: u64) -> LaneState {
        let (begun, calls) = (self.now, Cell::new(0u64));
        // The last look at the clock is the scan's end. Those before come in pairs.
        let clock = || {
            let call = calls.replace(calls.get() + 1);
            begun + (call + 1) / 2 * block
        };
        let running = self.plant.lanes[0].begin_scan(begun, begun, &clock);
        let state = if running { self.plant.lanes[0].end_scan(begun + whole) } else { self.plant.lanes[0].state() };
        self.now += (10 * MS).max(whole);
        self.plant.serve(self.now);
        self.plant.supervisor.pump();
        self.plant.router.collect();
        while let Some(turn) = self.plant.router.next(u64::MAX) {
            let draft = match turn {
                Turn::Entry(entry) => self.plant.router.draft(&entry),
                Turn::Inserted(_, latchwork_plant::operate::Wish::Record(draft, _)) => *draft,
                Turn::Inserted(..) => continue,
            };
            self.records.push(format!("{} {} {}", draft.source, draft.transition, draft.text));
        }
        state
    }

    fn version(&self) -> u64 {
        let port = self.plant.model.blocks[0].class.outputs.iter().position(|p| p.path == "version").expect("a port");
        let mut view = self.plant.view(&[self.plant.layout.ids[&TagRef::Output { block: 0, port }]]);
        view.refresh();
        view.cell(0)
    }

    fn told(&self, transition: &str) -> &str {
        let of = |r: &&String| r.split(' ').nth(1) == Some(transition);
        self.records.iter().find(of).unwrap_or_else(|| panic!("no {transition}: {:#?}", self.records))
    }
}

#[test]
fn a_version_that_makes_the_scan_too_long_is_rolled_back() {
    let mut bench = Bench::new();
    // The old one took 1 us.
    bench.scan(12 * MS, 13 * MS);
    assert!(bench.told("overrun").starts_with("count overrun on probation"), "{:#?}", bench.records);
    let told = bench.told("rolled-back");
    assert!(told.contains("the scan took 13000 us, 10000 us are allowed; the new version took 12000 us of them, the one before at most 1 us"), "{told}");
    bench.scan(1_000, 2_000);
    assert_eq!(bench.version(), 1);
}

#[test]
fn a_scan_that_is_too_long_for_another_reason_is_not_its_fault() {
    let mut bench = Bench::new();
    // Without its 3 ms the scan would still be too long.
    bench.scan(3 * MS, 15 * MS);
    bench.scan(1_000, 2_000);
    assert_eq!(bench.version(), 2);
    assert!(!bench.records.iter().any(|r| r.contains("rolled-back")), "{:#?}", bench.records);
}

#[test]
fn a_version_that_would_wake_the_watchdog_is_rolled_back_and_the_lane_goes_on() {
    let mut bench = Bench::new();
    assert_eq!(bench.scan(60 * MS, 61 * MS), LaneState::Running);
    bench.told("rolled-back");
    bench.scan(1_000, 2_000);
    assert_eq!(bench.version(), 1);
}

#[test]
fn the_watchdog_still_stops_a_lane_that_is_too_long_for_another_reason() {
    let mut bench = Bench::new();
    assert_eq!(bench.scan(MS, 80 * MS), LaneState::Faulted);
}

#[test]
fn the_time_of_the_exchange_is_told() {
    let bench = Bench::new();
    // The clock moved by 1 us between its beginning and its end.
    assert!(bench.told("exchanged").contains("exchanged in 1 us"), "{:#?}", bench.records);
}
