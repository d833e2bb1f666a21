//! Probation: the version before is back at once when the new one fails.

use super::*;
use latchwork_tests_plant::forge::Bad;

#[test]
fn each_kind_of_fault_puts_the_version_before_back_in_the_same_scan() {
    for (bad, transition) in [(Bad::Trap(20), "trap"), (Bad::Loop(20), "budget"), (Bad::Grow(20), "memory")] {
        let ran = plant_with(&Counter::new(1), "safe.count = 77")
            .with("v2", &Counter::new(2).bad(bad).component())
            .stimulus("1s,swap.count,v2.wasm\n")
            .run_for(2 * S);
        let fault = format!("1190 count {transition}");
        let expected = ["1000 count asked", "1000 count exchanged", &fault, "1190 count rolled-back"];
        assert_eq!(told(&ran), expected, "{bad:?}");
        // The new version counted from 101 to 119; the old one goes on from 100, with what it knows and nothing else.
        assert_eq!(ran.at("count.outputs.count", 1180 * MS), "119", "{bad:?}");
        assert_eq!(ran.at("count.outputs.count", 1190 * MS), "101", "{bad:?}");
        assert_eq!(ran.history("count.outputs.version"), [(0, "1"), (S, "2"), (1190 * MS, "1")], "{bad:?}");
        // The time that has passed for it since it executed last.
        assert_eq!(ran.at("count.outputs.elapsed", 1190 * MS), "200000000", "{bad:?}");
        assert_eq!(ran.at("count.outputs.elapsed", S + 200 * MS), "10000000", "{bad:?}");
        assert_eq!(ran.outcome.lanes[0].statistics.scans, 200);
        counts(&ran, "other", 200);
        let told = text(&ran, "count", "rolled-back");
        assert!(told.contains("v1 ") && told.contains(" → v2 "), "{told}");
    }
}

#[test]
fn a_rollback_is_no_strike() {
    let rig = plant_with(&Counter::new(1).bad(Bad::Trap(150)), "")
        .with("v2", &Counter::new(2).bad(Bad::Trap(1)).component())
        .stimulus("100ms,swap.count,v2.wasm\n300ms,swap.count,v2.wasm\n500ms,swap.count,v2.wasm\n");
    let ran = rig.run_for(2 * S);
    let own = ran.records.iter().find(|r| r.text.contains("fault 1 of 3"));
    assert!(own.is_some_and(|r| r.time == 1490 * MS), "{:#?}", told(&ran));
}

#[test]
fn all_blocks_of_an_order_go_back_together() {
    // The first of the lane fails, and the last one.
    for (count, other) in [("v2", "v3"), ("v3", "v2")] {
        let ran = plant()
            .with("v2", &Counter::new(2).component())
            .with("v3", &Counter::new(3).bad(Bad::Trap(10)).component())
            .stimulus(&format!("1s,swap.count,{count}.wasm other {other}.wasm\n"))
            .run_for(2 * S);
        let at = 1090 * MS;
        // What ran before the fault in that scan goes back for the next.
        let last = if count == "v3" { at - 10 * MS } else { at };
        assert_ne!(ran.at("count.outputs.version", last), "1");
        assert_eq!(ran.at("count.outputs.version", last + 10 * MS), "1");
        assert_eq!(ran.at("other.outputs.version", at), "1");
        let told = told(&ran);
        let rolled: Vec<_> = told.iter().filter(|t| t.ends_with("rolled-back")).collect();
        assert_eq!(rolled, ["1090 count rolled-back", "1090 other rolled-back"]);
        assert_eq!(ran.outcome.lanes[0].statistics.scans, 200);
    }
}

#[test]
fn a_fault_after_the_probation_is_an_ordinary_one() {
    let rig = plant().with("v2", &Counter::new(2).bad(Bad::Trap(11)).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm probation=10\n").run_for(2 * S);
    assert_eq!(told(&ran)[2..], ["1090 count kept", "1100 count trap", "1200 count restarted"]);
    let rig = plant().with("v2", &Counter::new(2).bad(Bad::Trap(10)).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm probation=10\n").run_for(2 * S);
    assert_eq!(told(&ran)[2..], ["1090 count trap", "1090 count rolled-back"]);
}

#[test]
fn stop_lane_does_not_stop_the_lane_while_there_is_a_way_back() {
    let ran = plant_with(&Counter::new(1), "on-fault = \"stop-lane\"")
        .with("v2", &Counter::new(2).bad(Bad::Trap(5)).component())
        .stimulus("1s,swap.count,v2.wasm\n")
        .run_for(2 * S);
    assert!(!ran.outcome.faulted());
    assert_eq!(ran.outcome.lanes[0].statistics.scans, 200);
}

#[test]
fn what_was_out_of_order_before_is_out_of_order_again() {
    let parked = Counter::new(1).bad(Bad::Trap(1));
    let ran = plant_with(&parked, "safe.count = 77")
        .with("v2", &Counter::new(2).bad(Bad::Trap(5)).component())
        .with("v3", &Counter::new(3).component())
        .stimulus("3s,swap.count,v2.wasm\n4s,swap.count,v3.wasm probation=0\n")
        .run_for(5 * S);
    let expected = [
        "3000 count asked",
        "3000 count exchanged",
        "3040 count trap",
        "3040 count rolled-back",
        "4000 count asked",
        "4000 count exchanged",
    ];
    assert_eq!(told(&ran)[5..], expected);
    assert_eq!(ran.at("count.outputs.count", 3030 * MS), "4");
    assert_eq!(ran.at("count.outputs.count", 3040 * MS), "77");
    assert_eq!(ran.at("count.outputs.count", 4 * S), "1");
}

#[test]
fn a_restart_that_was_under_way_is_asked_for_again_after_a_rollback() {
    // It faults at 0, would restart at 100 ms, and is swapped before that.
    let first = Counter::new(1).bad(Bad::Trap(1));
    let ran = plant_with(&first, "")
        .with("v2", &Counter::new(2).bad(Bad::Trap(3)).component())
        .stimulus("50ms,swap.count,v2.wasm\n")
        .run_for(300 * MS);
    let expected = [
        "0 count trap",
        "50 count asked",
        "50 count exchanged",
        "70 count trap",
        "70 count rolled-back",
        "100 count restarted",
        "100 count trap",
    ];
    assert_eq!(told(&ran), expected);
}
