//! Alarm unit, row "bounds check": limits 10 and 50, hysteresis 1.

use latchwork_logic::{BoundsCheck, BoundsSettings, Rs};

fn table(settings: &BoundsSettings, rows: &[(f64, bool, bool)]) {
    let mut check = BoundsCheck::default();
    for (i, &(signal, high, low)) in rows.iter().enumerate() {
        assert!(!check.execute(settings, signal), "row {i}: {signal} is a number");
        assert_eq!((check.high.q1, check.low.q1), (high, low), "row {i}: (high, low) at {signal}");
    }
}

#[test]
fn high_sets_above_the_limit_and_resets_below_limit_minus_hysteresis() {
    table(
        &BoundsSettings::default(),
        &[(50.0, false, false), (50.1, true, false), (49.5, true, false), (49.0, true, false), (48.9, false, false)],
    );
}

#[test]
fn low_sets_below_the_limit_and_resets_above_limit_plus_hysteresis() {
    table(
        &BoundsSettings::default(),
        &[(30.0, false, false), (10.0, false, false), (9.9, false, true), (11.0, false, true), (11.1, false, false)],
    );
}

#[test]
fn a_signal_floating_at_the_limit_sets_once_figure_13b() {
    let rows = [50.2, 49.8, 50.3, 49.1, 50.1].map(|v| (v, true, false));
    table(&BoundsSettings::default(), &rows);
}

#[test]
fn no_hysteresis_follows_the_limits_figure_13a() {
    let settings = BoundsSettings { hysteresis: 0.0, ..BoundsSettings::default() };
    table(&settings, &[(50.1, true, false), (50.0, true, false), (49.9, false, false), (50.1, true, false)]);
}

#[test]
fn from_one_side_to_the_other_in_one_scan() {
    table(&BoundsSettings::default(), &[(60.0, true, false), (0.0, false, true), (60.0, true, false)]);
}

#[test]
fn infinities_are_beyond_every_limit() {
    table(&BoundsSettings::default(), &[(f64::INFINITY, true, false), (f64::NEG_INFINITY, false, true)]);
}

#[test]
fn a_hysteresis_wider_than_the_limits_leaves_no_signal_high_and_low() {
    let settings = BoundsSettings { hysteresis: 1_000.0, ..BoundsSettings::default() };
    table(&settings, &[(60.0, true, false), (30.0, true, false), (0.0, false, true), (30.0, false, true)]);
}

#[test]
fn nan_changes_neither_output_and_is_reported() {
    for (high, low) in [(false, false), (true, false), (false, true)] {
        let before = BoundsCheck { high: Rs { q1: high }, low: Rs { q1: low } };
        let mut check = before;
        assert!(check.execute(&BoundsSettings::default(), f64::NAN));
        assert_eq!(check, before);
    }
}
