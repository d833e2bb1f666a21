//! Cyclic interrupts: the inputs are read at a period, and the lane executes when one has changed.

use super::*;

fn polling(trip: &str, rest: &str) -> Rig {
    plant("", &format!("poll = \"1ms\"\n{trip}"), rest)
}

#[test]
fn it_executes_only_when_an_input_has_changed() {
    let ran = polling("", "")
        .stimulus("4500us,gpio.door,true\n4700us,gpio.beam,true\n20ms,gpio.door,false\n")
        .run_for(100 * MS);
    assert_eq!(ran.at("fast.outputs.runs", 100 * MS), "3", "at the start and for two readings");
    // Both changes are seen by the reading at 5 ms; their time is its.
    let expected = [(5 * MS, "gpio.door", true), (5 * MS, "gpio.beam", true), (20 * MS, "gpio.door", false)];
    assert_eq!(edges(&ran), expected);
}

#[test]
fn a_change_shorter_than_the_period_is_not_seen() {
    let ran = polling("", "").stimulus("4100us,gpio.door,true\n4900us,gpio.door,false\n").run_for(50 * MS);
    assert_eq!(edges(&ran), []);
}

#[test]
fn it_also_runs_with_a_cyclic_lane_and_the_change_is_recorded_once() {
    let ran = polling("also-with = \"main\"", "").stimulus("4500us,gpio.door,true\n").run_for(100 * MS);
    assert_eq!(edges(&ran), [(5 * MS, "gpio.door", true)]);
    assert_eq!(ran.at("fast.outputs.runs", 100 * MS), "12", "the start, 10 scans of main, one change");
}

#[test]
fn a_change_that_only_an_execution_with_the_other_lane_sees_is_recorded_too() {
    // Between the polls at 10 and 11 ms the scan of `main` ends, at 10.2 ms; the door is open from 10.1 to 10.3 ms.
    let ran = polling("also-with = \"main\"", "[sim]\nscan-time.main = \"200us\"")
        .stimulus("10100us,gpio.door,true\n10300us,gpio.door,false\n")
        .run_for(50 * MS);
    assert_eq!(edges(&ran), [(10_200_000, "gpio.door", true), (11 * MS, "gpio.door", false)]);
    assert_eq!(ran.history("fast.outputs.trip"), [(0, "false"), (10_200_000, "true")]);
}

#[test]
fn executions_with_the_other_lane_leave_no_poll_out() {
    // The execution with the scan of 10 ms lasts until 11 ms; the polls are those of 8, 12, 16 ms all the same.
    let text = "poll = \"4ms\"\nalso-with = \"main\"";
    let ran = plant("", text, "[sim]\nscan-time.trip = \"1ms\"").stimulus("10500us,gpio.door,true\n").run_for(50 * MS);
    assert_eq!(edges(&ran), [(12 * MS, "gpio.door", true)]);
}

#[test]
fn it_polls_values_of_any_type() {
    let text = "[lane.main]\nevery = \"10ms\"\n[lane.fast]\npoll = \"2ms\"\non = [\"field.level\"]\n\
        [driver.field]\nkind = \"sim\"\npoints.level = { type = \"u16\", initial = 3 }\n\
        [block.fast]\ncomponent = \"interlock-probe\"\nlane = \"fast\"\n\
        [block.slow]\ncomponent = \"interlock-probe\"\nlane = \"main\"\n";
    let ran = Rig::new(text).stimulus("3ms,field.level,7\n").run_for(50 * MS);
    let events: Vec<_> = ran.records.iter().filter(|r| r.source == "field.level").collect();
    assert_eq!(events.len(), 1);
    let told = (events[0].time, &*events[0].transition, events[0].previous.to_string(), events[0].current.to_string());
    assert_eq!(told, (4 * MS, "changed", "3".into(), "7".into()));
}
