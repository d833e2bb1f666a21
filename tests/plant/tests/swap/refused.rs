//! What stops a swap before it touches anything.

use super::*;
use latchwork_tests_plant::forge::Bad;

/// The plant of [`plant`] with `v2`, after a swap at 1 s that was refused: why.
fn refused(rig: Rig, row: &str) -> String {
    let ran = rig.stimulus(&format!("1s,swap.count,{row}\n")).run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(ran.history("count.outputs.version"), [(0, "1")]);
    text(&ran, "count", "refused").to_owned()
}

#[track_caller]
fn refuses(rig: Rig, row: &str, why: &str) {
    let told = refused(rig, row);
    assert!(told.contains(why), "{told}\nexpected: {why}");
}

#[test]
fn another_class() {
    let other = Counter { class: "adder", ..Counter::new(2) };
    refuses(plant().with("v2", &other.component()), "v2.wasm", "change of class");
    refuses(plant().with("v2", &other.component()), "v2.wasm", "test:unit/counter");
}

#[test]
fn another_version_of_the_class_is_no_other_class() {
    let newer = Counter { class_version: "0.2.0", ..Counter::new(2) };
    let ran = plant().with("v2", &newer.component()).stimulus("1s,swap.count,v2.wasm\n").run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(ran.at("count.outputs.version", S), "2");
}

#[test]
fn no_component() {
    for (bytes, why) in [
        (&b"hello"[..], "`v2.wasm`: this is a text file; expected a WebAssembly component"),
        (b"", "`v2.wasm`: the file is empty; expected a WebAssembly component"),
        (b"\0asm\x01\0\0\0", "`v2.wasm`: this is a core module, not a component"),
    ] {
        refuses(plant().with("v2", bytes), "v2.wasm", why);
    }
}

#[test]
fn a_damaged_component() {
    let good = Counter::new(2).component();
    for cut in [good.len() / 4, good.len() / 2, good.len() - 1] {
        refuses(plant().with("v2", &good[..cut]), "v2.wasm", "`v2.wasm`: the component is damaged: ");
    }
}

#[test]
fn more_memory_than_the_block_may_have() {
    let big = Counter { pages: 100, ..Counter::new(2) };
    refuses(plant().with("v2", &big.component()), "v2.wasm", "limit of 4 MiB");
}

#[test]
fn settings_that_it_refuses() {
    let narrow = Counter::new(2).bad(Bad::RefusesBeyond(0));
    refuses(plant().with("v2", &narrow.component()), "v2.wasm", "refuses its settings: this step is too wide");
    let trap = Counter::new(2).bad(Bad::Configure);
    refuses(plant().with("v2", &trap.component()), "v2.wasm", "configure of test:unit/counter@0.1.0 trapped");
}

#[test]
fn settings_that_it_does_not_have() {
    let v2 = Counter::new(2).component();
    refuses(plant().with("v2", &v2), "v2.wasm settings.stop=2", "no setting `stop`; did you mean `step`?");
    refuses(plant().with("v2", &v2), "v2.wasm settings.step=many", "setting `step`");
}

#[test]
fn a_wire_that_would_lead_nowhere() {
    let first = Counter { double: true, ..Counter::new(1) };
    let rig = || {
        let rig = Rig::new(
            r#"
            [lane.main]
            every = "10ms"
            [driver.field]
            kind = "sim"
            points.shown = { type = "u32", from = "count.outputs.double" }
            [block.count]
            component = "v1.wasm"
            lane = "main"
            [block.other]
            component = "other.wasm"
            lane = "main"
            [block.watch]
            component = "ctu"
            lane = "main"
            inputs.cu = "count.alarms.high"
            [table.all]
            tags = ["count.outputs.*"]
            "#,
        );
        rig.with("v1", &first.component()).with("other", &Counter::new(1).component())
    };
    let told = refused(rig().with("v2", &Counter::new(2).component()), "v2.wasm");
    assert!(told.contains("`field.shown` shows `count.outputs.double`: the new version does not have it"), "{told}");
    assert!(told.contains("[table.all] has `count.outputs.double`"), "{told}");
}

#[test]
fn blocks_of_two_lanes_at_once() {
    let rig = Rig::new(
        "[lane.main]\nevery = \"10ms\"\n[lane.slow]\nevery = \"20ms\"\n[block.count]\ncomponent = \"v1.wasm\"\n\
         lane = \"main\"\n[block.other]\ncomponent = \"v1.wasm\"\nlane = \"slow\"\n",
    );
    let rig = rig.with("v1", &Counter::new(1).component()).with("v2", &Counter::new(2).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm other v2.wasm\n").run_for(2 * S);
    let told = text(&ran, "count", "refused");
    assert!(told.contains("`count` is in lane `main`, `other` in lane `slow`"), "{told}");
    assert_eq!(ran.history("count.outputs.version"), [(0, "1")]);
}

#[test]
fn several_of_which_one_is_refused() {
    for (second, why) in [
        (Counter::new(3).bad(Bad::RefusesBeyond(0)).component(), "refuses its settings: this step is too wide"),
        (Counter { class: "adder", ..Counter::new(3) }.component(), "change of class"),
        (Counter { pages: 100, ..Counter::new(3) }.component(), "limit of 4 MiB"),
        (b"hello".to_vec(), "expected a WebAssembly component"),
    ] {
        // Whichever stands first in the order.
        for order in ["count,v2.wasm other v3.wasm", "other,v3.wasm count v2.wasm"] {
            let rig = plant().with("v2", &Counter::new(2).component()).with("v3", &second);
            let ran = rig.stimulus(&format!("1s,swap.{order}\n")).run_for(2 * S);
            undisturbed(&ran, 200);
            for block in ["count", "other"] {
                assert_eq!(ran.history(&format!("{block}.outputs.version")), [(0, "1")], "{order}: {why}");
            }
            let refused: Vec<_> = ran.records.iter().filter(|r| r.transition == "refused").collect();
            assert!(refused.iter().any(|r| r.text.contains(why)), "{why}: {refused:#?}");
        }
    }
}

#[test]
fn the_same_block_twice_in_one_order_and_in_two() {
    let v2 = Counter::new(2).component();
    refuses(plant().with("v2", &v2), "v2.wasm count v2.wasm", "named twice");
    let rig = plant().with("v2", &v2).with("v3", &Counter::new(3).component());
    let ran = rig.stimulus("1s,swap.count,v2.wasm probation=20\n1.1s,swap.count,v3.wasm\n").run_for(2 * S);
    undisturbed(&ran, 200);
    assert!(text(&ran, "count", "refused").contains("swap 1 of the same block is on probation"));
    assert_eq!(ran.history("count.outputs.version"), [(0, "1"), (S, "2")]);
}

#[test]
fn a_lane_that_has_faulted() {
    let rig = Rig::new(
        "[lane.main]\nevery = \"10ms\"\n[lane.slow]\nevery = \"20ms\"\n[block.count]\ncomponent = \"v1.wasm\"\n\
         lane = \"main\"\non-fault = \"stop-lane\"\n[block.other]\ncomponent = \"v2.wasm\"\nlane = \"slow\"\n",
    );
    let rig = rig.with("v1", &Counter::new(1).bad(Bad::Trap(20)).component());
    let ran = rig.with("v2", &Counter::new(2).component()).stimulus("1s,swap.count,v2.wasm\n").run_for(2 * S);
    assert!(text(&ran, "count", "refused").contains("lane `main` has faulted"));
}

#[test]
fn a_plan_changes_nothing() {
    let ran =
        plant().with("v2", &Counter::new(2).component()).stimulus("1s,swap.count,v2.wasm dry-run\n").run_for(2 * S);
    undisturbed(&ran, 200);
    assert_eq!(told(&ran), [""; 0]);
    assert_eq!(ran.history("count.outputs.version"), [(0, "1")]);
}

#[test]
fn rows_of_a_stimulus_that_mean_nothing() {
    for (row, why) in [
        ("swap.count,v9.wasm", "v9.wasm"),
        ("swap.count,v1.wasm backwards", "means nothing"),
        ("swap.count,v1.wasm shadow=x", "no whole number of executions"),
        ("swap.count,v1.wasm other", "no component for `other`"),
        ("rollback.count,x", "no whole number of versions"),
        ("swap.nobody,v1.wasm", "there is no tag"),
    ] {
        let rows = latchwork_io::stimulus::read(format!("time,tag,value\n1s,{row}\n").as_bytes()).expect("rows");
        let rig = plant();
        let plant = rig.plant(latchwork_plant::assemble::Time::Virtual);
        let errors = latchwork_plant::run::resolve_stimulus(&plant, &rows).expect_err(row);
        assert!(errors[0].to_string().contains(why), "{row}: {errors:?}");
    }
}
