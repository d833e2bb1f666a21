//! Start, stop, faults and budgets of interrupt lanes: as those of cyclic ones, but at once.

use super::*;
use latchwork_plant::lane::{BlockState, LaneState};

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
    assert_eq!((fault.time, fault.source.as_str(), fault.transition), (7 * MS, "fast", "trap"));
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
