//! IEC 61131-3:2013 table 45.

use latchwork_logic::{Ctd, Ctu, Ctud, RTrig};

const X: bool = true;
const O: bool = false;

#[test]
fn ctu_counts_rising_edges_and_q_at_pv() {
    let mut c = Ctu::default();
    for (i, (cu, r, cv, q)) in
        [(O, O, 0, O), (X, O, 1, O), (X, O, 1, O), (O, O, 1, O), (X, O, 2, X), (O, O, 2, X), (X, O, 3, X), (O, X, 0, O)]
            .into_iter()
            .enumerate()
    {
        assert_eq!((c.execute(cu, r, 2), c.cv), (q, cv), "row {i}");
    }
}

#[test]
fn ctu_reset_dominates_and_consumes_the_edge() {
    let mut c = Ctu { cv: 5, ..Ctu::default() };
    assert_eq!((c.execute(X, X, 2), c.cv), (O, 0), "edge under reset");
    assert_eq!((c.execute(X, O, 2), c.cv), (O, 0), "no edge any more when reset falls");
}

#[test]
fn ctu_stops_at_the_largest_value() {
    let mut c = Ctu { cv: i32::MAX - 1, ..Ctu::default() };
    let cv = [X, O, X, O, X].map(|cu| {
        c.execute(cu, O, 0);
        c.cv
    });
    assert_eq!(cv, [i32::MAX; 5]);
}

#[test]
fn ctu_cu_true_in_the_first_execution_counts() {
    let mut c = Ctu::default();
    assert_eq!((c.execute(X, O, 1), c.cv), (X, 1));
}

#[test]
fn ctu_q_follows_pv_at_once_also_negative() {
    let mut c = Ctu::default();
    assert_eq!([1, 0, -1, i32::MIN, i32::MAX].map(|pv| c.execute(O, O, pv)), [O, X, X, X, O]);
}

#[test]
fn ctd_counts_down_from_the_loaded_value_and_q_at_zero() {
    let mut c = Ctd::default();
    for (i, (cd, ld, cv, q)) in [
        (O, O, 0, X),
        (O, X, 2, O),
        (X, O, 1, O),
        (X, O, 1, O),
        (O, O, 1, O),
        (X, O, 0, X),
        (O, O, 0, X),
        (X, O, -1, X),
    ]
    .into_iter()
    .enumerate()
    {
        assert_eq!((c.execute(cd, ld, 2), c.cv), (q, cv), "row {i}");
    }
}

#[test]
fn ctd_load_dominates_and_consumes_the_edge() {
    let mut c = Ctd::default();
    assert_eq!((c.execute(X, X, 7), c.cv), (O, 7));
    assert_eq!((c.execute(X, O, 7), c.cv), (O, 7));
}

#[test]
fn ctd_stops_at_the_smallest_value() {
    let mut c = Ctd { cv: i32::MIN + 1, ..Ctd::default() };
    let cv = [X, O, X, O, X].map(|cd| {
        c.execute(cd, O, 0);
        c.cv
    });
    assert_eq!(cv, [i32::MIN; 5]);
}

#[test]
fn ctud_dominance_reset_then_load_then_counting() {
    for (name, cu, cd, r, ld, cv) in [
        ("up", X, O, O, O, 11),
        ("down", O, X, O, O, 9),
        ("simultaneous edges cancel", X, X, O, O, 10),
        ("load over up", X, O, O, X, 3),
        ("load over down", O, X, O, X, 3),
        ("reset over load and both counts", X, X, X, X, 0),
        ("nothing", O, O, O, O, 10),
    ] {
        let mut c = Ctud { cv: 10, ..Ctud::default() };
        assert_eq!((c.execute(cu, cd, r, ld, 3), c.cv), ((cv >= 3, cv <= 0), cv), "{name}");
    }
}

#[test]
fn ctud_an_edge_counts_while_the_other_input_stands_true() {
    let mut c = Ctud { cd: RTrig { m: true }, ..Ctud::default() };
    assert_eq!((c.execute(X, X, O, O, 1), c.cv), ((X, O), 1));
}

#[test]
fn ctud_cancelled_edges_are_consumed() {
    let mut c = Ctud::default();
    c.execute(X, X, O, O, 1);
    c.execute(X, X, O, O, 1);
    assert_eq!(c.cv, 0);
}

#[test]
fn ctud_stops_at_both_limits() {
    let mut up = Ctud { cv: i32::MAX, ..Ctud::default() };
    let mut down = Ctud { cv: i32::MIN, ..Ctud::default() };
    assert_eq!(up.execute(X, O, O, O, i32::MAX), (X, O));
    assert_eq!(down.execute(O, X, O, O, 0), (O, X));
    assert_eq!((up.cv, down.cv), (i32::MAX, i32::MIN));
}
