//! Alarm unit, row "digital veracity check": `DOut` follows `DIn` after `Time12` without a break, both ways.

use crate::MS;
use latchwork_logic::DigitalVeracity;

const TIME: u64 = 50 * MS;

/// Runs an input given as (ms, level) changes every 10 ms and returns the output's changes as (ms, level).
fn changes(time: u64, input: &[(u64, bool)], until: u64) -> Vec<(u64, bool)> {
    let mut check = DigitalVeracity::default();
    let (mut din, mut dout, mut out) = (false, false, Vec::new());
    for ms in (0..=until).step_by(10) {
        din = input.iter().rev().find(|(at, _)| *at <= ms).map_or(din, |(_, level)| *level);
        let now = check.execute(if ms == 0 { 0 } else { 10 * MS }, din, time);
        if now != dout {
            out.push((ms, now));
            dout = now;
        }
    }
    out
}

#[test]
fn true_for_time12_without_a_break_sets() {
    assert_eq!(changes(TIME, &[(20, true)], 300), [(70, true)]);
}

#[test]
fn false_for_time12_without_a_break_resets() {
    assert_eq!(changes(TIME, &[(20, true), (120, false)], 300), [(70, true), (170, false)]);
}

#[test]
fn contact_bounce_is_ignored_figure_3a_t1() {
    let bounce = [(20, true), (30, false), (40, true), (60, false), (70, true)];
    assert_eq!(changes(TIME, &bounce, 300), [(120, true)]);
}

#[test]
fn short_disappearance_is_ignored_figure_3a_t6() {
    assert_eq!(changes(TIME, &[(0, true), (100, false), (140, true)], 300), [(50, true)]);
}

#[test]
fn a_break_exactly_at_time12_is_a_break() {
    assert_eq!(changes(TIME, &[(20, true), (70, false)], 300), []);
}

#[test]
fn the_output_is_the_input_delayed_by_time12() {
    let input: Vec<(u64, bool)> = (1..20).map(|i| (i * 60, i % 2 == 1)).collect();
    let delayed: Vec<(u64, bool)> = input.iter().map(|(ms, level)| (ms + 50, *level)).collect();
    assert_eq!(changes(TIME, &input, 1_300), delayed);
}

#[test]
fn time_zero_passes_at_once() {
    assert_eq!(changes(0, &[(0, true), (10, false), (20, true)], 30), [(0, true), (10, false), (20, true)]);
}

#[test]
fn input_true_from_the_start_waits_too() {
    assert_eq!(changes(TIME, &[(0, true)], 100), [(50, true)]);
}

#[test]
fn reset_forgets_the_output_and_starts_the_time_again() {
    let mut check = DigitalVeracity::default();
    check.execute(0, true, TIME);
    assert!(check.execute(TIME, true, TIME));
    check.reset();
    assert!(!check.execute(10 * MS, true, TIME), "off, and its own execution is where the time starts");
    assert!(!check.execute(40 * MS, true, TIME));
    assert!(check.execute(10 * MS, true, TIME));
}

#[test]
fn state_says_input_output_and_how_long_it_stood() {
    let mut check = DigitalVeracity::default();
    check.execute(0, true, TIME);
    check.execute(30 * MS, true, TIME);
    let state = check.save();
    assert_eq!((state.din, state.dout, state.held), (true, false, 30 * MS));
    let mut restored = DigitalVeracity::default();
    restored.restore(state);
    assert!(restored.execute(20 * MS, true, TIME), "goes on from 30 ms");
}
