//! The shadow before the exchange.

use super::*;
use latchwork_tests_plant::forge::Bad;

#[test]
fn a_candidate_that_does_the_same_is_exchanged_after_the_shadow() {
    let rig = plant().with("v2", &Counter { version: 1, default_step: 2, ..Counter::new(2) }.component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm shadow=20 probation=10\n").run_for(2 * S);
    undisturbed(&ran, 200);
    let told = told(&ran);
    assert_eq!(told[..2], ["1000 count asked", "1000 count shadow"]);
    let [_, _, exchanged, kept] = &told[..] else { panic!("{told:#?}") };
    let ms = |line: &str| line.split(' ').next().and_then(|ms| ms.parse::<u64>().ok()).expect("a time");
    assert!(exchanged.ends_with("count exchanged") && (1200..=1230).contains(&ms(exchanged)), "{told:#?}");
    assert!(kept.ends_with("count kept"), "{told:#?}");
}

#[test]
fn a_difference_ends_it_without_effect() {
    let other = Counter { off: Some((5, 1)), ..Counter::new(1) };
    let ran = plant().with("v2", &other.component()).stimulus("1s,swap.count,v2.wasm shadow=20\n").run_for(2 * S);
    undisturbed(&ran, 200);
    let told = told(&ran);
    assert!(told[2].ends_with("count refused") && told.len() == 3, "{told:#?}");
    let why = text(&ran, "count", "refused");
    assert!(why.contains("count"), "{why}");
}

#[test]
fn a_fault_in_the_shadow_ends_it_without_effect() {
    let bad = Counter::new(1).bad(Bad::Trap(5));
    let ran = plant().with("v2", &bad.component()).stimulus("1s,swap.count,v2.wasm shadow=20\n").run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(ran.told(Kind::Fault), [""; 0]);
    assert!(told(&ran)[2].ends_with("count refused"));
}

#[test]
fn a_candidate_that_starts_cold_in_the_shadow_sees_what_it_would_see_in_the_lane() {
    // It retains nothing: its first execution is its first, and nobody knows how long ago the one before was.
    let cold = Counter { retained: None, default_step: 3, ..Counter::new(1) };
    // The count stands still at 0, so that nothing else differs.
    let rows = "0s,field.hold,true\n1s,swap.count,v2.wasm shadow=20\n2s,swap.count,v2.wasm probation=0\n";
    let ran = plant().with("v2", &cold.component()).stimulus(rows).run_for(3 * S);
    let why = text(&ran, "count", "refused");
    assert!(why.contains("1 of 20 executions gave something else"), "{why}");
    assert!(why.contains("outputs.elapsed") && why.contains("outputs.first"), "{why}");
    let at = ran.records.iter().find(|r| r.transition == "exchanged").expect("the second one is").time;
    let first = (ran.at("count.outputs.elapsed", at), ran.at("count.outputs.first", at));
    assert_eq!(first, ("0", "true"), "so it is in the lane");
}

#[test]
fn a_block_that_cannot_be_saved_gets_no_shadow_and_is_not_put_out_of_order_by_it() {
    let rig = plant_with(&Counter::new(1).bad(Bad::Save), "").with("v2", &Counter::new(2).component());
    let rows: String = (1..6).map(|n| format!("{n}s,swap.count,v2.wasm shadow=20\n")).collect();
    let ran = rig.stimulus(&rows).run_for(7 * S);
    undisturbed(&ran, 700);
    assert_eq!(ran.told(Kind::Fault), [""; 0]);
    let refused: Vec<_> = ran.records.iter().filter(|r| r.transition == "refused").collect();
    assert_eq!(refused.len(), 5, "{:#?}", told(&ran));
    let why = &refused[0].text;
    assert!(why.contains("no shadow: what runs fails when its state is saved"), "{why}");
    assert!(why.contains("latchwork replay --with"), "{why}");
}
