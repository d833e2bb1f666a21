//! AnalogInput and AnalogOutput: scaling, range, filter, dead band, rate, forced, I/O error, simulated.

use crate::MS;
use latchwork_logic::{
    Quality, Signal,
    cpc::{
        AnalogForceCommands, AnalogInput, AnalogInputSettings, AnalogInputStatus, AnalogOutput, AnalogOutputInputs,
        AnalogOutputOutputs, AnalogOutputSettings, AnalogOutputStatus,
    },
};

const NONE: AnalogForceCommands = AnalogForceCommands { force: false, unforce: false };
const FORCE: AnalogForceCommands = AnalogForceCommands { force: true, ..NONE };
const UNFORCE: AnalogForceCommands = AnalogForceCommands { force: true, unforce: true };

fn good(value: f64) -> Signal {
    Signal::new(value, Quality::Good)
}

/// Raw 0 to 1000 for 0 to 100.
fn input_settings() -> AnalogInputSettings {
    AnalogInputSettings { raw_high: 1_000.0, ..AnalogInputSettings::default() }
}

/// Rule, ms, raw, value, quality.
type InputRow = (&'static str, u64, Signal, f64, Quality);

fn run_input(settings: AnalogInputSettings, rows: &[InputRow]) -> AnalogInput {
    assert_eq!(settings.check(), Ok(()));
    let mut input = AnalogInput::default();
    for &(rule, ms, raw, value, quality) in rows {
        let out = input.execute(&settings, ms * MS, raw, false, NONE);
        assert!((out.value.value - value).abs() < 1e-6, "{rule}: {} is not {value}", out.value.value);
        assert_eq!(out.value.quality, quality, "{rule}");
        assert_eq!(out.status.io_error, quality == Quality::Bad, "{rule}");
    }
    input
}

#[test]
fn analog_input() {
    use Quality::{Bad, Good, Uncertain};
    let bad = |value| Signal::new(value, Bad);
    let settings = input_settings();
    run_input(settings, &[
        ("nothing believed yet is 0 and bad", 0, bad(500.0), 0.0, Bad),
        ("the raw value is scaled", 10, good(500.0), 50.0, Good),
        ("the ends belong to the range", 10, good(0.0), 0.0, Good),
        ("the ends belong to the range", 10, good(1_000.0), 100.0, Good),
        ("uncertain stays uncertain", 10, Signal::new(250.0, Uncertain), 25.0, Uncertain),
        ("bad quality is an I/O error: the last value is held", 10, bad(900.0), 25.0, Bad),
        ("below the range is an I/O error", 10, good(-0.1), 25.0, Bad),
        ("above the range is an I/O error", 10, good(1_000.1), 25.0, Bad),
        ("NaN is an I/O error", 10, good(f64::NAN), 25.0, Bad),
        ("infinity is an I/O error", 10, good(f64::INFINITY), 25.0, Bad),
        ("afterwards it follows at once", 10, good(300.0), 30.0, Good),
    ]);
    run_input(AnalogInputSettings { margin: 5.0, ..settings }, &[
        ("the margin is % of the range", 0, good(-50.0), -5.0, Good),
        ("the margin is % of the range", 0, good(1_050.0), 105.0, Good),
        ("beyond the margin it is an I/O error", 0, good(1_051.0), 105.0, Bad),
        ("beyond the margin it is an I/O error", 0, good(-51.0), 105.0, Bad),
    ]);
    let (raw_low, raw_high) = (-f64::MAX, f64::MAX);
    run_input(AnalogInputSettings { raw_low, raw_high, ..settings }, &[
        ("the widest range has its ends", 0, good(f64::MAX), 100.0, Good),
        ("the widest range has its ends", 0, good(f64::MIN), 0.0, Good),
    ]);
    run_input(AnalogInputSettings { raw_low: -1.5e308, raw_high: 1.5e308, ..settings }, &[
        ("a range wider than the numbers has no margin where none is set", 0, good(0.0), 50.0, Good),
        ("a range wider than the numbers has no margin where none is set", 0, good(1.6e308), 50.0, Bad),
        ("a range wider than the numbers has no margin where none is set", 0, good(-1.6e308), 50.0, Bad),
    ]);
    run_input(AnalogInputSettings { raw_low: -1e308, raw_high: 1e308, margin: 10.0, ..settings }, &[
        ("and its margin where one is set", 0, good(1.1e308), 105.0, Good),
        ("and its margin where one is set", 0, good(1.3e308), 105.0, Bad),
        ("and its margin where one is set", 0, good(-1.3e308), 105.0, Bad),
    ]);
    run_input(
        AnalogInputSettings { low: 20.0, high: -20.0, ..settings },
        &[("a falling range", 0, good(250.0), 10.0, Good), ("a falling range", 0, good(1_000.0), -20.0, Good)],
    );
    run_input(AnalogInputSettings { deadband: 2.0, ..settings }, &[
        ("the first value is taken as it is", 0, good(500.0), 50.0, Good),
        ("a movement smaller than the dead band changes nothing", 10, good(519.0), 50.0, Good),
        ("it is measured from the value shown, so drift comes through", 10, good(520.0), 52.0, Good),
        ("downwards too", 10, good(501.0), 52.0, Good),
        ("downwards too", 10, good(500.0), 50.0, Good),
        ("during an error it is held", 10, bad(0.0), 50.0, Bad),
        ("after an error the value is taken as it is", 10, good(510.0), 51.0, Good),
    ]);
    run_input(AnalogInputSettings { filter_time: 100 * MS, ..settings }, &[
        ("the first value is taken as it is", 0, good(0.0), 0.0, Good),
        ("a step comes through by dt / (T + dt)", 100, good(1_000.0), 50.0, Good),
        ("and again by the same part of the rest", 100, good(1_000.0), 75.0, Good),
        ("no time, no movement", 0, good(0.0), 75.0, Good),
        ("an error is not averaged in", 100, good(5_000.0), 75.0, Bad),
        ("and neither is the old value with one from after it", 100, good(100.0), 10.0, Good),
        ("a long step does not overshoot", u64::MAX / MS, good(1_000.0), 100.0, Good),
    ]);
}

#[test]
fn analog_input_forced() {
    let settings = AnalogInputSettings { forced_value: 25.0, ..input_settings() };
    let mut input = AnalogInput::default();
    let mut scan = |settings: &AnalogInputSettings, raw, commands| input.execute(settings, 0, raw, true, commands);
    let out = scan(&settings, good(500.0), NONE);
    let simulated = AnalogInputStatus { simulated: true, ..AnalogInputStatus::default() };
    assert_eq!((out.value, out.status), (good(50.0), simulated), "not forced, simulated");
    let out = scan(&settings, good(600.0), FORCE);
    let differs = AnalogInputStatus { forced: true, forced_differs: true, ..simulated };
    assert_eq!((out.value, out.measured, out.status), (good(25.0), 60.0, differs), "forced, it follows the operator");
    let out = scan(&settings, good(2_000.0), NONE);
    let error = AnalogInputStatus { io_error: true, above_range: true, ..differs };
    assert_eq!((out.value, out.status), (good(25.0), error), "forced, it is good even where the field is not");
    let out = scan(&settings, good(250.0), NONE);
    assert_eq!(out.status, AnalogInputStatus { forced: true, ..simulated }, "forced to what is measured");
    let out = scan(&AnalogInputSettings { forced_value: 8.0, ..settings }, good(250.0), NONE);
    assert_eq!(out.value, good(8.0), "the setting counts at once");
    let out = scan(&settings, good(-1.0), UNFORCE);
    assert!(!out.status.forced && out.status.below_range, "unforce wins over force");
    assert_eq!(out.value, Signal::new(25.0, Quality::Bad), "the last value believed is held");
}

fn output_settings() -> AnalogOutputSettings {
    AnalogOutputSettings { raw_high: 1_000.0, ..AnalogOutputSettings::default() }
}

/// Rule, ms, order, position, raw, status words checked by the caller's closure.
type OutputRow = (&'static str, u64, Signal, f64, f64, AnalogOutputStatus);

fn run_output(settings: AnalogOutputSettings, rows: &[OutputRow]) {
    assert_eq!(settings.check(), Ok(()));
    let mut output = AnalogOutput::default();
    for &(rule, ms, order, position, raw, status) in rows {
        let inputs = AnalogOutputInputs { order, ..AnalogOutputInputs::default() };
        let out = output.execute(&settings, ms * MS, inputs, NONE);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
        assert!(near(out.position, position) && near(out.raw, raw), "{rule}: {} {}", out.position, out.raw);
        assert_eq!(out.status, status, "{rule}");
    }
}

#[test]
fn analog_output() {
    let quiet = AnalogOutputStatus::default();
    let (limited, invalid) =
        (AnalogOutputStatus { limited: true, ..quiet }, AnalogOutputStatus { order_invalid: true, ..quiet });
    let ramping = AnalogOutputStatus { ramping: true, ..quiet };
    let bad = Signal::new(90.0, Quality::Bad);
    let settings = output_settings();
    run_output(AnalogOutputSettings { start: 5.0, ..settings }, &[
        ("before the first usable order it is at its start", 0, bad, 5.0, 50.0, invalid),
        ("the order is scaled to the raw value", 10, good(50.0), 50.0, 500.0, quiet),
        ("an order beyond the range is held at its end", 10, good(150.0), 100.0, 1_000.0, limited),
        ("an order beyond the range is held at its end", 10, good(-1.0), 0.0, 0.0, limited),
        ("the ends belong to the range", 10, good(100.0), 100.0, 1_000.0, quiet),
        ("an order of bad quality changes nothing", 10, Signal::new(1.0, Quality::Bad), 100.0, 1_000.0, invalid),
        ("an order that is NaN changes nothing", 10, good(f64::NAN), 100.0, 1_000.0, invalid),
        ("an infinite order changes nothing", 10, good(f64::NEG_INFINITY), 100.0, 1_000.0, invalid),
    ]);
    run_output(AnalogOutputSettings { low: 100.0, high: 0.0, start: 100.0, forced_value: 50.0, ..settings }, &[
        ("a falling range", 0, good(75.0), 75.0, 250.0, quiet),
        ("a falling range", 0, good(101.0), 100.0, 0.0, limited),
    ]);
    run_output(AnalogOutputSettings { low: 4.0, high: 20.0, ..settings }, &[
        ("a start outside the range is held at its end, and is no order beyond it", 0, bad, 4.0, 0.0, invalid),
        ("an order is", 10, good(21.0), 20.0, 1_000.0, limited),
    ]);
    run_output(AnalogOutputSettings { low: -4.0, high: -20.0, rate_limit: 8.0, ..settings }, &[
        ("at the nearer one, and there a ramp begins", 0, bad, -4.0, 0.0, invalid),
        ("at the nearer one, and there a ramp begins", 500, good(-20.0), -8.0, 250.0, ramping),
    ]);
    run_output(AnalogOutputSettings { rate_limit: 10.0, ..settings }, &[
        ("with a rate it begins at its start", 0, good(10.0), 0.0, 0.0, ramping),
        ("it moves by the rate", 500, good(10.0), 5.0, 50.0, ramping),
        ("and arrives exactly", 600, good(10.0), 10.0, 100.0, quiet),
        ("downwards too", 100, good(0.0), 9.0, 90.0, ramping),
        ("an hour is enough for anything", 3_600_000, good(0.0), 0.0, 0.0, quiet),
    ]);
}

#[test]
fn analog_output_forced() {
    let settings = AnalogOutputSettings { forced_value: 40.0, rate_limit: 10.0, ..output_settings() };
    let mut output = AnalogOutput::default();
    let mut scan = |ms: u64, commands| {
        let inputs = AnalogOutputInputs { order: good(0.0), io_error: true, simulated: true };
        output.execute(&settings, ms * MS, inputs, commands)
    };
    let AnalogOutputOutputs { position, status, .. } = scan(0, NONE);
    let shown = AnalogOutputStatus { io_error: true, simulated: true, ..AnalogOutputStatus::default() };
    assert_eq!((position, status), (0.0, shown), "error and simulated are shown");
    let out = scan(1_000, FORCE);
    let forced = AnalogOutputStatus { forced: true, forced_differs: true, ramping: true, ..shown };
    assert_eq!((out.position, out.status), (10.0, forced), "forced, it goes where the operator wants, at its rate");
    let out = scan(3_000, NONE);
    assert_eq!((out.position, out.raw, out.status.ramping), (40.0, 400.0, false));
    let out = scan(1_000, UNFORCE);
    assert_eq!((out.position, out.status.forced), (30.0, false), "let go, it goes back at its rate");
    let settings = AnalogOutputSettings { low: 4.0, high: 20.0, forced_value: 0.0, ..output_settings() };
    let inputs = AnalogOutputInputs { order: good(12.0), ..AnalogOutputInputs::default() };
    let out = AnalogOutput::default().execute(&settings, 0, inputs, FORCE);
    assert_eq!((out.position, out.raw), (4.0, 0.0), "a forced value outside the range is held at its end");
    assert!(out.status.forced_differs && !out.status.limited);
}
