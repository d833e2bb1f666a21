//! What the next run makes of what was kept.

use super::{MS, PLANT, S, count, plant, state, text, told};
use latchwork_retain::Found;
use latchwork_tests_plant::Rig;
use proptest::prelude::*;

const CLASS: &str = "workshop:store/keeper@0.1.0";
const SCHEMA: &str = "count:u64,spent:u64";

#[test]
fn a_counter_goes_on_where_it_stopped_and_its_first_execution_is_no_cold_start() {
    let first = plant().run_for(500 * MS);
    assert_eq!(first.at("a.outputs.first", 0), "true");
    let second = plant().retained(first.left()).run_for(500 * MS);
    assert_eq!(second.at("a.outputs.count", 0), "51");
    assert_eq!(second.at("a.outputs.first", 0), "false");
    assert_eq!(second.at("a.outputs.elapsed", 0), "0", "nobody knows how long the plant stood still");
    assert_eq!(second.at("not-kept.outputs.count", 0), "1");
    assert_eq!(second.at("not-kept.outputs.first", 0), "true");
    assert_eq!(told(&second), ["retain restored"]);
    assert_eq!(
        text(&second, "retain", "restored"),
        "3 blocks go on with retained state, saved last at 1970-01-01T00:00:00.500000000Z"
    );
    let third = plant().retained(second.left()).run_for(10 * MS);
    assert_eq!(count(third.saves.last().expect("the stop"), "a"), 101);
}

#[test]
fn after_a_power_cut_the_last_interval_counts() {
    let ran = plant().run_for(3500 * MS);
    // What was written before the stop is all that there is.
    let cut = Found::of(ran.saves[ran.saves.len() - 2].clone());
    let again = plant().retained(cut).run_for(10 * MS);
    assert_eq!(again.at("a.outputs.count", 0), "302");
}

#[test]
fn a_plant_without_anything_kept_starts_cold_and_says_nothing() {
    let ran = plant().run_for(100 * MS);
    assert_eq!(told(&ran), [""; 0]);
    assert_eq!(ran.at("a.outputs.count", 0), "1");
}

#[test]
fn another_version_of_the_class_takes_what_it_knows() {
    for (class, schema, cells, expected, changes) in [
        (CLASS, SCHEMA, &[7u64, 1][..], "8", ""),
        // Narrower before, another order, a field more.
        (
            "workshop:store/keeper@0.0.9",
            "gone:bool,spent:u64,count:u16",
            &[1, 0, 300],
            "301",
            "count was u16 and is u64, gone (bool) is gone",
        ),
        // A field less: it is as it was when the block was made.
        (CLASS, "count:u64", &[9], "10", "spent (u64) is new"),
        (CLASS, "count:duration,spent:u64", &[5, 5], "6", "count was duration and is u64"),
        // Of types that hold more: the values decide.
        (CLASS, "count:s64,spent:u64", &[7, 5], "8", "count was s64 and is u64, which holds less"),
        (CLASS, "count:f64,spent:u64", &[7f64.to_bits(), 5], "8", "count was f64 and is u64, which holds less"),
    ] {
        let ran = plant().retained(state(class, schema, cells)).run_for(20 * MS);
        assert_eq!(ran.at("a.outputs.count", 0), expected, "{schema}");
        assert_eq!(ran.at("a.outputs.first", 0), "false", "{schema}");
        if changes.is_empty() {
            assert_eq!(told(&ran), ["retain restored"], "{schema}");
        } else {
            let told = text(&ran, "a", "restored");
            assert_eq!(told, format!("its state is of another version: {changes}"), "{schema}");
        }
    }
}

#[test]
fn what_does_not_fit_is_a_record_and_a_cold_start_of_that_block_alone() {
    for (class, schema, cells, why) in [
        (
            "workshop:store/other@0.1.0",
            SCHEMA,
            &[7u64, 1][..],
            "its state is of class `workshop:store/other@0.1.0`, and it is of class",
        ),
        (
            CLASS,
            "count:s64,spent:u64",
            &[u64::MAX, 1],
            "its state would lose something: count was s64 and is u64, which holds less",
        ),
        (
            CLASS,
            "count:f64,spent:u64",
            &[1.5f64.to_bits(), 1],
            "its state would lose something: count was f64 and is u64",
        ),
        (CLASS, "other:u64", &[7], "none of the fields of its state is there any more"),
        (CLASS, "count:u99,spent:u64", &[7, 1], "its state does not have the fields that it should have"),
        (CLASS, SCHEMA, &[7], "its state does not have the fields that it should have"),
        (CLASS, "count:u8,spent:u64", &[256, 1], "its state does not have the fields that it should have"),
        // It traps in `restore`.
        (CLASS, SCHEMA, &[13, 1], "it does not take its state: restore of workshop:store/keeper@0.1.0 trapped"),
    ] {
        let mut found = state(class, schema, cells);
        let good = state(CLASS, SCHEMA, &[1000, 0]).retained.blocks["a"].clone();
        found.retained.blocks.insert("b".into(), good);
        let ran = plant().retained(found).run_for(1500 * MS);
        let told = text(&ran, "a", "not-restored");
        assert!(told.starts_with(why) && told.contains("the block begins anew"), "{schema}: {told}");
        assert_eq!((ran.at("a.outputs.count", 0), ran.at("a.outputs.first", 0)), ("1", "true"), "{schema}");
        assert_eq!((ran.at("b.outputs.count", 0), ran.at("b.outputs.first", 0)), ("1001", "false"), "{schema}");
        assert!(!ran.outcome.faulted() && ran.outcome.faulted.is_empty(), "{schema}");
        // And its new state is kept from then on.
        assert_eq!(count(&ran.left().retained, "a"), 150, "{schema}");
    }
}

#[test]
fn settings_that_an_operator_wrote_are_there_before_the_state() {
    let text = r#"
        [lane.main]
        every = "10ms"
        [block.a]
        component = "everything"
        lane = "main"
        retain = true
        inputs.echo = "retained"
        inputs.a = 7
        "#;
    let first = Rig::new(text).stimulus("50ms,a.settings.b,77\n").run_for(100 * MS);
    let rig = Rig::new(text).after(&first.kept).retained(first.left());
    let second = rig.run_for(100 * MS);
    assert_eq!(second.at("a.settings.b", 0), first.at("a.settings.b", 90 * MS));
    assert_eq!(second.at("a.outputs.executions", 0), "11");
}

#[test]
fn the_state_of_a_block_that_is_gone_is_forgotten_on_record() {
    let first = plant().run_for(100 * MS);
    let text_ = PLANT.replace("[block.c]", "[block.renamed]");
    let second = Rig::new(&text_).retained(first.left()).run_for(100 * MS);
    assert!(told(&second).contains(&"c forgotten".to_owned()), "{:?}", told(&second));
    let names: Vec<_> = second.left().retained.blocks.keys().cloned().collect();
    assert_eq!(names, ["a", "b", "renamed"]);
    assert_eq!(second.at("renamed.outputs.count", 0), "1");
}

#[test]
fn damaged_files_are_told_and_stop_no_plant() {
    use latchwork_retain::Damage;
    let first = plant().run_for(100 * MS);
    let one = Found { damage: vec![(1, Damage::Checksum)], slot: Some(0), ..first.left() };
    let ran = plant().retained(one).run_for(50 * MS);
    assert_eq!(told(&ran), ["retain damaged", "retain restored"]);
    assert!(text(&ran, "retain", "damaged").starts_with("retained-1: its checksum does not fit"));
    let both = Found { damage: vec![(0, Damage::Header), (1, Damage::Checksum)], ..Found::default() };
    let ran = plant().retained(both).run_for(50 * MS);
    assert_eq!(told(&ran), ["retain not-restored"]);
    assert!(text(&ran, "retain", "not-restored").contains("all blocks begin anew"));
    assert_eq!(ran.at("a.outputs.count", 0), "1");
}

#[test]
fn the_same_run_from_the_same_state_is_the_same() {
    let left = plant().run_for(700 * MS).left();
    let runs = [0, 1].map(|_| plant().retained(left.clone()).run_for(2500 * MS));
    assert_eq!(runs[0].records, runs[1].records);
    assert_eq!((&runs[0].trace, &runs[0].saves), (&runs[1].trace, &runs[1].saves));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    /// Stops and power cuts in any order: a counter is never older than what was written last, and never ahead of it.
    #[test]
    fn any_series_of_stops_and_power_cuts_goes_on_from_what_was_written_last(
        runs in prop::collection::vec((1u64..250, any::<bool>()), 1..6),
    ) {
        let mut found = Found::default();
        for (scans, cut) in runs {
            let before = found.retained.blocks.get("a").map_or(0, |s| s.cells[0]);
            let ran = plant().retained(found.clone()).run_for(scans * 10 * MS);
            prop_assert_eq!(ran.at("a.outputs.count", 0), (before + 1).to_string());
            let written = if cut { ran.saves.len() - 1 } else { ran.saves.len() };
            if let Some(last) = ran.saves[..written].last() {
                found = Found::of(last.clone());
            }
            let after = found.retained.blocks.get("a").map_or(0, |s| s.cells[0]);
            let missing = before + scans - after;
            // A second between two rounds, and three blocks in three scans.
            prop_assert!(if cut { missing <= 102 } else { missing == 0 }, "{missing} scans are missing");
        }
    }
}

#[test]
fn a_state_of_any_cells_goes_on_unchanged_through_a_run_that_does_not_touch_it() {
    let text = PLANT.replace("inputs.count = { tag = \"field.stand\", not = true }", "");
    for count in [0, 1, u64::MAX, 1 << 63] {
        let mut found = Found::default();
        found.retained.blocks.insert("b".into(), state(CLASS, SCHEMA, &[count, 1]).retained.blocks["a"].clone());
        let ran = Rig::new(&text).retained(found).run_for(2 * S);
        assert_eq!(super::count(&ran.left().retained, "b"), count);
    }
}
