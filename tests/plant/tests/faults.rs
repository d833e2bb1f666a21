//! Every way in which a block can misbehave, in a plant whose other blocks must not notice.

use latchwork_plant::lane::{BlockState, LaneState};
use latchwork_record::Kind;
use latchwork_tests_plant::{Ran, Rig};

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;

/// A stress block between two healthy ones; `how` are further keys of the stress block.
fn rig(how: &str) -> Rig {
    Rig::new(&format!(
        r#"
        [lane.main]
        every = "10ms"
        [driver.hall]
        kind = "sim"
        [driver.hall.points]
        start = {{ type = "bool" }}
        [block.before]
        component = "multivibrator"
        lane = "main"
        inputs.run = true
        settings.on-time = "10ms"
        settings.off-time = "10ms"
        [block.bad]
        component = "stress"
        lane = "main"
        {how}
        [block.after]
        component = "ctu"
        lane = "main"
        inputs.cu = "before.outputs.out"
        inputs.pv = 1000
        "#
    ))
}

/// The healthy blocks went on: the counter behind the stress block saw every pulse of the multivibrator before it.
fn undisturbed(ran: &Ran, case: &str) {
    let lane = &ran.outcome.lanes[0];
    assert_eq!(lane.statistics.scans, 1000, "{case}: scans");
    assert_eq!(lane.statistics.overruns, 0, "{case}: overruns");
    assert_eq!(lane.state, LaneState::Stopped, "{case}: state");
    let healthy = rig("").run_for(10 * S);
    assert_eq!(ran.history("after.outputs.cv"), healthy.history("after.outputs.cv"), "{case}: the block behind");
    assert_eq!(ran.history("before.outputs.out"), healthy.history("before.outputs.out"), "{case}: the block before");
}

/// By command: one fault, one record, safe outputs with bad quality, a restart after 100 ms.
#[test]
fn each_fault_is_contained_recorded_once_and_followed_by_a_restart() {
    for (command, transition) in [
        ("trap", "trap"),
        ("divide-by-zero", "trap"),
        ("endless-loop", "budget"),
        ("grow-memory", "memory"),
        ("recurse", "stack"),
        ("bad-enum", "result"),
    ] {
        let ran = rig("safe.value = -1.0").stimulus(&format!("1s,bad.commands.{command},true\n")).run_for(10 * S);
        undisturbed(&ran, command);
        let expected = [format!("1000 ms bad {transition}"), "1100 ms bad restarted".to_string()];
        assert_eq!(ran.told(Kind::Fault), expected, "{command}: {:#?}", ran.records);
        // One scan before, while it is out, after the restart.
        assert_eq!(ran.at("bad.outputs.alive", S - 10 * MS), "true", "{command}");
        assert_eq!(ran.at("bad.outputs.alive", S + 50 * MS), "false", "{command}: safe value");
        assert_eq!(ran.at("bad.outputs.value", S + 50 * MS), "-1.0", "{command}: safe value");
        assert_eq!(ran.at("bad.outputs.alive", S + 100 * MS), "true", "{command}: restarted");
        assert_eq!(ran.at("bad.outputs.executions", S + 100 * MS), "1", "{command}: a fresh instance");
        let [block] = &ran.outcome.faulted[..] else { panic!("{command}: {:?}", ran.outcome.faulted) };
        assert_eq!((block.name.as_str(), block.faults, block.state), ("bad", 1, BlockState::Running), "{command}");
        let text = &ran.records.iter().find(|r| r.kind == Kind::Fault).unwrap().text;
        assert!(text.contains("safe values") && text.contains("restart in 100 ms"), "{command}: {text}");
    }
}

#[test]
fn hold_keeps_the_last_values() {
    let ran = rig("on-fault = \"hold\"").stimulus("1s,bad.commands.trap,true\n").run_for(10 * S);
    undisturbed(&ran, "hold");
    assert_eq!(ran.at("bad.outputs.executions", S - 10 * MS), "100");
    assert_eq!(ran.at("bad.outputs.executions", S + 50 * MS), "100");
}

#[test]
fn stop_lane_stops_the_lane_with_everything_safe() {
    let ran = rig("on-fault = \"stop-lane\"").stimulus("1s,bad.commands.trap,true\n").run_for(10 * S);
    assert!(ran.outcome.faulted());
    assert_eq!(ran.outcome.lanes[0].state, LaneState::Faulted);
    assert_eq!(ran.outcome.lanes[0].statistics.scans, 101);
    assert_eq!(ran.told(Kind::Fault), ["1000 ms bad trap"]);
    assert_eq!(ran.told(Kind::Lane), ["0 ms lane.main started", "1000 ms lane.main faulted"]);
    assert_eq!(ran.at("bad.outputs.alive", S), "false");
}

#[test]
fn three_strikes_park_a_block() {
    // It traps in every first execution of a new instance.
    let ran = rig("inputs.fault = \"trap\"\ninputs.from = 1").run_for(10 * S);
    undisturbed(&ran, "three strikes");
    let expected =
        ["0 ms bad trap", "100 ms bad restarted", "100 ms bad trap", "1100 ms bad restarted", "1100 ms bad trap"];
    assert_eq!(ran.told(Kind::Fault), expected);
    assert_eq!(ran.outcome.faulted[0].state, BlockState::Parked);
    assert!(ran.records.iter().any(|r| r.text.contains("parked after 3 faults")));
    assert!(!ran.outcome.faulted());
}

#[test]
fn an_output_that_is_not_a_number_is_bad_while_it_lasts() {
    let ran = rig("").stimulus("1s,bad.commands.nan,true\n2s,bad.commands.nan,true\n").run_for(10 * S);
    undisturbed(&ran, "nan");
    let expected = ["1000 ms bad not-finite", "1010 ms bad finite", "2000 ms bad not-finite", "2010 ms bad finite"];
    assert_eq!(ran.told(Kind::Fault), expected);
    assert_eq!(ran.at("bad.outputs.value", S), "NaN");
}

#[test]
fn a_flood_of_messages_is_bounded_and_counted() {
    let ran = rig("").stimulus("1s,bad.commands.flood-log,true\n").run_for(10 * S);
    undisturbed(&ran, "flood");
    let messages: Vec<_> = ran.records.iter().filter(|r| r.kind == Kind::Message).collect();
    assert!((2..=40).contains(&messages.len()), "{} messages", messages.len());
    let last = &messages.last().unwrap().text;
    assert!(last.contains("4984 messages were not passed on"), "the number left out is told: {last}");
}

#[test]
fn settings_that_are_refused_stop_a_plant_before_it_starts() {
    for (setting, sentence) in [("refuse", "refuses its settings"), ("trap", "configure")] {
        let rig = rig(&format!("settings.{setting} = true"));
        let engine = latchwork_tests_plant::engine();
        let checked = latchwork_plant::check::check_file(&rig.path(), &engine, Default::default());
        let options =
            latchwork_plant::assemble::Options { time: latchwork_plant::assemble::Time::Virtual, trace: None };
        let model = checked.model.expect("a right plant file");
        let error = latchwork_plant::assemble::assemble(model, &engine, &options).err().expect("an error").to_string();
        assert!(error.starts_with("block `bad`:") && error.contains(sentence), "{error}");
    }
}
