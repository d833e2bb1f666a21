//! The exchange itself.

use super::*;
use latchwork_tests_plant::forge::Bad;

#[test]
fn a_new_version_goes_on_where_the_old_one_was() {
    let rig = plant().with("v2", &Counter::new(2).component()).stimulus("1s,swap.count,v2.wasm probation=50\n");
    let ran = rig.run_for(3 * S);
    undisturbed(&ran, 300);
    assert_eq!(ran.history("count.outputs.version"), [(0, "1"), (S, "2")]);
    assert_eq!(told(&ran), ["1000 count asked", "1000 count exchanged", "1490 count kept"]);
    let told = text(&ran, "count", "exchanged");
    assert!(told.starts_with("swap 1: v1 ") && told.contains(" → v2 "), "{told}");
    assert!(text(&ran, "count", "asked").contains("v2.wasm"));
}

#[test]
fn a_restored_version_is_not_in_its_first_execution_and_its_time_goes_on() {
    let rig = plant().with("v2", &Counter::new(2).component()).stimulus("1s,swap.count,v2.wasm\n");
    let ran = rig.run_for(2 * S);
    assert_eq!(ran.history("count.outputs.first"), [(0, "true"), (10 * MS, "false")]);
    assert_eq!(ran.history("count.outputs.elapsed"), [(0, "0"), (10 * MS, "10000000")]);
}

#[test]
fn a_wider_state_is_converted() {
    let wide = Counter { retained: Some("u64"), ..Counter::new(2) };
    let ran = plant().with("v2", &wide.component()).stimulus("1s,swap.count,v2.wasm\n").run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(ran.at("count.outputs.version", S), "2");
}

#[test]
fn a_narrower_state_needs_leave() {
    let first = Counter { retained: Some("u64"), ..Counter::new(1) };
    let rig = || plant_with(&first, "").with("v2", &Counter::new(2).component());
    let ran = rig().stimulus("1s,swap.count,v2.wasm\n").run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(told(&ran), ["1000 count asked", "1000 count refused"]);
    assert!(text(&ran, "count", "refused").contains("`count` would lose something: from u64 to u32; allow it with"));
    let ran = rig().stimulus("1s,swap.count,v2.wasm allow-lossy\n").run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(ran.at("count.outputs.version", S), "2");
}

#[test]
fn a_version_that_retains_nothing_starts_cold() {
    let cold = Counter { retained: None, ..Counter::new(2) };
    let ran = plant().with("v2", &cold.component()).stimulus("1s,swap.count,v2.wasm\n").run_for(2 * S);
    assert_eq!(ran.at("count.outputs.count", S - 10 * MS), "100");
    assert_eq!(ran.at("count.outputs.count", S), "1");
    assert_eq!((ran.at("count.outputs.first", S), ran.at("count.outputs.elapsed", S)), ("true", "0"));
    assert_eq!(ran.at("count.outputs.count", 2 * S - 1), "100");
}

#[test]
fn several_blocks_of_a_lane_are_exchanged_in_one_scan() {
    let ran = plant()
        .with("v2", &Counter::new(2).component())
        .stimulus("1s,swap.count,v2.wasm other v2.wasm probation=10\n")
        .run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(ran.history("count.outputs.version"), [(0, "1"), (S, "2")]);
    assert_eq!(ran.history("other.outputs.version"), [(0, "1"), (S, "2")]);
    let expected = [
        "1000 count asked",
        "1000 other asked",
        "1000 count exchanged",
        "1000 other exchanged",
        "1090 count kept",
        "1090 other kept",
    ];
    assert_eq!(told(&ran), expected);
}

#[test]
fn none_of_several_is_exchanged_when_one_cannot_take_its_state() {
    for bad in [Bad::Restore, Bad::Configure] {
        let ran = plant()
            .with("v2", &Counter::new(2).component())
            .with("v3", &Counter::new(3).bad(bad).component())
            .stimulus("1s,swap.count,v2.wasm other v3.wasm\n")
            .run_for(2 * S);
        undisturbed(&ran, 200);
        let expected = ["1000 count asked", "1000 other asked", "1000 count refused", "1000 other refused"];
        assert_eq!(told(&ran), expected, "{bad:?}");
        assert_eq!(ran.history("count.outputs.version"), [(0, "1")]);
        assert!(text(&ran, "count", "refused").contains("unreachable code"), "{ran:?}", ran = ran.records);
    }
}

#[test]
fn a_running_version_that_cannot_save_is_not_exchanged_and_has_faulted() {
    let first = Counter::new(1).bad(Bad::Save);
    let ran = plant_with(&first, "")
        .with("v2", &Counter::new(2).component())
        .stimulus("1s,swap.count,v2.wasm\n")
        .run_for(2 * S);
    let expected = ["1000 count asked", "1000 count trap", "1000 count refused", "1100 count restarted"];
    assert_eq!(told(&ran), expected);
    assert!(text(&ran, "count", "refused").contains("could not save"));
    counts(&ran, "other", 200);
}

#[test]
fn a_block_that_is_out_of_order_can_be_swapped() {
    // It traps in the first execution of each instance, and is parked at its third.
    let first = Counter::new(1).bad(Bad::Trap(1));
    let rig = plant_with(&first, "").with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("50ms,swap.count,v2.wasm probation=5\n").run_for(2 * S);
    assert_eq!(told(&ran), ["0 count trap", "50 count asked", "50 count exchanged", "90 count kept"]);
    assert_eq!(ran.at("count.outputs.count", S), "96");
    let rig = plant_with(&first, "").with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("3s,swap.count,v2.wasm probation=5\n").run_for(4 * S);
    assert_eq!(told(&ran)[5..], ["3000 count asked", "3000 count exchanged", "3040 count kept"]);
    assert_eq!(ran.at("count.outputs.count", 4 * S - 1), "100");
}

#[test]
fn a_later_restart_makes_the_new_version() {
    let later = Counter::new(2).bad(Bad::Trap(50));
    let ran = plant().with("v2", &later.component()).stimulus("1s,swap.count,v2.wasm probation=10\n").run_for(2 * S);
    let expected =
        ["1000 count asked", "1000 count exchanged", "1090 count kept", "1490 count trap", "1590 count restarted"];
    assert_eq!(told(&ran), expected);
    assert_eq!((ran.at("count.outputs.version", 1590 * MS), ran.at("count.outputs.count", 1590 * MS)), ("2", "1"));
}

#[test]
fn a_block_can_be_swapped_again_and_again() {
    let mut rig = plant();
    let mut rows = String::new();
    for n in 2..=20 {
        rig = rig.with(&format!("v{n}"), &Counter::new(n).component());
        rows += &format!("{}ms,swap.count,v{n}.wasm probation=0\n", n * 50);
    }
    let ran = rig.stimulus(&rows).run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(ran.history("count.outputs.version").len(), 20);
    assert_eq!(told(&ran).len(), 19 * 2);
}

#[test]
fn two_runs_with_swaps_are_equal_to_the_byte() {
    let run = || {
        let rig = plant().with("v2", &Counter { off: Some((30, 0)), ..Counter::new(2) }.bad(Bad::Trap(20)).component());
        let ran = rig.stimulus("1s,swap.count,v2.wasm shadow=10\n1.2s,swap.other,v2.wasm probation=3\n").run_for(2 * S);
        (ran.records, ran.trace)
    };
    assert_eq!(run(), run());
}

#[test]
fn a_block_of_an_interrupt_lane_is_exchanged_between_two_edges() {
    let rig = Rig::new(
        "[lane.main]\nevery = \"10ms\"\n[lane.trip]\non = [\"gpio.door\"]\n[driver.gpio]\nkind = \"sim\"\n\
         points.door = { type = \"bool\" }\n[block.count]\ncomponent = \"v1.wasm\"\nlane = \"trip\"\n\
         [block.other]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n",
    );
    let rig = rig.with("v1", &Counter::new(1).component()).with("v2", &Counter::new(2).component());
    let rig = rig.with("v3", &Counter::new(3).bad(Bad::Trap(2)).component());
    let rows = "100ms,gpio.door,true\n200ms,gpio.door,false\n250ms,swap.count,v2.wasm probation=1\n300ms,gpio.door,true\n\
                400ms,swap.count,v3.wasm\n500ms,gpio.door,false\n600ms,gpio.door,true\n700ms,gpio.door,false\n";
    let ran = rig.stimulus(rows).run_for(S);
    let at = |ms: u64| (ran.at("count.outputs.version", ms * MS), ran.at("count.outputs.count", ms * MS));
    // Its first execution needs no edge.
    assert_eq!((at(200), at(290), at(300), at(500)), (("1", "3"), ("1", "3"), ("2", "4"), ("3", "5")));
    // The third fails at its second edge: the version before takes that edge.
    assert_eq!((at(600), at(700)), (("2", "5"), ("2", "6")));
    let expected = [
        "250 count asked",
        "300 count exchanged",
        "300 count kept",
        "400 count asked",
        "500 count exchanged",
        "600 count trap",
        "600 count rolled-back",
    ];
    assert_eq!(told(&ran), expected);
}
