//! Time that a new version takes: a lane driven by a clock in the test's hand.

use super::*;
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::LaneState;
use latchwork_plant::model::TagRef;
use latchwork_plant::operate::Operation;
use latchwork_plant::run::resolve_stimulus;
use latchwork_record::Turn;
use latchwork_tests_plant::forge::Bad;
use std::cell::Cell;
use std::time::{Duration, Instant};

/// A plant whose scans take what the test says.
struct Bench {
    /// Where the components of orders are.
    rig: Rig,
    plant: Plant,
    now: u64,
    records: Vec<String>,
}

impl Bench {
    /// A counter in a lane of 10 ms with a watchdog of 50 ms, which has just got its next version.
    fn new() -> Self {
        Self::swapped(&Counter::new(2), "")
    }

    /// The same with this version, and further blocks.
    fn swapped(version: &Counter, more: &str) -> Self {
        let mut bench = Self::with(version, more);
        bench.order("0s,swap.count,v2.wasm\n");
        bench.until(|b| b.version(0) == 2, |b| b.scan(1_000, 2_000));
        bench
    }

    /// Before any order.
    fn with(version: &Counter, more: &str) -> Self {
        let rig = Rig::new(&format!(
            "[lane.main]\nevery = \"10ms\"\nwatchdog = \"50ms\"\n[block.count]\ncomponent = \"v1.wasm\"\n\
             lane = \"main\"\nbudget = \"5s\"\n{more}"
        ));
        let rig = rig.with("v1", &Counter::new(1).component()).with("v2", &version.component());
        Self::of(rig)
    }

    fn of(rig: Rig) -> Self {
        let rig = rig.trace(None);
        Self { plant: rig.plant(Time::Real), rig, now: 0, records: Vec::new() }
    }

    fn order(&mut self, row: &str) {
        let rows = latchwork_io::stimulus::read(format!("time,tag,value\n{row}").as_bytes()).expect("a row");
        let file = self.rig.path();
        let rows = resolve_stimulus(&self.plant, &rows).unwrap_or_else(|e| panic!("{}: {e:?}", file.display()));
        assert!(matches!(&rows[0].action, latchwork_plant::sim::Action::Operate(Operation::Swap(_))));
        self.plant.stimulate(&rows[0].action, self.now);
    }

    /// Goes on until something is so: a swap is prepared on a thread of its own.
    fn until(&mut self, so: impl Fn(&Self) -> bool, mut step: impl FnMut(&mut Self) -> LaneState) {
        let end = Instant::now() + Duration::from_secs(120);
        while !so(self) {
            assert!(Instant::now() < end, "never: {:#?}", self.records);
            assert_ne!(step(self), LaneState::Faulted, "{:#?}", self.records);
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// A scan in which the block takes so long, ns, where it is timed; the whole takes as long as told.
    fn scan(&mut self, block: u64, whole: u64) -> LaneState {
        self.scan_of(block, Some(whole))
    }

    /// The same; without a length of the whole it takes as long as its parts.
    fn scan_of(&mut self, block: u64, whole: Option<u64>) -> LaneState {
        let (begun, calls) = (self.now, Cell::new(0u64));
        // The last look at the clock is the scan's end. Those before come in pairs.
        let clock = || {
            let call = calls.replace(calls.get() + 1);
            begun + call.div_ceil(2) * block
        };
        let running = self.plant.lanes[0].begin_scan(begun, begun, &clock);
        let whole = whole.unwrap_or_else(|| calls.get().div_ceil(2) * block);
        let state = if running { self.plant.lanes[0].end_scan(begun + whole) } else { self.plant.lanes[0].state() };
        self.now += (10 * MS).max(whole);
        self.serve();
        state
    }

    fn serve(&mut self) {
        serve(&mut self.plant, self.now, &mut self.records);
    }

    fn version(&self, block: usize) -> u64 {
        output(&self.plant, block, "version")
    }

    fn told(&self, transition: &str) -> &str {
        let of = |r: &&String| r.split(' ').nth(1) == Some(transition);
        self.records.iter().find(of).unwrap_or_else(|| panic!("no {transition}: {:#?}", self.records))
    }
}

/// What a plant does beside its lanes; its records as `source transition text`.
pub(super) fn serve(plant: &mut Plant, now: u64, records: &mut Vec<String>) {
    plant.serve(now);
    plant.supervisor.pump();
    plant.router.collect();
    while let Some(turn) = plant.router.next(u64::MAX) {
        let draft = match turn {
            Turn::Entry(entry) => plant.router.draft(&entry),
            Turn::Inserted(_, latchwork_plant::operate::Wish::Record(draft, _)) => *draft,
            Turn::Inserted(..) => continue,
        };
        records.push(format!("{} {} {}", draft.source, draft.transition, draft.text));
    }
}

/// An output of a block as everybody sees it.
pub(super) fn output(plant: &Plant, block: usize, name: &str) -> u64 {
    let port = plant.model.blocks[block].class.outputs.iter().position(|p| p.path == name).expect("a port");
    let mut view = plant.view(&[plant.layout.ids[&TagRef::Output { block, port }]]);
    view.refresh();
    view.cell(0)
}

#[test]
fn an_order_that_is_being_prepared_is_over_at_once_when_it_is_called_off() {
    let mut bench = Bench::with(&Counter::new(2), "");
    bench.scan(1_000, 2_000);
    // Nobody has asked the workers yet how far they are: they may be done, or not have begun.
    for number in 1..=3 {
        bench.order("0s,swap.count,v2.wasm\n");
        let cancel = latchwork_plant::sim::Action::Operate(Operation::CancelSwap { number });
        bench.plant.stimulate(&cancel, bench.now);
    }
    bench.order("0s,swap.count,v2.wasm probation=0\n");
    bench.serve();
    let told: Vec<_> = bench.records.iter().filter_map(|r| r.strip_prefix("count ")?.split(' ').next()).collect();
    let called_off = ["asked", "cancelled"];
    assert_eq!(told[..7], [&called_off[..], &called_off, &called_off, &["asked"]].concat(), "{:#?}", bench.records);
    bench.until(|b| b.version(0) == 2, |b| b.scan(1_000, 2_000));
    // What was prepared for the others goes nowhere.
    for _ in 0..20 {
        bench.scan(1_000, 2_000);
    }
    let exchanged: Vec<_> = bench.records.iter().filter(|r| r.contains(" exchanged ")).collect();
    assert!(exchanged.len() == 1 && exchanged[0].contains("swap 4: "), "{exchanged:?}");
}

#[test]
fn a_version_that_makes_the_scan_too_long_is_rolled_back() {
    let mut bench = Bench::new();
    // The old one took 1 us.
    bench.scan(12 * MS, 13 * MS);
    let fault = "count overrun on probation; the version before is back";
    assert!(bench.records.iter().any(|r| r.starts_with(fault)), "{:#?}", bench.records);
    let told = bench.told("rolled-back");
    assert!(told.contains("the scan took 13000 us, 10000 us are allowed; the new version took 12000 us of them, the one before at most 1 us"), "{told}");
    bench.scan(1_000, 2_000);
    assert_eq!(bench.version(0), 1);
}

#[test]
fn a_scan_that_is_too_long_for_another_reason_is_not_its_fault() {
    let mut bench = Bench::new();
    // Without its 3 ms the scan would still be too long.
    bench.scan(3 * MS, 15 * MS);
    bench.scan(1_000, 2_000);
    assert_eq!(bench.version(0), 2);
    assert!(!bench.records.iter().any(|r| r.contains("rolled-back")), "{:#?}", bench.records);
}

thread_local! {
    /// What the lane's thread has worked, and what it works between two looks, ns.
    static WORK: Cell<(u64, u64)> = const { Cell::new((0, 0)) };
}

fn work() -> u64 {
    let (worked, more) = WORK.get();
    WORK.set((worked + more, more));
    worked
}

#[test]
fn a_machine_that_does_something_else_while_a_version_executes_is_not_its_fault() {
    let mut bench = Bench::new();
    bench.plant.lanes[0].time_work_by(work);
    // 12 ms by the clock, of which the thread has worked 1 us.
    WORK.set((0, 1_000));
    bench.scan(12 * MS, 13 * MS);
    bench.scan(1_000, 2_000);
    assert_eq!(bench.version(0), 2, "{:#?}", bench.records);
    WORK.set((0, 12 * MS));
    bench.scan(12 * MS, 13 * MS);
    let told = bench.told("rolled-back");
    assert!(told.contains("the new version took 12000 us of them"), "{told}");
    bench.scan(1_000, 2_000);
    assert_eq!(bench.version(0), 1);
}

#[test]
fn a_version_that_would_wake_the_watchdog_is_rolled_back_and_the_lane_goes_on() {
    let mut bench = Bench::new();
    assert_eq!(bench.scan(60 * MS, 61 * MS), LaneState::Running);
    bench.told("rolled-back");
    bench.scan(1_000, 2_000);
    assert_eq!(bench.version(0), 1);
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

#[test]
fn a_version_that_fails_after_a_long_time_does_not_stop_the_lane_after_it_is_gone() {
    let mut bench = Bench::swapped(&Counter::new(2).bad(Bad::Trap(2)), "");
    assert_eq!(bench.scan(60 * MS, 61 * MS), LaneState::Running, "{:#?}", bench.records);
    bench.told("rolled-back");
    assert_eq!(bench.version(0), 1);
    // What is still too long is for the watchdog.
    assert_eq!(bench.scan(60 * MS, 61 * MS), LaneState::Faulted);
}

#[test]
fn the_time_of_the_exchange_stops_no_lane_and_is_no_versions_fault() {
    let mut bench = Bench::with(&Counter::new(2), "");
    bench.order("0s,swap.count,v2.wasm\n");
    // An execution takes 40 ms, and so does the exchange: 80 ms in one scan, where the watchdog allows 50 ms.
    bench.until(|b| b.version(0) == 2, |b| b.scan_of(40 * MS, None));
    assert!(bench.told("exchanged").contains("exchanged in 40000 us"), "{:#?}", bench.records);
    assert!(!bench.records.iter().any(|r| r.contains("rolled-back")), "{:#?}", bench.records);
}

#[test]
fn two_new_versions_do_not_hide_behind_each_other() {
    let second = "[block.second]\ncomponent = \"v1.wasm\"\nlane = \"main\"\nbudget = \"5s\"\n";
    let mut bench = Bench::swapped(&Counter::new(2), second);
    bench.order("0s,swap.second,v2.wasm\n");
    bench.until(|b| b.version(1) == 2, |b| b.scan(1_000, 3_000));
    // With one of them it would still be 12 ms.
    bench.scan(9 * MS, 20 * MS + MS);
    bench.scan(1_000, 3_000);
    let mut versions = [bench.version(0), bench.version(1)];
    versions.sort_unstable();
    assert_eq!(versions, [1, 2], "{:#?}", bench.records);
    bench.scan(9 * MS, 12 * MS);
    bench.scan(1_000, 3_000);
    assert_eq!([bench.version(0), bench.version(1)], [1, 1], "{:#?}", bench.records);
}

#[test]
fn an_exchange_that_the_lane_has_not_done_can_be_called_off() {
    let mut bench = Bench::with(&Counter::new(2), "");
    bench.scan(1_000, 2_000);
    let room = bench.plant.supervisor.lanes[0].requests.slots();
    bench.order("0s,swap.count,v2.wasm\n");
    // It waits at the lane, which does not scan meanwhile.
    let waits = |b: &Bench| b.plant.supervisor.lanes[0].requests.slots() < room;
    bench.until(waits, |b| {
        b.serve();
        LaneState::Running
    });
    let cancel = latchwork_plant::sim::Action::Operate(Operation::CancelSwap { number: 1 });
    bench.plant.stimulate(&cancel, bench.now);
    for _ in 0..20 {
        bench.scan(1_000, 2_000);
    }
    bench.told("cancelled");
    assert_eq!(bench.version(0), 1);
    assert!(!bench.records.iter().any(|r| r.contains("exchanged")), "{:#?}", bench.records);
    // The block is free for the next order.
    bench.order("0s,swap.count,v2.wasm\n");
    bench.until(|b| b.version(0) == 2, |b| b.scan(1_000, 2_000));
}

#[test]
fn what_an_operator_does_meanwhile_is_looked_at_before_the_exchange() {
    let first = Counter { double: true, ..Counter::new(1) };
    let rig = Rig::new("[lane.main]\nevery = \"10ms\"\n[block.count]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n");
    let rig = rig.with("v1", &first.component()).with("v2", &Counter::new(2).component());
    let mut bench = Bench::of(rig);
    bench.scan(1_000, 2_000);
    bench.order("0s,swap.count,v2.wasm\n");
    // After the order, before it is prepared or sent: nothing of the lane has been served since.
    let force = Operation::Force { tag: "count.outputs.double".into(), value: "7".into() };
    bench.plant.stimulate(&latchwork_plant::sim::Action::Operate(force), bench.now);
    bench.until(|b| b.records.iter().any(|r| r.starts_with("count refused")), |b| b.scan(1_000, 2_000));
    assert!(bench.told("refused").contains("an operator forces `count.outputs.double`"), "{:#?}", bench.records);
    assert_eq!(bench.version(0), 1);
}
