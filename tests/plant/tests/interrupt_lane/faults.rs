//! Start, stop, faults and budgets of interrupt lanes: as those of cyclic ones, but at once.

use super::*;
use latchwork_plant::assemble::Time;
use latchwork_plant::lane::{BlockState, Change, LaneState};
use latchwork_plant::run::{Control, Observer, RunOptions, resolve_stimulus, run_virtual};

const SAFE: &str = "\n[block.fast.safe]\ntrip = true";

fn trapping(extra: &str) -> Rig {
    // The block traps at the first execution that sees `fire`.
    plant("", "", extra)
}

#[test]
fn a_fault_makes_the_outputs_safe_at_the_edge_that_caused_it() {
    let ran = trapping(SAFE).stimulus("5ms,gpio.fire,true\n7ms,gpio.beam,true\n8ms,gpio.fire,false\n").run_for(50 * MS);
    assert_eq!(ran.history("gpio.dump"), [(0, "false"), (7 * MS, "true")]);
    let fault = ran.records.iter().find(|r| r.kind == Kind::Fault).expect("a record of the fault");
    assert_eq!((fault.time, fault.source.as_str(), &*fault.transition), (7 * MS, "fast", "trap"));
    assert_eq!(edges(&ran), [(7 * MS, "gpio.beam", true)], "the edge is on record all the same");
    assert_eq!(ran.outcome.faulted[0].state, BlockState::Faulted);
}

#[test]
fn a_block_that_faulted_is_back_with_the_first_edge_after_its_time() {
    let ran = trapping("")
        .stimulus(
            "5ms,gpio.fire,true\n7ms,gpio.beam,true\n8ms,gpio.fire,false\n50ms,gpio.beam,false\n200ms,gpio.beam,true\n",
        )
        .run_for(300 * MS);
    assert_eq!(ran.told(Kind::Fault), ["7 ms fast trap", "200 ms fast restarted"]);
    assert_eq!(ran.at("fast.outputs.b", 300 * MS), "true");
}

#[test]
fn stop_lane_stops_this_lane_alone() {
    let ran = plant("", "", "").run_for(0);
    assert_eq!(ran.outcome.lanes[1].state, LaneState::Stopped);
    let text = "[block.brake]\ncomponent = \"interlock-probe\"\nlane = \"trip\"\non-fault = \"stop-lane\"\ninputs = { trap = \"gpio.vacuum\" }";
    let ran = plant("", "", text)
        .stimulus("5ms,gpio.beam,true\n9ms,gpio.vacuum,true\n11ms,gpio.door,true\n")
        .run_for(100 * MS);
    assert_eq!(ran.outcome.lanes[1].state, LaneState::Faulted);
    assert_eq!(ran.outcome.lanes[0].state, LaneState::Stopped, "the cyclic lane went on to the end");
    assert_eq!(edges(&ran).len(), 2, "nobody handles the edge at 11 ms");
    assert_eq!(ran.at("fast.outputs.b", 100 * MS), "false", "all outputs are safe");
}

/// The plant time at which each record was passed on, beside its own.
#[derive(Default)]
struct Passed {
    now: u64,
    records: Vec<(u64, Record)>,
}

impl Observer for Passed {
    fn record(&mut self, record: &Record, _: &[latchwork_record::Kept]) {
        self.records.push((self.now, record.clone()));
    }

    fn change(&mut self, _: &Change) {}

    fn tick(&mut self, now: u64) -> Control {
        self.now = now;
        Control::Continue
    }
}

#[test]
fn a_lane_that_has_faulted_holds_up_no_records_of_others() {
    let rig = plant("", "also-with = \"main\"\nwatchdog = \"2ms\"", "[sim]\nscan-time.trip = [\"0ms\", \"3ms\"]");
    let mut plant = rig.plant(Time::Virtual);
    let rows = b"time,tag,value\n500ms,gpio.level,true\n501ms,gpio.door,true\n";
    let rows = latchwork_io::stimulus::read(&rows[..]).unwrap();
    let stimulus = resolve_stimulus(&plant, &rows).unwrap();
    plant.router.set_epoch(0);
    let options = RunOptions { duration: Some(1000 * MS), stimulus, ..RunOptions::default() };
    let mut passed = Passed::default();
    let outcome = run_virtual(plant, &options, &Default::default(), &mut passed);
    assert_eq!(outcome.lanes[1].state, LaneState::Faulted);
    let of_main = passed.records.iter().find(|(_, r)| r.source == "slow.outputs.status").expect("an event");
    assert!(of_main.0 < 530 * MS, "it waited until {} ms", of_main.0 / MS);
}

#[test]
fn a_fault_that_changes_a_register_is_an_event_like_any_other() {
    let ran = trapping("").stimulus("5ms,gpio.beam,true\n6ms,gpio.fire,true\n7ms,gpio.beam,false\n").run_for(50 * MS);
    let register = ran.records.iter().filter(|r| r.source == "fast.outputs.status");
    let told: Vec<_> = register.map(|r| (r.time, r.previous.to_string(), r.current.to_string())).collect();
    assert_eq!(told, [(5 * MS, "0".into(), "2".into()), (7 * MS, "2".into(), "0".into())]);
}

#[test]
fn an_execution_beyond_the_watchdog_stops_the_lane() {
    let ran = plant("", "watchdog = \"2ms\"", "[sim]\nscan-time.trip = [\"0ms\", \"1ms\", \"3ms\"]")
        .stimulus("5ms,gpio.beam,true\n9ms,gpio.beam,false\n")
        .run_for(100 * MS);
    assert_eq!(ran.outcome.lanes[1].state, LaneState::Faulted);
    let told: Vec<_> = ran.told(Kind::Lane).into_iter().filter(|t| t.contains("lane.trip")).collect();
    assert_eq!(told, ["0 ms lane.trip started", "9 ms lane.trip faulted"]);
}

#[test]
fn its_figures_are_tags() {
    let ran = plant("", "", "[sim]\nscan-time.trip = \"5ms\"")
        .trace(Some("lane.trip.*"))
        .stimulus("1ms,gpio.door,true\n2ms,gpio.beam,true\n3ms,gpio.vacuum,true\n")
        .run_for(100 * MS);
    assert_eq!(ran.at("lane.trip.scans", 100 * MS), "4");
    assert_eq!(ran.at("lane.trip.scan-time-max", 100 * MS), "5ms");
    // The last edge waited for the three executions before it.
    assert_eq!(ran.at("lane.trip.jitter-max", 100 * MS), "12ms");
}

#[test]
fn an_execution_beyond_its_budget_is_a_fault_of_the_block_alone() {
    let text = "[block.looping]\ncomponent = \"stress\"\nlane = \"trip\"\nbudget = \"1ms\"\n\
                inputs = { fault = \"endless-loop\", from = 2 }";
    let ran = plant("", "", text).stimulus("5ms,gpio.beam,true\n9ms,gpio.beam,false\n").run_for(50 * MS);
    assert_eq!(ran.told(Kind::Fault), ["5 ms looping budget"]);
    assert_eq!(edges(&ran).len(), 2);
    assert_eq!(ran.at("fast.outputs.b", 50 * MS), "false", "the other block goes on with the next edge");
    assert_eq!(ran.outcome.lanes[1].state, LaneState::Stopped);
}
