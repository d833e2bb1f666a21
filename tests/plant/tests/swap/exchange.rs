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
fn every_widening_carries_the_count_over_and_every_narrowing_needs_leave() {
    let swapped = |old, new, options: &str| {
        let [first, second] = [(1, old), (2, new)].map(|(n, ty)| Counter { retained: Some(ty), ..Counter::new(n) });
        let rig = plant_with(&first, "").with("v2", &second.component());
        rig.stimulus(&format!("1s,swap.count,v2.wasm {options}\n")).run_for(2 * S)
    };
    for (old, new) in [
        ("u8", "u16"),
        ("u8", "s16"),
        ("u16", "u32"),
        ("u32", "u64"),
        ("u32", "s64"),
        ("s32", "s64"),
        ("f32", "f64"),
        ("u16", "f32"),
        ("u32", "f64"),
    ] {
        let ran = swapped(old, new, "");
        undisturbed(&ran, 200);
        assert_eq!(ran.history("count.outputs.version"), [(0, "1"), (S, "2")], "{old} to {new}");
    }
    for (old, new) in
        [("u32", "u16"), ("u64", "u32"), ("u32", "s32"), ("s64", "u64"), ("u64", "f64"), ("f64", "f32"), ("f64", "u32")]
    {
        let ran = swapped(old, new, "");
        undisturbed(&ran, 200);
        assert_eq!(ran.history("count.outputs.version"), [(0, "1")], "{old} to {new}");
        let why = format!("`count` would lose something: from {old} to {new}; allow it with");
        assert!(text(&ran, "count", "refused").contains(&why), "{}", text(&ran, "count", "refused"));
        // What is there fits: with leave nothing is lost.
        let ran = swapped(old, new, "allow-lossy");
        undisturbed(&ran, 200);
        assert_eq!(ran.at("count.outputs.version", S), "2", "{old} to {new}");
    }
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
    // The last one fails in the lane alone: beside it, it gets the state that it starts with.
    for bad in [Bad::Restore, Bad::Configure, Bad::RestoreBeyond(50)] {
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
    let expected = ["1000 count trap", "1000 count asked", "1000 count refused", "1100 count restarted"];
    assert_eq!(told(&ran), expected);
    assert!(text(&ran, "count", "refused").contains("could not save"));
    counts(&ran, "other", 200);
}

#[test]
fn a_running_version_that_cannot_save_is_not_gone_back_to_as_if_it_were_in_order() {
    let cold = Counter { retained: None, ..Counter::new(2) }.bad(Bad::Trap(5));
    let rig = plant_with(&Counter::new(1).bad(Bad::Save), "safe.count = 77").with("v2", &cold.component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm\n").run_for(2 * S);
    let found = ran.records.iter().find(|r| r.transition == "trap").expect("a record of the first trap");
    assert_eq!(found.time, S);
    assert!(found.text.starts_with("the version that goes could not save its state"), "{}", found.text);
    let told = told(&ran);
    let faults: Vec<_> = told.iter().filter(|t| t.ends_with("trap") || t.ends_with("restarted")).collect();
    assert_eq!(faults, ["1000 count trap", "1040 count trap", "1060 count restarted"]);
    assert_eq!((ran.at("count.outputs.count", 1050 * MS), ran.at("count.outputs.count", 1060 * MS)), ("77", "1"));
    assert_eq!(ran.at("count.outputs.version", 1060 * MS), "1");
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
    // No edge is waited for: it is done while the lane waits.
    // Its first execution needs no edge.
    assert_eq!((at(200), at(290), at(300), at(500)), (("1", "3"), ("1", "3"), ("2", "4"), ("3", "5")));
    // The third fails at its second edge: the version before takes that edge.
    assert_eq!((at(600), at(700)), (("2", "5"), ("2", "6")));
    let expected = [
        "250 count asked",
        "250 count exchanged",
        "300 count kept",
        "400 count asked",
        "400 count exchanged",
        "600 count trap",
        "600 count rolled-back",
    ];
    assert_eq!(told(&ran), expected);
}

/// Two counters in an interrupt lane, and one in a cyclic lane that keeps time going; `trip` is further text of its table.
fn interrupt_plant(trip: &str) -> Rig {
    let rig = Rig::new(&format!(
        "[lane.main]\nevery = \"10ms\"\n[lane.trip]\non = [\"gpio.door\"]\n{trip}\n[driver.gpio]\nkind = \"sim\"\n\
         points.door = {{ type = \"bool\" }}\n[block.count]\ncomponent = \"v1.wasm\"\nlane = \"trip\"\n\
         [block.second]\ncomponent = \"v1.wasm\"\nlane = \"trip\"\n[block.other]\ncomponent = \"v1.wasm\"\n\
         lane = \"main\"\n"
    ));
    rig.with("v1", &Counter::new(1).component()).with("v2", &Counter::new(2).component())
}

#[test]
fn without_any_edge_blocks_of_an_interrupt_lane_are_exchanged_taken_back_and_given_settings() {
    let rows = "100ms,swap.count,v2.wasm second v2.wasm\n200ms,rollback.count,1\n300ms,count.settings.step,5\n\
                400ms,swap.count,v2.wasm probation=0\n600ms,gpio.door,true\n";
    let ran = interrupt_plant("").stimulus(rows).run_for(S);
    let expected = [
        "100 count asked",
        "100 second asked",
        "100 count exchanged",
        "100 second exchanged",
        "200 count asked",
        "200 second asked",
        "200 count rolled-back",
        "200 second rolled-back",
        "400 count asked",
        "400 count exchanged",
    ];
    assert_eq!(told(&ran), expected);
    // One execution at the start, one for the edge.
    assert_eq!(ran.at("count.outputs.count", S), "6");
    assert_eq!((ran.at("count.outputs.version", S), ran.at("second.outputs.version", S)), ("2", "1"));
}

#[test]
fn a_command_given_to_a_waiting_interrupt_lane_is_seen_by_exactly_one_execution() {
    let rows = "100ms,gpio.door,true\n200ms,count.commands.clear,true\n250ms,count.settings.step,2\n\
                300ms,gpio.door,false\n400ms,gpio.door,true\n";
    let ran = interrupt_plant("").stimulus(rows).run_for(S);
    let counts: Vec<_> = ran.history("count.outputs.count").into_iter().map(|(at, n)| (at / MS, n)).collect();
    assert_eq!(counts, [(0, "1"), (100, "2"), (300, "0"), (400, "2")]);
}

#[test]
fn lanes_that_poll_or_run_with_another_one_exchange_their_blocks_too() {
    for (trip, kept) in [("poll = \"1ms\"", "600 count kept"), ("also-with = \"main\"", "100 count kept")] {
        let rows = "95ms,swap.count,v2.wasm probation=1\n600ms,gpio.door,true\n";
        let ran = interrupt_plant(trip).stimulus(rows).run_for(S);
        let told = told(&ran);
        assert!(told[1].ends_with("count exchanged"), "{told:?}");
        assert_eq!(told[2], kept);
    }
}
