//! Blocks that fail in `save`, and blocks that are out of order.

use super::{MS, PLANT, S, count, plant, told};
use latchwork_plant::lane::LaneState;
use latchwork_tests_plant::Rig;

#[test]
fn a_fault_in_save_is_a_fault_of_that_block_and_leaves_the_state_before() {
    let ran = plant().stimulus("1500ms,field.trap,true\n").run_for(2500 * MS);
    assert_eq!(told(&ran)[0], "a trap");
    let fault = ran.records.iter().find(|r| r.transition == "trap").expect("a record");
    assert_eq!(fault.time, 2 * S, "in the round at 2 s");
    assert!(fault.text.contains("save of workshop:store/keeper@0.1.0 trapped"), "{}", fault.text);
    let second = &ran.saves[1];
    assert_eq!(count(second, "a"), 101, "what was saved before");
    assert_eq!([count(second, "b"), count(second, "c")], [202, 203], "the others go on");
    assert_eq!(ran.outcome.lanes[0].statistics.scans, 250);
}

#[test]
fn a_fault_in_save_makes_outputs_safe_before_the_next_scan() {
    let text = PLANT.replace("[block.a]", "[block.a]\non-fault = \"stop-lane\"");
    let ran = Rig::new(&text).stimulus("1500ms,field.trap,true\n").run_for(2500 * MS);
    assert_eq!(ran.outcome.lanes[0].state, LaneState::Faulted);
    assert_eq!(ran.outcome.lanes[0].statistics.scans, 201, "no scan after the save at 2 s");
    assert_eq!([count(&ran.left().retained, "a"), count(&ran.left().retained, "b")], [101, 201], "b is saved at the end");
}

#[test]
fn a_save_without_end_costs_its_budget_once_and_not_the_plant() {
    let text = PLANT.replace("trap = \"field.trap\"", "burn = 4000000000");
    let text = text.replace("[block.a]", "[block.a]\nbudget = \"1ms\"");
    let ran = Rig::new(&text).run_for(1500 * MS);
    assert!(told(&ran).contains(&"a budget".to_owned()), "{:?}", told(&ran));
    assert_eq!(ran.outcome.lanes[0].statistics.scans, 150);
    assert_eq!(count(&ran.left().retained, "b"), 150);
}

#[test]
fn a_save_that_fails_at_the_stop_is_told_and_what_was_saved_before_counts() {
    let ran = plant().stimulus("1500ms,field.trap,true\n").run_for(1800 * MS);
    let lament = ran.records.iter().find(|r| r.source == "a").expect("a record");
    assert_eq!(lament.transition, "trap");
    assert!(lament.text.contains("its last state is not kept"), "{}", lament.text);
    assert_eq!([count(&ran.left().retained, "a"), count(&ran.left().retained, "b")], [101, 180]);
}

#[test]
fn a_block_that_is_out_of_order_keeps_what_was_saved_before() {
    let text = PLANT.replace("[block.a]\ncomponent = \"keeper-probe\"", "[block.a]\ncomponent = \"stress\"");
    let text = text.replace("inputs = { count = { tag = \"field.stand\", not = true }, trap = \"field.trap\" }", "");
    let rows = "1500ms,a.commands.trap,true\n1600ms,a.commands.trap,true\n";
    // Three strikes in a row: it is parked.
    let rows = format!("{rows}2600ms,a.commands.trap,true\n");
    let ran = Rig::new(&text).stimulus(&rows).run_for(5500 * MS);
    assert!(ran.records.iter().any(|r| r.text.contains("parked")), "{:?}", told(&ran));
    // Saved at 2 s between the second and the third fault, by an instance that had begun anew; not since.
    let kept = &ran.left().retained.blocks["a"];
    assert!(kept.time <= 2600 * MS && kept.time >= S, "{kept:?}");
    assert_eq!(count(&ran.left().retained, "b"), 550);
}
