//! Retained state and swaps: what is kept is always of the version that executes, or of the one before it.

use super::{MS, S, count, plant, told};
use latchwork_plant::operate::Operation;
use latchwork_plant::run::RunOptions;
use latchwork_plant::sim::{Action, Stimulus};
use latchwork_plant::swap::{Part, SwapOrder};
use latchwork_tests_plant::component_folders;

/// The component that runs, as another file: with a section that means nothing.
fn other() -> Vec<u8> {
    let path = component_folders()[1].join("keeper-probe.wasm");
    let mut bytes = std::fs::read(path).expect("the component");
    bytes.extend(*b"\0\x05\x04note");
    bytes
}

fn swap(at: u64, block: &str, bytes: Vec<u8>) -> Stimulus {
    let part = Part {
        block: block.into(),
        file: "other.wasm".into(),
        bytes: bytes.into(),
        settings: Vec::new(),
        expects: None,
    };
    let order = SwapOrder {
        parts: vec![part],
        shadow: 0,
        tolerances: Vec::new(),
        probation: 10,
        allow_lossy: false,
        dry_run: false,
        save: false,
    };
    Stimulus { time: at, action: Action::Operate(Operation::Swap(Box::new(order))) }
}

#[test]
fn a_swap_keeps_the_state_before_it_and_at_once_that_of_the_new_version() {
    let options =
        RunOptions { duration: Some(900 * MS), stimulus: vec![swap(500 * MS, "a", other())], ..RunOptions::default() };
    let ran = plant().run(options);
    assert!(told(&ran).contains(&"a exchanged".to_owned()), "{:?}", ran.records);
    // Before the first interval is over.
    let first = &ran.saves[0];
    assert_eq!(first.blocks.keys().collect::<Vec<_>>(), ["a"]);
    let before = count(first, "a");
    assert!((50..=53).contains(&before), "{before}");
    let second = &ran.saves[1];
    let (old, new) = (&first.blocks["a"].version, &second.blocks["a"].version);
    assert!(old.hash != new.hash && old.schema == new.schema && old.component == "keeper-probe", "{old:?} {new:?}");
    assert!(count(second, "a") > before && count(second, "a") < before + 10);
    assert!(second.blocks["a"].time < 600 * MS);
    assert_eq!(count(&ran.left().retained, "a"), 90, "nothing was lost on the way");
    // Without --save the plant file's version goes on from the new one's state.
    let next = plant().retained(ran.left()).run_for(S);
    assert_eq!(next.at("a.outputs.count", 0), "91");
}

#[test]
fn a_swap_in_the_middle_of_a_round_keeps_both_states_at_once_too() {
    // The round at 1 s asks `a`, `b` and `c` in three scans.
    for order in (950..1060).step_by(10) {
        let options = RunOptions {
            duration: Some(1500 * MS),
            stimulus: vec![swap(order * MS, "a", other())],
            ..RunOptions::default()
        };
        let ran = plant().run(options);
        let of = |r: &&latchwork_record::Record| r.source == "a" && r.transition == "exchanged";
        let at = ran.records.iter().find(of).expect("it is exchanged").time;
        let states: Vec<_> = ran.saves.iter().filter_map(|s| s.blocks.get("a")).collect();
        let old = &states[0].version.hash;
        let before = states.iter().rfind(|s| s.version.hash == *old).expect("the old one's");
        assert!((at - 20 * MS..=at + 20 * MS).contains(&before.time), "{order}: {before:?}, exchanged at {at}");
        let after = states.iter().find(|s| s.version.hash != *old).expect("the new one's");
        assert!((at..=at + 40 * MS).contains(&after.time), "{order}: {after:?}, exchanged at {at}");
        // The round goes on all the same, and is one.
        let round = &ran.saves.iter().rfind(|s| s.blocks.contains_key("c")).expect("the round").blocks;
        assert!(["b", "c"].iter().all(|b| round[*b].time >= S), "{order}");
        assert_eq!(ran.figures.rounds, 1, "{order}");
    }
}
