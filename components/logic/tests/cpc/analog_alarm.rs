//! AnalogAlarm: four thresholds with hysteresis and delay; HH and LL interlock, H and L warn.

use crate::{MS, expect, from_words};
use latchwork_logic::{
    Quality, Signal,
    cpc::{AlarmCommands, AnalogAlarm, AnalogAlarmInputs, AnalogAlarmOutputs, AnalogAlarmSettings, Thresholds},
};

/// Rule, ms, value, other inputs, commands, what must come out.
type Row<'a> = (&'a str, u64, f64, &'a str, &'a str, &'a str);

fn words(out: &AnalogAlarmOutputs) -> Vec<(&'static str, bool)> {
    let AnalogAlarmOutputs { interlock, warning, alarms, status } = *out;
    assert_eq!((interlock, warning), (status.interlock, status.warning), "they are in the register");
    vec![
        ("hh", status.active.hh),
        ("h", status.active.h),
        ("l", status.active.l),
        ("ll", status.active.ll),
        ("alarm_hh", alarms.hh),
        ("alarm_h", alarms.h),
        ("alarm_l", alarms.l),
        ("alarm_ll", alarms.ll),
        ("hh_enabled", status.enabled.hh),
        ("l_enabled", status.enabled.l),
        ("interlock", interlock),
        ("warning", warning),
        ("pending", status.pending),
        ("unacknowledged", status.unacknowledged),
        ("blocked", status.blocked),
        ("io_error", status.io_error),
        ("simulated", status.simulated),
    ]
}

#[derive(Default)]
struct Words {
    bad: bool,
    rest: AnalogAlarmInputs,
}

/// Limits 10, 20, 80, 90, hysteresis 1 unless set otherwise.
fn run(settings: AnalogAlarmSettings, rows: &[Row<'_>]) {
    assert_eq!(settings.check(), Ok(()));
    let mut alarm = AnalogAlarm::default();
    for &(rule, ms, value, inputs, commands, expected) in rows {
        let words_in = from_words!(inputs, Words::default();
            "bad" => bad, "disable_hh" => rest.disable.hh, "disable_h" => rest.disable.h,
            "disable_l" => rest.disable.l, "disable_ll" => rest.disable.ll, "auto" => rest.auto_acknowledge,
            "simulated" => rest.simulated);
        let quality = if words_in.bad { Quality::Bad } else { Quality::Good };
        let inputs = AnalogAlarmInputs { value: Signal::new(value, quality), ..words_in.rest };
        let commands = from_words!(commands, AlarmCommands::default();
            "acknowledge" => acknowledge, "block" => block, "unblock" => unblock);
        expect(rule, expected, &words(&alarm.execute(&settings, ms * MS, inputs, commands)));
    }
}

#[test]
fn thresholds_and_hysteresis() {
    run(AnalogAlarmSettings::default(), &[
        ("between the limits nothing stands", 0, 50.0, "", "", "!hh !h !l !ll !interlock !warning !unacknowledged"),
        ("at a limit is not beyond it", 10, 80.0, "", "", "!h"),
        ("above H warns", 10, 80.1, "", "", "h alarm_h warning !interlock unacknowledged"),
        ("above HH interlocks, H stands too", 10, 90.1, "", "acknowledge", "hh h interlock warning unacknowledged"),
        ("within the hysteresis it still stands", 10, 89.0, "", "", "hh h interlock"),
        ("back by more than the hysteresis it ends", 10, 88.9, "", "", "!hh h !interlock warning unacknowledged"),
        ("H has its own hysteresis", 10, 79.0, "", "", "h"),
        ("H has its own hysteresis", 10, 78.9, "", "acknowledge", "!h !warning !unacknowledged"),
        ("below L warns", 10, 19.9, "", "", "l warning !interlock unacknowledged"),
        ("below LL interlocks", 10, 9.9, "", "", "ll l interlock warning"),
        ("the hysteresis below", 10, 11.0, "", "", "ll"),
        ("the hysteresis below", 10, 11.1, "", "", "!ll l !interlock"),
        ("from one side to the other in one step", 10, 95.0, "", "", "hh h !l !ll interlock"),
        ("infinity is no value", 10, f64::INFINITY, "", "", "io_error hh"),
    ]);
}

#[test]
fn a_disabled_threshold_forgets_that_the_value_was_beyond() {
    run(AnalogAlarmSettings { hysteresis: 5.0, ..AnalogAlarmSettings::default() }, &[
        ("beyond all upper limits", 0, 91.0, "", "", "hh h"),
        ("within the hysteresis, where it would still stand", 10, 86.0, "disable_hh", "", "!hh h"),
        ("enabled again, it does not: only a crossing counts", 10, 86.0, "", "", "!hh h !interlock"),
        ("which comes", 10, 90.5, "", "", "hh interlock"),
        ("beyond while disabled, and while enabled again, stands at once", 10, 95.0, "disable_hh", "", "!hh"),
        ("beyond while disabled, and while enabled again, stands at once", 10, 95.0, "", "", "hh"),
        ("also where the value cannot be read meanwhile", 10, 0.0, "bad disable_hh disable_h", "", "!hh !h"),
        ("also where the value cannot be read meanwhile", 10, 0.0, "bad", "", "!hh !h"),
        ("the same below", 10, 5.0, "", "", "ll l"),
        ("the same below", 10, 14.0, "disable_l disable_ll", "", "!ll !l"),
        ("the same below", 10, 14.0, "", "", "!ll l"),
        ("the same below", 10, 22.0, "disable_l", "", "!l"),
        ("the same below", 10, 22.0, "", "", "!l"),
    ]);
}

#[test]
fn delay() {
    run(AnalogAlarmSettings { delay: 50 * MS, ..AnalogAlarmSettings::default() }, &[
        ("the delay begins", 0, 85.0, "", "", "pending !h"),
        ("HH has its own", 40, 95.0, "", "", "pending !h !hh"),
        ("after its delay H warns", 10, 95.0, "", "", "h !hh warning !interlock pending"),
        ("after its delay HH interlocks", 40, 95.0, "", "", "hh interlock !pending"),
        ("disabled, HH ends at once", 10, 95.0, "disable_hh", "acknowledge", "!hh h !interlock !hh_enabled"),
        ("enabled again, the whole delay is due", 60, 95.0, "", "", "!hh pending"),
        ("disabled during the delay, it does not come through", 49, 95.0, "disable_hh", "", "!hh !pending"),
        ("disabled during the delay, it does not come through", 49, 95.0, "", "", "!hh pending !unacknowledged"),
        ("enabled for the whole delay, it does", 50, 95.0, "", "", "hh interlock unacknowledged"),
    ]);
}

#[test]
fn thresholds_of_their_own() {
    let used = Thresholds { hh: true, l: true, ..Thresholds::default() };
    run(AnalogAlarmSettings { used, ..AnalogAlarmSettings::default() }, &[
        ("a threshold that is not used counts for nothing", 0, 85.0, "", "", "!h !warning"),
        ("one that is used does", 0, 95.0, "", "", "hh !h interlock !warning hh_enabled"),
        ("the same below", 0, 5.0, "", "", "l !ll !interlock warning l_enabled"),
        ("disabled by an input", 0, 5.0, "disable_l", "", "!l !warning !l_enabled"),
    ]);
}

#[test]
fn block_and_acknowledge() {
    run(AnalogAlarmSettings::default(), &[
        ("blocked: it stands and does nothing", 0, 95.0, "", "block", "hh h !alarm_hh !interlock !warning !unacknowledged"),
        ("unblocked while it stands, it comes now", 9, 95.0, "", "unblock acknowledge", "alarm_hh interlock unacknowledged"),
        ("acknowledged while it stands", 9, 95.0, "", "acknowledge", "interlock !unacknowledged"),
        ("another threshold is another occurrence", 9, 5.0, "", "acknowledge", "ll unacknowledged"),
        ("auto: none is needed", 9, 95.0, "auto", "", "hh !unacknowledged"),
        ("simulated is shown", 9, 50.0, "simulated", "", "simulated"),
    ]);
}

#[test]
fn io_error() {
    run(AnalogAlarmSettings::default(), &[
        ("a value that cannot be read interlocks", 0, 50.0, "bad", "", "io_error interlock unacknowledged !warning"),
        ("and ends when it can", 9, 50.0, "", "acknowledge", "!io_error !interlock !unacknowledged"),
        ("NaN cannot be read", 9, f64::NAN, "", "", "io_error interlock !hh !ll"),
        ("it changes no threshold", 9, 85.0, "", "", "h"),
        ("it changes no threshold", 9, 0.0, "bad", "", "h !l !ll io_error"),
        ("blocked, it does not interlock", 9, 0.0, "bad", "block", "io_error !interlock"),
        ("with HH and LL disabled it does not", 9, 0.0, "bad disable_hh disable_ll", "unblock", "io_error !interlock"),
    ]);
    run(AnalogAlarmSettings { delay: 50 * MS, ..AnalogAlarmSettings::default() }, &[
        ("it has the delay too", 0, 50.0, "bad", "", "io_error pending !interlock"),
        ("it has the delay too", 50, 50.0, "bad", "", "interlock"),
    ]);
    run(
        AnalogAlarmSettings { interlock_on_io_error: false, ..AnalogAlarmSettings::default() },
        &[("if so set it is only shown", 0, 50.0, "bad", "", "io_error !interlock !unacknowledged")],
    );
    let used = Thresholds { h: true, l: true, ..Thresholds::default() };
    run(
        AnalogAlarmSettings { used, ..AnalogAlarmSettings::default() },
        &[("an alarm that only warns does not interlock", 0, 50.0, "bad", "", "io_error !interlock")],
    );
}
