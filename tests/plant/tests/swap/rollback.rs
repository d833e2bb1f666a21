//! Back to an earlier version by hand.

use super::*;
use latchwork_tests_plant::forge::Bad;

#[test]
fn during_probation_the_version_before_is_back_as_it_was() {
    let rig = plant().with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm\n1.2s,rollback.count,1\n").run_for(2 * S);
    let expected = ["1000 count asked", "1000 count exchanged", "1200 count asked", "1200 count rolled-back"];
    assert_eq!(told(&ran), expected);
    assert_eq!(ran.at("count.outputs.count", 1190 * MS), "120");
    assert_eq!((ran.at("count.outputs.count", 1200 * MS), ran.at("count.outputs.version", 1200 * MS)), ("101", "1"));
    assert_eq!(ran.outcome.lanes[0].statistics.scans, 200);
}

#[test]
fn after_probation_it_is_back_with_the_state_that_it_had() {
    let rig = plant().with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm probation=10\n1.5s,rollback.count,1\n").run_for(2 * S);
    assert_eq!((ran.at("count.outputs.count", 1490 * MS), ran.at("count.outputs.version", 1490 * MS)), ("150", "2"));
    assert_eq!((ran.at("count.outputs.count", 1500 * MS), ran.at("count.outputs.version", 1500 * MS)), ("101", "1"));
    // Its time goes on with the block's.
    assert_eq!(ran.at("count.outputs.elapsed", 1500 * MS), "10000000");
    assert_eq!(ran.at("count.outputs.first", 1500 * MS), "false");
    let expected =
        ["1000 count asked", "1000 count exchanged", "1090 count kept", "1500 count asked", "1500 count rolled-back"];
    assert_eq!(told(&ran), expected);
}

#[test]
fn rolling_back_is_undone_by_rolling_back() {
    for (probation, when) in [(1000, "1.1s"), (5, "1.1s")] {
        let rig = plant().with("v2", &Counter::new(2).component());
        let rows =
            format!("1s,swap.count,v2.wasm probation={probation}\n{when},rollback.count,1\n1.5s,rollback.count,1\n");
        let ran = rig.stimulus(&rows).run_for(2 * S);
        let expected = [(0, "1"), (S, "2"), (1100 * MS, "1"), (1500 * MS, "2")];
        assert_eq!(ran.history("count.outputs.version"), expected, "{:#?}", ran.records);
        // It had counted to 110 when it was taken back.
        assert_eq!(ran.at("count.outputs.count", 1500 * MS), "111");
    }
}

#[test]
fn several_versions_deep_with_their_states() {
    let mut rig = plant();
    let mut rows = String::new();
    for n in 2..=12 {
        rig = rig.with(&format!("v{n}"), &Counter::new(n).component());
        rows += &format!("{}ms,swap.count,v{n}.wasm probation=0\n", n * 100);
    }
    // Version n was replaced with a count of 10 × (n + 1); eight of them are kept.
    rows += "1.5s,rollback.count,9\n1.6s,rollback.count,8\n1.7s,rollback.count,1\n1.8s,rollback.count,4\n";
    let ran = rig.stimulus(&rows).run_for(2 * S);
    assert!(text(&ran, "count", "refused").contains("`count` has 8 earlier versions, not 9"));
    let at = |time| (ran.at("count.outputs.version", time), ran.at("count.outputs.count", time));
    assert_eq!(at(1590 * MS), ("12", "160"));
    assert_eq!(at(1600 * MS), ("4", "51"));
    assert_eq!(at(1700 * MS), ("12", "161"));
    // 4 is the version before again; 11, 10 and 9 come before it.
    assert_eq!(at(1800 * MS), ("9", "101"));
}

#[test]
fn a_version_that_cannot_save_any_more_can_still_be_left() {
    let rig = plant().with("v2", &Counter::new(2).bad(Bad::Save).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm probation=5\n1.5s,rollback.count,1\n").run_for(2 * S);
    assert_eq!((ran.at("count.outputs.count", 1500 * MS), ran.at("count.outputs.version", 1500 * MS)), ("101", "1"));
}

#[test]
fn a_version_on_probation_that_traps_when_it_is_taken_back_is_left_all_the_same() {
    let rig = plant().with("v2", &Counter::new(2).bad(Bad::Save).component());
    let rows = "1s,swap.count,v2.wasm probation=1000\n1.5s,rollback.count,1\n1.7s,rollback.count,1\n";
    let ran = rig.stimulus(rows).run_for(2 * S);
    let seen = |ms: u64| (ran.at("count.outputs.version", ms * MS), ran.at("count.outputs.count", ms * MS));
    // The old one is back as it was, in the scan in which it was wanted.
    assert_eq!((seen(1490), seen(1500)), (("2", "150"), ("1", "101")));
    let why = text(&ran, "count", "trap");
    assert!(why.contains("the version that goes could not save its state, which is lost"), "{why}");
    assert_eq!(told(&ran)[2..6], ["1500 count trap", "1500 count asked", "1500 count rolled-back", "1700 count asked"]);
    // Its instance has trapped and its state is lost: should it come again, it begins anew.
    assert_eq!(seen(1750), ("2", "6"), "{:#?}", told(&ran));
    assert_eq!(ran.outcome.lanes[0].statistics.scans, 200);
    counts(&ran, "other", 200);
}

#[test]
fn without_an_earlier_version_it_is_refused() {
    let ran = plant().stimulus("1s,rollback.count,1\n").run_for(2 * S);
    undisturbed(&ran, 200);
    assert!(text(&ran, "count", "refused").contains("has no earlier version"));
}

#[test]
fn a_version_that_failed_is_none_to_go_back_to() {
    let rig = plant().with("v2", &Counter::new(2).bad(Bad::Trap(3)).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm\n1.5s,rollback.count,1\n").run_for(2 * S);
    assert!(text(&ran, "count", "refused").contains("has no earlier version"));
}

#[test]
fn one_that_retains_nothing_is_back_as_it_stood_while_its_instance_is_kept() {
    let first = Counter { retained: None, ..Counter::new(1) };
    let rig = plant_with(&first, "").with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm probation=5\n1.5s,rollback.count,1\n").run_for(2 * S);
    assert_eq!((ran.at("count.outputs.count", 1490 * MS), ran.at("count.outputs.count", 1500 * MS)), ("50", "101"));
}
