//! Alarm unit, row "multivibrator": while RUN, alternates; RUN false turns the output off at once.

use crate::MS;
use latchwork_logic::{Multivibrator, MultivibratorSettings};

const SETTINGS: MultivibratorSettings = MultivibratorSettings { on_time: 30 * MS, off_time: 20 * MS };

fn run(settings: &MultivibratorSettings, step: u64, run: &[bool]) -> Vec<bool> {
    let mut blink = Multivibrator::default();
    run.iter().map(|r| blink.execute(settings, step * MS, *r)).collect()
}

#[test]
fn alternates_beginning_with_on_for_on_time_then_off_time() {
    let out: String = run(&SETTINGS, 10, &[true; 12]).iter().map(|o| if *o { 'X' } else { '.' }).collect();
    assert_eq!(out, "XXX..XXX..XX");
}

#[test]
fn run_false_turns_off_at_once_and_run_true_begins_with_on() {
    assert_eq!(
        run(&SETTINGS, 10, &[true, true, false, true, true, true, true]),
        [true, true, false, true, true, true, false]
    );
}

#[test]
fn not_running_stays_off() {
    assert_eq!(run(&SETTINGS, 10, &[false; 3]), [false; 3]);
}

#[test]
fn scans_that_do_not_divide_the_times_cause_no_drift() {
    let mut blink = Multivibrator::default();
    blink.execute(&SETTINGS, 0, true);
    for n in 1..1_000u64 {
        let expected = n * 7 % 50 < 30;
        assert_eq!(blink.execute(&SETTINGS, 7 * MS, true), expected, "at {} ms", n * 7);
    }
}

#[test]
fn a_scan_over_many_periods_lands_in_the_right_phase() {
    for (ms, on, phase) in [(1_000_000, true, 0), (1_000_029, true, 29), (1_000_030, false, 0), (1_000_049, false, 19)]
    {
        let mut blink = Multivibrator::default();
        blink.execute(&SETTINGS, 0, true);
        assert_eq!(blink.execute(&SETTINGS, ms * MS, true), on, "{ms} ms later");
        assert_eq!(blink.phase, phase * MS);
    }
}

#[test]
fn shorter_times_written_while_running_count_at_once() {
    let mut blink = Multivibrator::default();
    let long = MultivibratorSettings { on_time: 500 * MS, off_time: 500 * MS };
    blink.execute(&long, 0, true);
    assert!(blink.execute(&long, 400 * MS, true));
    assert!(!blink.execute(&SETTINGS, MS, true));
    assert!(blink.execute(&SETTINGS, 19 * MS, true));
}

#[test]
fn the_longest_times_do_not_overflow() {
    let longest = MultivibratorSettings { on_time: u64::MAX, off_time: u64::MAX };
    let mut blink = Multivibrator::default();
    blink.execute(&longest, 0, true);
    assert_eq!([u64::MAX - 1, 1, u64::MAX, 5].map(|e| blink.execute(&longest, e, true)), [true, false, true, true]);
}

#[test]
fn state_carries_the_phase_over() {
    let mut blink = Multivibrator::default();
    blink.execute(&SETTINGS, 0, true);
    blink.execute(&SETTINGS, 25 * MS, true);
    assert_eq!(blink, Multivibrator { running: true, on: true, phase: 25 * MS });
    let mut restored = Multivibrator { ..blink };
    assert!(!restored.execute(&SETTINGS, 5 * MS, true));
}
