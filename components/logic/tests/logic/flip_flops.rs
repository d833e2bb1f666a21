//! IEC 61131-3:2013 tables 43 and 44.

use latchwork_logic::{FTrig, RTrig, Rs, Sr};

#[test]
fn sr_set_dominant_truth_table() {
    for (before, s1, r, q1) in [
        (false, false, false, false),
        (false, false, true, false),
        (false, true, false, true),
        (false, true, true, true),
        (true, false, false, true),
        (true, false, true, false),
        (true, true, false, true),
        (true, true, true, true),
    ] {
        let mut sr = Sr { q1: before };
        assert_eq!(sr.execute(s1, r), q1, "Q1 was {before}, S1 {s1}, R {r}");
        assert_eq!(sr.q1, q1);
    }
}

#[test]
fn rs_reset_dominant_truth_table() {
    for (before, s, r1, q1) in [
        (false, false, false, false),
        (false, false, true, false),
        (false, true, false, true),
        (false, true, true, false),
        (true, false, false, true),
        (true, false, true, false),
        (true, true, false, true),
        (true, true, true, false),
    ] {
        let mut rs = Rs { q1: before };
        assert_eq!(rs.execute(s, r1), q1, "Q1 was {before}, S {s}, R1 {r1}");
        assert_eq!(rs.q1, q1);
    }
}

#[test]
fn r_trig_true_for_one_execution_per_rising_edge() {
    let mut trig = RTrig::default();
    let clk = [false, true, true, false, false, true, false, true];
    let q = [false, true, false, false, false, true, false, true];
    assert_eq!(clk.map(|c| trig.execute(c)), q);
}

#[test]
fn r_trig_clk_true_in_the_first_execution_is_an_edge() {
    let mut trig = RTrig::default();
    assert_eq!([true, true].map(|c| trig.execute(c)), [true, false]);
}

#[test]
fn f_trig_true_for_one_execution_per_falling_edge() {
    let mut trig = FTrig::default();
    let clk = [true, false, false, true, true, false, true, false];
    let q = [false, true, false, false, false, true, false, true];
    assert_eq!(clk.map(|c| trig.execute(c)), q);
}

#[test]
fn f_trig_clk_false_in_the_first_execution_is_an_edge_as_the_standards_body_has_it() {
    let mut trig = FTrig::default();
    assert_eq!([false, false].map(|c| trig.execute(c)), [true, false]);
}
