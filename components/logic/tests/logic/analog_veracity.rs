//! Alarm unit, row "analog veracity check": `ON`, `IN_Sig`, `MSpeed` → `Out_Sig`, `Error`.

use crate::MS;
use Quality::{Bad, Good, Uncertain};
use latchwork_logic::{AnalogSettings, AnalogState, AnalogVeracity, Quality, Signal};

const SETTINGS: AnalogSettings = AnalogSettings { max_step: 5.0, period: 0, average: 1 };

fn good(value: f64) -> Signal {
    Signal::new(value, Good)
}

/// Checks rows of (input, output, its quality, error), one check each.
fn table(settings: &AnalogSettings, on: bool, rows: &[(f64, f64, Quality, bool)]) {
    let mut check = AnalogVeracity::default();
    for (i, &(input, value, quality, error)) in rows.iter().enumerate() {
        let got = check.execute(settings, 10 * MS, on, good(input));
        assert_eq!(got, (Signal::new(value, quality), error), "row {i}, input {input}");
    }
}

#[test]
fn on_accepted_is_stored_and_passed() {
    table(&SETTINGS, true, &[(30.0, 30.0, Good, false), (34.9, 34.9, Good, false), (31.0, 31.0, Good, false)]);
}

#[test]
fn on_the_first_finite_sample_is_accepted_as_it_is() {
    table(&SETTINGS, true, &[(1e300, 1e300, Good, false)]);
}

#[test]
fn on_a_step_of_mspeed_is_an_error_strictly_less_passes() {
    table(&SETTINGS, true, &[(30.0, 30.0, Good, false), (35.0, 30.0, Uncertain, true), (34.999, 34.999, Good, false)]);
    table(&SETTINGS, true, &[(30.0, 30.0, Good, false), (25.0, 30.0, Uncertain, true), (25.001, 25.001, Good, false)]);
}

#[test]
fn on_line_break_figure_3b_i_holds_the_last_accepted_value() {
    table(&SETTINGS, true, &[(30.0, 30.0, Good, false), (0.0, 30.0, Uncertain, true), (0.0, 30.0, Uncertain, true)]);
}

#[test]
fn on_spike_and_dip_figure_3b_ii_iii_are_held_off_and_pass_when_near_again() {
    for disturbed in [60.0, 0.0] {
        table(
            &SETTINGS,
            true,
            &[(30.0, 30.0, Good, false), (disturbed, 30.0, Uncertain, true), (31.0, 31.0, Good, false)],
        );
    }
}

#[test]
fn on_compares_with_the_last_accepted_value_not_with_the_last_input() {
    table(&SETTINGS, true, &[(30.0, 30.0, Good, false), (60.0, 30.0, Uncertain, true), (61.0, 30.0, Uncertain, true)]);
}

#[test]
fn on_nan_and_infinities_are_errors_and_never_stored() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        table(&SETTINGS, true, &[(30.0, 30.0, Good, false), (bad, 30.0, Uncertain, true), (31.0, 31.0, Good, false)]);
        table(&SETTINGS, true, &[(bad, 0.0, Bad, true), (40.0, 40.0, Good, false)]);
    }
}

#[test]
fn on_a_bad_quality_is_an_error_and_an_uncertain_one_is_passed_on() {
    let mut check = AnalogVeracity::default();
    let mut run = |signal| check.execute(&SETTINGS, 0, true, signal);
    assert_eq!(run(Signal::new(30.0, Bad)), (Signal::new(0.0, Bad), true), "nothing accepted yet");
    assert_eq!(run(Signal::new(30.0, Uncertain)), (Signal::new(30.0, Uncertain), false));
    assert_eq!(run(Signal::new(30.0, Bad)), (Signal::new(30.0, Uncertain), true));
    assert_eq!(run(good(30.0)), (good(30.0), false));
}

#[test]
fn off_is_a_repeater_whatever_the_step() {
    table(&SETTINGS, false, &[(30.0, 30.0, Good, false), (-900.0, -900.0, Good, false), (1e9, 1e9, Good, false)]);
}

#[test]
fn off_the_stored_value_follows() {
    let mut check = AnalogVeracity::default();
    check.execute(&SETTINGS, 0, true, good(30.0));
    check.execute(&SETTINGS, 0, false, good(80.0));
    assert_eq!(check.execute(&SETTINGS, 0, true, good(81.0)), (good(81.0), false));
    assert_eq!(check.execute(&SETTINGS, 0, true, good(30.0)), (Signal::new(81.0, Uncertain), true));
}

#[test]
fn off_nan_goes_through_as_bad_and_is_not_stored() {
    let mut check = AnalogVeracity::default();
    check.execute(&SETTINGS, 0, false, good(30.0));
    let (out, error) = check.execute(&SETTINGS, 0, false, good(f64::NAN));
    assert!(out.value.is_nan() && out.quality == Bad && error);
    assert_eq!(check.execute(&SETTINGS, 0, true, good(31.0)), (good(31.0), false), "30 is still the reference");
}

#[test]
fn period_checks_independently_of_the_scan_and_outputs_stand_between() {
    let settings = AnalogSettings { period: 30 * MS, ..SETTINGS };
    let mut check = AnalogVeracity::default();
    let out =
        [10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0].map(|v| check.execute(&settings, 10 * MS, true, good(v)).0.value);
    assert_eq!(out, [10.0, 10.0, 10.0, 13.0, 13.0, 13.0, 16.0]);
}

#[test]
fn period_a_disturbance_between_two_checks_is_not_seen() {
    let settings = AnalogSettings { period: 20 * MS, ..SETTINGS };
    let mut check = AnalogVeracity::default();
    let errors = [10.0, 60.0, 11.0, 60.0, 60.0].map(|v| check.execute(&settings, 10 * MS, true, good(v)).1);
    assert_eq!(errors, [false, false, false, false, true]);
}

#[test]
fn period_the_rhythm_survives_a_late_execution() {
    let settings = AnalogSettings { period: 30 * MS, ..SETTINGS };
    let mut check = AnalogVeracity::default();
    let mut at = |elapsed: u64, v: f64| check.execute(&settings, elapsed * MS, true, good(v)).0.value;
    assert_eq!(
        [at(0, 10.0), at(100, 11.0), at(10, 12.0), at(10, 13.0)],
        [10.0, 11.0, 11.0, 13.0],
        "checks at 0, 100 and 120 ms"
    );
}

#[test]
fn average_over_the_last_n_accepted_samples() {
    let settings = AnalogSettings { average: 3, ..SETTINGS };
    table(
        &settings,
        true,
        &[
            (10.0, 10.0, Good, false),
            (12.0, 11.0, Good, false),
            (14.0, 12.0, Good, false),
            (16.0, 14.0, Good, false),
            (99.0, 14.0, Uncertain, true),
            (18.0, 16.0, Good, false),
        ],
    );
}

#[test]
fn average_of_the_largest_numbers_does_not_overflow() {
    let settings = AnalogSettings { average: 16, max_step: f64::MAX, ..SETTINGS };
    let mut check = AnalogVeracity::default();
    for _ in 0..20 {
        assert_eq!(check.execute(&settings, 0, true, good(f64::MAX)), (good(f64::MAX), false));
    }
}

#[test]
fn reset_accepts_the_next_finite_sample_as_it_is() {
    let mut check = AnalogVeracity::default();
    check.execute(&SETTINGS, 0, true, good(30.0));
    assert!(check.execute(&SETTINGS, 0, true, good(50.0)).1);
    check.reset();
    assert_eq!(check.execute(&SETTINGS, 0, true, good(f64::NAN)), (Signal::new(0.0, Bad), true));
    assert_eq!(check.execute(&SETTINGS, 0, true, good(50.0)), (good(50.0), false));
}

#[test]
fn restore_goes_on_from_the_accepted_value() {
    let mut check = AnalogVeracity::default();
    check.restore(AnalogState { accepted: Some(30.0), error: false });
    assert_eq!(check.execute(&SETTINGS, 0, true, good(60.0)), (Signal::new(30.0, Uncertain), true));
    assert_eq!(check.save(), AnalogState { accepted: Some(30.0), error: true });
    check.restore(AnalogState { accepted: Some(f64::NAN), error: false });
    assert_eq!(check.execute(&SETTINGS, 0, true, good(60.0)), (good(60.0), false), "NaN counts as none");
}
