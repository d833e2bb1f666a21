//! New versions in an interrupt lane that fail or take too long: the version before is back at the very edge, and none is lost.

use super::time::{output, serve};
use super::*;
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::LaneState;
use latchwork_plant::run::resolve_stimulus;
use latchwork_tests_plant::forge::Bad;
use std::cell::Cell;
use std::time::{Duration, Instant};

const PLANT: &str = "[lane.main]\nevery = \"10ms\"\n[lane.trip]\non = [\"gpio.door\"]\nwatchdog = \"50ms\"\n\
                     [driver.gpio]\nkind = \"sim\"\npoints.door = { type = \"bool\" }\n\
                     [block.count]\ncomponent = \"v1.wasm\"\nlane = \"trip\"\nbudget = \"5s\"\n\
                     [block.second]\ncomponent = \"v1.wasm\"\nlane = \"trip\"\nbudget = \"5s\"\n\
                     [block.other]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n";
/// Place of the lane.
const TRIP: usize = 1;

fn rig(version: &Counter) -> Rig {
    Rig::new(PLANT).with("v1", &Counter::new(1).component()).with("v2", &version.component())
}

#[test]
fn a_version_that_fails_at_an_edge_gives_way_at_that_edge_and_no_edge_is_lost() {
    for (bad, transition) in [(Bad::Trap(5), "trap"), (Bad::Loop(5), "budget"), (Bad::Grow(5), "memory")] {
        let edge = |n: u64| format!("{}ms,gpio.door,{}\n", 200 + 10 * n, n.is_multiple_of(2));
        let rows = format!("100ms,swap.count,v2.wasm\n{}", (0..20).map(edge).collect::<String>());
        let ran = rig(&Counter::new(2).bad(bad)).stimulus(&rows).run_for(S);
        let fault = format!("240 count {transition}");
        assert_eq!(told(&ran), ["100 count asked", "100 count exchanged", &fault, "240 count rolled-back"], "{bad:?}");
        let edges = ran.records.iter().filter(|r| r.source == "gpio.door" && r.kind == Kind::Event);
        let edges: Vec<_> = edges.map(|r| (r.time / MS, r.transition == "rising")).collect();
        assert_eq!(edges, (0..20u64).map(|n| (200 + 10 * n, n.is_multiple_of(2))).collect::<Vec<_>>(), "{bad:?}");
        // Four edges were the new version's; the one at which it failed and all after it are the old one's again.
        assert_eq!(ran.history("count.outputs.version"), [(0, "1"), (200 * MS, "2"), (240 * MS, "1")], "{bad:?}");
        let count = |ms: u64| ran.at("count.outputs.count", ms * MS);
        assert_eq!((count(230), count(240), count(390)), ("5", "2", "17"), "{bad:?}");
        assert_eq!(ran.at("second.outputs.count", S), "21", "{bad:?}: no execution was one too many for its neighbour");
        assert!(!ran.records.iter().any(|r| r.kind == Kind::Lost), "{bad:?}");
        assert_eq!(ran.outcome.lanes[TRIP].state, LaneState::Stopped, "{bad:?}: it went on to the end");
    }
}

#[test]
fn a_shadow_in_an_interrupt_lane_sees_the_very_edges_and_loses_none() {
    // Others show the count and the version that run.
    let same = Counter { default_step: 2, ..Counter::new(1) };
    let other = Counter { off: Some((5, 1)), ..Counter::new(1) };
    for (candidate, expected) in [(same, &["shadow", "exchanged", "kept"][..]), (other, &["shadow", "refused"])] {
        let edge = |n: u64| format!("{}ms,gpio.door,{}\n", 200 + 10 * n, n.is_multiple_of(2));
        let rows = format!("100ms,swap.count,v2.wasm shadow=10 probation=5\n{}", (0..40).map(edge).collect::<String>());
        let ran = rig(&candidate).stimulus(&rows).run_for(S);
        let told: Vec<_> = ran.records.iter().filter(|r| r.kind == Kind::Swap && r.source == "count").collect();
        let transitions: Vec<_> = told.iter().map(|r| &*r.transition).collect();
        assert_eq!(transitions, [&["asked"][..], expected].concat(), "{told:#?}");
        // Nothing is compared before an edge comes.
        assert!(told[2].time >= 200 * MS, "{told:#?}");
        // An execution at the start, then one for each edge.
        let counts: Vec<_> = ran.history("count.outputs.count").into_iter().map(|(time, n)| (time / MS, n)).collect();
        let edges = (0..40).map(|n| (200 + 10 * n, (n + 2).to_string()));
        let wanted: Vec<_> = [(0, "1".to_owned())].into_iter().chain(edges).collect();
        assert!(counts.iter().copied().eq(wanted.iter().map(|(time, n)| (*time, n.as_str()))), "{counts:?}");
    }
}

/// The lane alone, with its edges and its clock in the test's hand.
struct Bench {
    rig: Rig,
    plant: Plant,
    now: u64,
    records: Vec<String>,
}

impl Bench {
    fn new(version: &Counter) -> Self {
        let rig = rig(version).trace(None);
        let mut bench = Self { plant: rig.plant(Time::Real), rig, now: 0, records: Vec::new() };
        bench.plant.lanes[TRIP].begin_interrupts(0);
        bench.handle(0);
        bench
    }

    fn act(&mut self, row: &str) {
        let rows = latchwork_io::stimulus::read(format!("time,tag,value\n{row}\n").as_bytes()).expect("a row");
        let file = self.rig.path();
        let rows = resolve_stimulus(&self.plant, &rows).unwrap_or_else(|e| panic!("{}: {e:?}", file.display()));
        self.plant.stimulate(&rows[0].action, self.now);
    }

    /// An edge; the swapped block takes so long for it, ns.
    fn edge(&mut self, level: bool, took: u64) {
        self.act(&format!("0s,gpio.door,{level}"));
        assert_eq!(self.handle(took), 1);
    }

    /// Handles what waits; how many executions there were.
    fn handle(&mut self, took: u64) -> u64 {
        let lane = &mut self.plant.lanes[TRIP];
        let mut count = 0;
        lane.collect();
        while let Some(arrival) = lane.next_arrival(self.now) {
            let (begun, calls) = (self.now, Cell::new(0u64));
            // Looks at the clock come in pairs, about an execution that is timed.
            let clock = || begun + calls.replace(calls.get() + 1).div_ceil(2) * took;
            if lane.begin_activation(arrival, begun, &clock) {
                lane.end_activation(begun + took + 1_000);
            }
            self.now += took + 1_000;
            count += 1;
        }
        self.spare();
        count
    }

    /// The lane waits for an edge and takes requests meanwhile.
    fn spare(&mut self) {
        let now = self.now;
        self.plant.lanes[TRIP].spare(u64::MAX, || now);
        serve(&mut self.plant, self.now, &mut self.records);
    }

    fn until_told(&mut self, what: &str) {
        let end = Instant::now() + Duration::from_secs(120);
        while !self.records.iter().any(|r| r.starts_with(what)) {
            assert!(Instant::now() < end, "never {what}: {:#?}", self.records);
            self.spare();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn seen(&self) -> (u64, u64) {
        (output(&self.plant, 0, "version"), output(&self.plant, 0, "count"))
    }
}

#[test]
fn a_version_that_takes_too_long_for_an_edge_is_rolled_back_and_the_lane_goes_on() {
    let mut bench = Bench::new(&Counter::new(2));
    bench.edge(true, MS);
    assert_eq!(bench.seen(), (1, 2));
    bench.act("0s,swap.count,v2.wasm");
    bench.until_told("count exchanged");
    bench.edge(false, MS);
    assert_eq!(bench.seen(), (2, 3));
    // The watchdog allows 50 ms; without the new version it would be nothing.
    bench.edge(true, 60 * MS);
    bench.until_told("count rolled-back");
    assert!(bench.records.iter().any(|r| r.starts_with("count overrun on probation")), "{:#?}", bench.records);
    assert_eq!(bench.plant.lanes[TRIP].state(), LaneState::Running);
    bench.edge(false, MS);
    assert_eq!(bench.seen(), (1, 3), "the old one goes on from what it had");
    let edges: Vec<_> = bench.records.iter().filter(|r| r.starts_with("gpio.door ")).map(|r| r.trim_end()).collect();
    let (up, down) = ("gpio.door rising", "gpio.door falling");
    assert_eq!(edges, [up, down, up, down]);
    assert_eq!(output(&bench.plant, 1, "count"), 5, "one at the start, and one for each edge");
}

#[test]
fn an_edge_that_takes_too_long_for_another_reason_stops_the_lane_and_is_no_versions_fault() {
    let mut bench = Bench::new(&Counter::new(2));
    bench.act("0s,swap.count,v2.wasm");
    bench.until_told("count exchanged");
    bench.act("0s,gpio.door,true");
    let (now, lane) = (bench.now, &mut bench.plant.lanes[TRIP]);
    lane.collect();
    let arrival = lane.next_arrival(now).expect("an edge");
    assert!(lane.begin_activation(arrival, now, &|| now));
    assert_eq!(lane.end_activation(now + 60 * MS), LaneState::Faulted);
    bench.spare();
    assert!(!bench.records.iter().any(|r| r.starts_with("count rolled-back")), "{:#?}", bench.records);
}
