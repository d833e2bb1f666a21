//! IEC 61131-3:2013 table 46 and its timing diagrams, scan by scan. Each row: ms since the last execution, IN, PT in ms;
//! Q and ET in ms that must come out.

use crate::MS;
use latchwork_logic::{Tof, Ton, Tp};

type Row = (u64, bool, u64, bool, u64);

macro_rules! run {
    ($timer:ident, $rows:expr) => {{
        let rows: &[Row] = $rows;
        let mut timer = $timer::default();
        for (i, &(elapsed, input, pt, q, et)) in rows.iter().enumerate() {
            let got = timer.execute(elapsed * MS, input, pt * MS);
            assert_eq!((got, timer.et), (q, et * MS), "row {i}: (Q, ET)");
            assert_eq!(got, timer.q, "row {i}: the answer is the state");
        }
    }};
}

const X: bool = true;
const O: bool = false;

#[test]
fn ton_diagram_q_after_pt_and_off_at_once() {
    run!(
        Ton,
        &[
            (0, O, 30, O, 0),
            (10, X, 30, O, 0),
            (10, X, 30, O, 10),
            (10, X, 30, O, 20),
            (10, X, 30, X, 30),
            (10, X, 30, X, 30),
            (10, O, 30, O, 0),
            (10, X, 30, O, 0),
            (10, X, 30, O, 10)
        ]
    );
}

#[test]
fn ton_diagram_a_pulse_shorter_than_pt_gives_nothing() {
    run!(Ton, &[(10, X, 30, O, 0), (10, X, 30, O, 10), (10, X, 30, O, 20), (10, O, 30, O, 0), (10, X, 30, O, 0)]);
}

#[test]
fn ton_in_drops_exactly_at_pt_gives_nothing() {
    run!(Ton, &[(0, X, 20, O, 0), (10, X, 20, O, 10), (10, O, 20, O, 0)]);
}

#[test]
fn ton_pt_zero_is_no_delay() {
    run!(Ton, &[(0, X, 0, X, 0), (10, X, 0, X, 0), (10, O, 0, O, 0)]);
}

#[test]
fn ton_pt_longer_while_running_delays_further() {
    run!(Ton, &[(0, X, 20, O, 0), (10, X, 20, O, 10), (10, X, 40, O, 20), (10, X, 40, O, 30), (10, X, 40, X, 40)]);
}

#[test]
fn ton_pt_shorter_while_running_ends_at_once() {
    run!(Ton, &[(0, X, 50, O, 0), (30, X, 50, O, 30), (10, X, 20, X, 20)]);
}

#[test]
fn ton_pt_changed_after_the_end_does_not_take_q_back() {
    run!(Ton, &[(0, X, 20, O, 0), (20, X, 20, X, 20), (10, X, 90, X, 20), (10, X, 10, X, 10), (10, O, 10, O, 0)]);
}

#[test]
fn ton_first_execution_with_in_true_starts_there_whatever_elapsed_says() {
    run!(Ton, &[(900, X, 20, O, 0), (20, X, 20, X, 20)]);
}

#[test]
fn ton_a_scan_longer_than_pt_ends_in_it() {
    run!(Ton, &[(0, X, 20, O, 0), (500, X, 20, X, 20)]);
}

#[test]
fn tof_diagram_q_at_once_and_off_after_pt() {
    run!(
        Tof,
        &[
            (0, O, 30, O, 0),
            (10, X, 30, X, 0),
            (10, X, 30, X, 0),
            (10, O, 30, X, 0),
            (10, O, 30, X, 10),
            (10, O, 30, X, 20),
            (10, O, 30, O, 30),
            (10, O, 30, O, 30),
            (10, X, 30, X, 0)
        ]
    );
}

#[test]
fn tof_diagram_in_back_before_pt_holds_q() {
    run!(
        Tof,
        &[
            (0, X, 30, X, 0),
            (10, O, 30, X, 0),
            (20, O, 30, X, 20),
            (5, X, 30, X, 0),
            (10, O, 30, X, 0),
            (29, O, 30, X, 29),
            (1, O, 30, O, 30)
        ]
    );
}

#[test]
fn tof_in_rises_exactly_at_pt_leaves_no_gap() {
    run!(Tof, &[(0, X, 20, X, 0), (10, O, 20, X, 0), (10, O, 20, X, 10), (10, X, 20, X, 0)]);
}

#[test]
fn tof_pt_zero_is_no_delay() {
    run!(Tof, &[(0, X, 0, X, 0), (10, O, 0, O, 0), (10, X, 0, X, 0)]);
}

#[test]
fn tof_pt_changed_while_running_counts_at_once() {
    run!(Tof, &[(0, X, 20, X, 0), (10, O, 20, X, 0), (10, O, 40, X, 10), (20, O, 40, X, 30), (0, O, 25, O, 25)]);
}

#[test]
fn tof_first_execution_with_in_false_does_not_run() {
    run!(Tof, &[(0, O, 20, O, 0), (10, O, 20, O, 0)]);
}

#[test]
fn tp_diagram_pulse_of_pt_then_et_stays_until_in_falls() {
    run!(
        Tp,
        &[
            (0, O, 30, O, 0),
            (10, X, 30, X, 0),
            (10, X, 30, X, 10),
            (10, X, 30, X, 20),
            (10, X, 30, O, 30),
            (10, X, 30, O, 30),
            (10, O, 30, O, 0),
            (10, X, 30, X, 0)
        ]
    );
}

#[test]
fn tp_diagram_in_falls_during_the_pulse_does_not_cut_it() {
    run!(Tp, &[(0, X, 30, X, 0), (10, O, 30, X, 10), (10, O, 30, X, 20), (10, O, 30, O, 0)]);
}

#[test]
fn tp_diagram_retrigger_during_the_pulse_does_not_prolong_it() {
    run!(
        Tp,
        &[
            (0, X, 30, X, 0),
            (10, O, 30, X, 10),
            (10, X, 30, X, 20),
            (10, X, 30, O, 30),
            (10, X, 30, O, 30),
            (10, O, 30, O, 0),
            (10, X, 30, X, 0)
        ]
    );
}

#[test]
fn tp_edge_in_the_execution_that_ends_the_pulse_starts_none() {
    run!(Tp, &[(0, X, 20, X, 0), (10, O, 20, X, 10), (10, X, 20, O, 20), (10, X, 20, O, 20), (10, O, 20, O, 0)]);
}

#[test]
fn tp_pt_zero_is_no_pulse() {
    run!(Tp, &[(0, X, 0, O, 0), (10, X, 0, O, 0), (10, O, 0, O, 0), (10, X, 0, O, 0)]);
}

#[test]
fn tp_pt_changed_while_running_counts_at_once() {
    run!(Tp, &[(0, X, 20, X, 0), (10, X, 40, X, 10), (20, X, 40, X, 30), (0, X, 25, O, 25), (10, X, 90, O, 25)]);
}

#[test]
fn tp_first_execution_with_in_true_is_an_edge() {
    run!(Tp, &[(900, X, 20, X, 0), (20, X, 20, O, 20)]);
}

#[test]
fn timers_saturate_at_the_longest_time() {
    let (mut ton, mut tp) = (Ton::default(), Tp::default());
    ton.execute(0, true, u64::MAX);
    tp.execute(0, true, u64::MAX);
    for (q_ton, q_tp) in [(false, true), (true, false), (true, false)] {
        assert_eq!(ton.execute(u64::MAX / 2 + 1, true, u64::MAX), q_ton);
        assert_eq!(tp.execute(u64::MAX / 2 + 1, true, u64::MAX), q_tp);
    }
    assert_eq!((ton.et, tp.et), (u64::MAX, u64::MAX));
}
