//! Settings across versions.

use super::*;
use latchwork_tests_plant::forge::Bad;

#[test]
fn settings_are_carried_over_by_name() {
    let rig = plant_with(&Counter::new(1), "settings.step = 5");
    let newer = Counter { settings: &[("limit", "u32")], default_step: 9, ..Counter::new(2) };
    let ran = rig.with("v2", &newer.component()).stimulus("1s,swap.count,v2.wasm\n").run_for(2 * S);
    assert_eq!((ran.at("count.outputs.count", S - 10 * MS), ran.at("count.outputs.count", S)), ("500", "505"));
    assert_eq!(ran.at("count.outputs.version", S), "2");
}

#[test]
fn what_operators_wrote_counts_more_than_the_plant_file() {
    let rig = plant_with(&Counter::new(1), "settings.step = 5").with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("0.5s,count.settings.step,2\n1s,swap.count,v2.wasm\n").run_for(2 * S);
    assert_eq!((ran.at("count.outputs.count", S - 10 * MS), ran.at("count.outputs.count", S)), ("350", "352"));
}

#[test]
fn settings_of_the_order_count_most_and_are_shown() {
    let rig = plant_with(&Counter::new(1), "settings.step = 5").with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm settings.step=7\n").run_for(2 * S);
    assert_eq!((ran.at("count.outputs.count", S - 10 * MS), ran.at("count.outputs.count", S)), ("500", "507"));
    assert_eq!(ran.history("count.settings.step"), [(0, "5"), (S + 10 * MS, "7")]);
}

#[test]
fn during_probation_both_versions_get_what_is_written() {
    let rig = plant().with("v2", &Counter::new(2).bad(Bad::Trap(20)).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm\n1.1s,count.settings.step,3\n").run_for(2 * S);
    // Ten executions with 1, nine with 3; then the version before, from 100, with 3.
    assert_eq!(ran.at("count.outputs.count", 1180 * MS), "137");
    assert_eq!(ran.at("count.outputs.count", 1190 * MS), "103");
    assert_eq!(ran.at("count.settings.step", 2 * S), "3");
}

#[test]
fn a_version_before_that_refuses_them_is_no_way_back_any_more() {
    let first = Counter::new(1).bad(Bad::RefusesBeyond(2));
    let rig = plant_with(&first, "").with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm\n1.1s,count.settings.step,3\n").run_for(2 * S);
    assert_eq!(told(&ran), ["1000 count asked", "1000 count exchanged", "1100 count kept"]);
    let told = text(&ran, "count", "kept");
    assert!(told.contains("the version before refuses the new settings: this step is too wide"), "{told}");
    assert_eq!(ran.at("count.outputs.count", 1100 * MS), "113");
}

#[test]
fn the_settings_in_effect_go_back_with_the_version() {
    let rig = plant().with("v2", &Counter::new(2).component());
    let rows = "1s,swap.count,v2.wasm probation=5\n1.2s,count.settings.step,3\n1.5s,rollback.count,1\n";
    let ran = rig.stimulus(rows).run_for(2 * S);
    assert_eq!(ran.at("count.outputs.count", 1500 * MS), "103");
    assert_eq!(ran.at("count.outputs.version", 1500 * MS), "1");
}

#[test]
fn settings_that_a_failing_version_was_given_alone_are_gone_with_it() {
    let rig = plant().with("v2", &Counter::new(2).bad(Bad::Trap(20)).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm settings.step=7\n").run_for(2 * S);
    assert_eq!((ran.at("count.outputs.count", 1180 * MS), ran.at("count.outputs.count", 1190 * MS)), ("233", "101"));
    assert_eq!(ran.at("count.settings.step", 2 * S), "1");
}
