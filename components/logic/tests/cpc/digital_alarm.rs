//! DigitalAlarm: condition, delay, disable, block, acknowledge, interlock.

use crate::{MS, Row, expect, from_words, to_words};
use latchwork_logic::{
    Quality,
    cpc::{AlarmCommands, DigitalAlarm, DigitalAlarmInputs, DigitalAlarmSettings},
};

#[derive(Default)]
struct Words {
    input: bool,
    bad: bool,
    rest: DigitalAlarmInputs,
}

fn run(settings: DigitalAlarmSettings, rows: &[Row<'_>]) {
    let mut alarm = DigitalAlarm::default();
    for &(rule, ms, inputs, commands, expected) in rows {
        let words = from_words!(inputs, Words::default();
            "input" => input, "bad" => bad, "disable" => rest.disable, "auto" => rest.auto_acknowledge,
            "simulated" => rest.simulated);
        let mut inputs = words.rest;
        inputs.input.value = words.input;
        inputs.input.quality = if words.bad { Quality::Bad } else { Quality::Good };
        let commands = from_words!(commands, AlarmCommands::default();
            "acknowledge" => acknowledge, "block" => block, "unblock" => unblock);
        let out = alarm.execute(&settings, ms * MS, inputs, commands);
        assert_eq!(out.interlock, out.status.interlock, "{rule}: the interlock is in the register");
        let got = to_words!(out.status;
            input pending active interlock unacknowledged blocked enabled io_error simulated);
        expect(rule, expected, &got);
    }
}

#[test]
fn without_a_delay() {
    run(DigitalAlarmSettings::default(), &[
        ("at rest", 0, "", "", "!active !interlock !unacknowledged enabled !pending"),
        ("a condition is an alarm at once", 10, "input", "", "input active interlock unacknowledged !pending"),
        ("the alarm ends with its condition, the acknowledgement is still due", 10, "", "", "!interlock unacknowledged"),
        ("acknowledged", 10, "", "acknowledge", "!unacknowledged"),
        ("an acknowledgement hides no new occurrence", 10, "input", "acknowledge", "interlock unacknowledged"),
        ("acknowledged while it stands, it still stands", 10, "input", "acknowledge", "interlock !unacknowledged"),
        ("and needs none again", 10, "input", "", "interlock !unacknowledged"),
        ("simulated is shown", 10, "simulated", "", "simulated !active"),
        ("auto: an occurrence needs no acknowledgement", 10, "input auto", "", "interlock !unacknowledged"),
    ]);
}

#[test]
fn delay_and_disable() {
    run(DigitalAlarmSettings { delay: 50 * MS, ..DigitalAlarmSettings::default() }, &[
        ("the delay begins", 10, "input", "", "pending !active !interlock !unacknowledged"),
        ("shorter than the delay is nothing", 49, "input", "", "pending !active"),
        ("shorter than the delay is nothing", 1, "", "", "!pending !active !unacknowledged"),
        ("and the next begins anew", 10, "input", "", "pending"),
        ("and the next begins anew", 49, "input", "", "pending !active"),
        ("after the delay it is an alarm", 1, "input", "", "!pending active interlock unacknowledged"),
        ("disabled, it ends at once", 1, "input disable", "acknowledge", "input !active !interlock !enabled !pending"),
        ("enabled again, the whole delay is due", 60, "input", "", "pending !active"),
        ("disabled during the delay, it does not come through", 49, "input disable", "", "!pending !active"),
        ("disabled during the delay, it does not come through", 1, "input", "", "pending !active"),
        ("disabled during the delay, it does not come through", 49, "input", "", "pending !active !unacknowledged"),
        ("enabled for the whole delay, it does", 1, "input", "", "active interlock unacknowledged"),
    ]);
}

#[test]
fn block() {
    run(DigitalAlarmSettings::default(), &[
        ("blocked before it comes, it does nothing", 0, "", "block", "blocked"),
        ("blocked before it comes, it does nothing", 9, "input", "", "active !interlock !unacknowledged"),
        ("unblocked while it stands, it comes now", 9, "input", "unblock", "!blocked interlock unacknowledged"),
        ("blocked while it stands, the interlock ends", 9, "input", "block acknowledge", "active !interlock !unacknowledged"),
        ("unblock wins over block", 9, "input", "block unblock", "!blocked interlock unacknowledged"),
        ("blocked does not acknowledge", 9, "input", "block", "!interlock unacknowledged blocked"),
        ("an acknowledgement with unblock hides nothing", 9, "input", "unblock acknowledge", "interlock unacknowledged"),
    ]);
}

#[test]
fn io_error() {
    run(DigitalAlarmSettings::default(), &[
        ("a condition that cannot be read counts as true", 0, "bad", "", "io_error !input active interlock unacknowledged"),
        ("and ends when it can", 10, "", "", "!io_error !active"),
        ("disabled, it counts for nothing, and is shown", 10, "bad disable", "", "io_error !active"),
    ]);
    run(DigitalAlarmSettings { alarm_on_io_error: false, ..DigitalAlarmSettings::default() }, &[
        ("if so set it is only shown", 0, "bad", "", "io_error !active"),
        ("if so set its last value counts", 10, "bad input", "", "io_error active interlock"),
    ]);
}
