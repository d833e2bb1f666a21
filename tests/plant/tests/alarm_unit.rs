//! The alarm unit of the source document, as a component in a plant: one test per row of what it must do.
//!
//! The logic has its own tables in `components/logic`; here it is the shipped component that must show them, scan by scan.

use latchwork_record::Kind;
use latchwork_tests_plant::{Ran, Rig};

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;

/// One unit on `sim` points; rows of the stimulus.
fn run(rows: &str) -> Ran {
    let plant = r#"
        [lane.main]
        every = "10ms"
        [driver.field]
        kind = "sim"
        [driver.field.points]
        level = { type = "u16" }
        door = { type = "bool" }
        test = { type = "bool" }
        [block.unit]
        component = "alarm-unit"
        lane = "main"
        inputs.level = "field.level"
        inputs.door = "field.door"
        inputs.test = "field.test"
    "#;
    Rig::new(plant).stimulus(rows).run_for(20 * S)
}

/// The word of a level of 0 to 60.
fn word(level: f64) -> u16 {
    (level / 60.0 * 32_767.0).round() as u16
}

/// Rows that move the level from one value to another by 2 per 10 ms, from `start` ms on; the time of the last row, ms.
fn ramp(rows: &mut String, start: u64, from: f64, to: f64) -> u64 {
    let steps = ((to - from).abs() / 2.0).ceil() as u64;
    for n in 1..=steps {
        let level = from + (to - from) * n as f64 / steps as f64;
        rows.push_str(&format!("{}ms,field.level,{}\n", start + 10 * n, word(level)));
    }
    start + 10 * steps
}

fn value(ran: &Ran, time: u64) -> f64 {
    ran.at("unit.outputs.value", time).parse().expect("a number")
}

#[test]
fn row_scale_the_word_0_to_32767_is_0_to_60() {
    let mut rows = format!("0s,field.level,{}\n", word(30.0));
    let low = ramp(&mut rows, 1_000, 30.0, 0.0);
    let high = ramp(&mut rows, 2_000, 0.0, 60.0);
    let ran = run(&rows);
    assert!((value(&ran, 500 * MS) - 30.0).abs() < 0.001);
    assert_eq!(value(&ran, low * MS + 500 * MS), 0.0);
    assert_eq!(value(&ran, high * MS + 500 * MS), 60.0);
}

#[test]
fn row_violation_a_level_out_of_bounds_sets_the_flag_and_the_acknowledgement_resets_it() {
    let mut rows = format!("0s,field.level,{}\n", word(30.0));
    ramp(&mut rows, 1_000, 30.0, 55.0);
    rows.push_str("5s,unit.commands.acknowledge,true\n");
    let ran = run(&rows);
    assert_eq!(ran.at("unit.outputs.violation", S), "false");
    assert_eq!(ran.at("unit.outputs.high", 2 * S), "true");
    assert_eq!(ran.at("unit.outputs.violation", 2 * S), "true");
    assert_eq!(ran.at("unit.outputs.violation", 4_990 * MS), "true");
    assert_eq!(ran.at("unit.outputs.violation", 5 * S), "false");
    assert_eq!(ran.at("unit.outputs.horn", 5 * S), "false");
    // The level is still high; the flag stays down until the next violation.
    assert_eq!(ran.at("unit.outputs.high", 19 * S), "true");
    assert_eq!(ran.at("unit.outputs.violation", 19 * S), "false");
    let alarms = ran.told(Kind::Alarm);
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    assert!(alarms[0].contains("unit.alarms.high"), "{alarms:?}");
}

#[test]
fn row_lamp_blinks_while_the_flag_is_set() {
    let ran = run("0s,field.level,16384\n1s,field.door,true\n");
    let lamp: Vec<_> = ran.history("unit.outputs.lamp").into_iter().filter(|(t, _)| *t >= S).take(5).collect();
    // The door is believed after 100 ms; then 500 ms on, 500 ms off.
    let first = lamp[0].0;
    assert!((1_100 * MS..=1_110 * MS).contains(&first), "{lamp:?}");
    let expected = [(0, "true"), (500, "false"), (1_000, "true"), (1_500, "false"), (2_000, "true")];
    assert_eq!(lamp, expected.map(|(ms, v)| (first + ms * MS, v)));
}

#[test]
fn row_digital_a_bounce_shorter_than_the_veracity_time_is_ignored() {
    let ran = run(
        "0s,field.level,16384\n1s,field.door,true\n1.05s,field.door,false\n1.1s,field.door,true\n1.18s,field.door,false\n",
    );
    assert_eq!(ran.history("unit.outputs.door"), [(0, "false")]);
    assert_eq!(ran.history("unit.outputs.violation"), [(0, "false")]);
}

#[test]
fn row_hardware_fault_a_spike_never_raises_a_process_alarm_but_its_own() {
    let ran = run("0s,field.level,16384\n1s,field.level,32767\n1.2s,field.level,16384\n3s,field.level,0\n");
    for tag in ["unit.outputs.high", "unit.outputs.low", "unit.outputs.violation"] {
        assert_eq!(ran.history(tag), [(0, "false")], "{tag}");
    }
    assert_eq!(ran.at("unit.outputs.hardware-fault", 1_100 * MS), "true");
    assert_eq!(ran.at("unit.outputs.hardware-fault", 1_300 * MS), "false");
    assert_eq!(ran.at("unit.outputs.hardware-fault", 4 * S), "true", "a line break");
    assert!((value(&ran, 4 * S) - 30.0).abs() < 0.01, "the last accepted value is held");
    let alarms = ran.told(Kind::Alarm);
    assert!(alarms.iter().all(|a| a.contains("hardware-fault")), "{alarms:?}");
    assert_eq!(alarms.len(), 3, "{alarms:?}");
}

#[test]
fn row_test_lamp_and_horn_are_on_and_nothing_else_changes() {
    let ran = run("0s,field.level,16384\n1s,field.test,true\n2s,field.test,false\n");
    assert_eq!(ran.history("unit.outputs.lamp"), [(0, "false"), (S, "true"), (2 * S, "false")]);
    assert_eq!(ran.history("unit.outputs.horn"), [(0, "false"), (S, "true"), (2 * S, "false")]);
    assert_eq!(ran.history("unit.outputs.violation"), [(0, "false")]);
    assert_eq!(ran.told(Kind::Alarm), Vec::<String>::new());
}
