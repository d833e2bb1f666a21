//! `edge`, `initial` and `[sim.feed]` of inputs that start a lane.

use super::*;

fn one(point: &str, rest: &str) -> Rig {
    Rig::new(&format!(
        "[lane.main]\nevery = \"10ms\"\n[lane.trip]\non = [\"gpio.door\"]\nalso-with = \"main\"\n\
         [driver.gpio]\nkind = \"sim\"\npoints.door = {{ type = \"bool\", {point} }}\npoints.x = {{ type = \"bool\" }}\n\
         [block.fast]\ncomponent = \"interlock-probe\"\nlane = \"trip\"\ninputs = {{ b = \"gpio.door\", q = \"gpio.door\" }}\n\
         [block.slow]\ncomponent = \"interlock-probe\"\nlane = \"main\"\ninputs.b = \"gpio.x\"\n{rest}"
    ))
}

#[test]
fn only_the_wanted_edge_starts_the_lane_and_the_level_is_right_all_the_same() {
    let ran = one("edge = \"rising\"", "")
        .stimulus("12ms,gpio.door,true\n14ms,gpio.door,false\n16ms,gpio.door,true\n18ms,gpio.door,false\n")
        .run_for(50 * MS);
    assert_eq!(edges(&ran), [(12 * MS, "gpio.door", true), (16 * MS, "gpio.door", true)]);
    assert_eq!(ran.history("fast.outputs.b"), [(0, "false"), (12 * MS, "true"), (20 * MS, "false")]);
}

#[test]
fn other_lanes_see_a_level_that_starts_nothing_without_an_execution() {
    let text = "[lane.main]\nevery = \"10ms\"\n[lane.trip]\non = [\"gpio.door\"]\n\
         [driver.gpio]\nkind = \"sim\"\npoints.door = { type = \"bool\", edge = \"rising\" }\n\
         [block.fast]\ncomponent = \"interlock-probe\"\nlane = \"trip\"\ninputs.b = \"gpio.door\"\n\
         [block.slow]\ncomponent = \"interlock-probe\"\nlane = \"main\"\ninputs = { b = \"gpio.door\", q = \"gpio.door\" }\n\
         [sim]\nscan-time.trip = \"3ms\"\n";
    let ran = Rig::new(text)
        .stimulus("12ms,gpio.door,true\n24ms,gpio.door,false\n45ms,gpio.door,true\n46ms,gpio.door,false\n")
        .run_for(80 * MS);
    // Nothing executes at 24 and 46 ms; the second falling edge comes while the lane is busy with the rising one.
    assert_eq!(ran.history("slow.outputs.b"), [(0, "false"), (20 * MS, "true"), (30 * MS, "false")]);
    assert_eq!(ran.at("fast.outputs.runs", 80 * MS), "3");
    assert_eq!(edges(&ran), [(12 * MS, "gpio.door", true), (45 * MS, "gpio.door", true)]);
}

#[test]
fn the_first_execution_sees_the_level_there_is() {
    let ran = one("initial = true", "").run_for(20 * MS);
    assert_eq!(ran.at("fast.outputs.b", 0), "true");
    assert_eq!(ran.at("fast.outputs.good", 0), "true");
    assert_eq!(edges(&ran), [], "a level is no edge");
}

#[test]
fn a_model_feeds_an_input_and_makes_edges() {
    let ran = one("edge = \"both\"", "[sim.feed]\n\"gpio.door\" = \"slow.outputs.b\"\n[sim]\nscan-time.main = \"3ms\"")
        .sim()
        .stimulus("5ms,gpio.x,true\n25ms,gpio.x,false\n")
        .run_for(60 * MS);
    // The scans from 10 and 30 ms on make them, at their ends.
    assert_eq!(edges(&ran), [(13 * MS, "gpio.door", true), (33 * MS, "gpio.door", false)]);
}

#[test]
fn an_edge_that_waits_does_not_bring_back_a_level_that_is_over() {
    // The edge at 3 ms waits for the end of the execution with the scan that ended at 2 ms; the level falls meanwhile.
    let ran = one("edge = \"rising\"", "[sim]\nscan-time.trip = \"5ms\"")
        .stimulus("1ms,gpio.door,true\n2ms,gpio.door,false\n3ms,gpio.door,true\n4ms,gpio.door,false\n")
        .run_for(60 * MS);
    assert_eq!(edges(&ran), [(MS, "gpio.door", true), (3 * MS, "gpio.door", true)]);
    assert_eq!(ran.at("fast.outputs.b", 60 * MS), "false");
}
