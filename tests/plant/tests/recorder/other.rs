//! Replays with another component.

use super::*;

fn with(engine: &Engine, counter: &Counter) -> Options {
    let other = engine.load_bytes("counter-2", &counter.component()).expect("a component");
    Options { with: Some(other), ..Options::default() }
}

#[test]
fn with_another_component_the_differences_are_listed() {
    let (_folder, recording) = counter(&Counter::new(1), "10s");
    let engine = engine();
    let other = Counter { off: Some((51, 3)), double: true, ..Counter::new(1) };
    let replayed = again(&recording, "n", &with(&engine, &other));
    assert!(!replayed.equal());
    assert_eq!((replayed.executions, replayed.different), (100, 50), "{replayed:#?}");
    let ports: Vec<_> = replayed.deviations.iter().map(|d| (d.port.as_str(), d.count, d.first, d.worst)).collect();
    assert_eq!(ports, [("outputs.count", 50, 500_000_000, 3.0)]);
    // The same with a tolerance is none.
    let options =
        Options { tolerances: Tolerances::new([("n.outputs.count", 3.0)]).expect("right"), ..with(&engine, &other) };
    assert!(again(&recording, "n", &options).equal());
}

#[test]
fn a_fault_that_only_the_other_component_has_is_told() {
    let (_folder, recording) = counter(&Counter::new(1), "10s");
    let engine = engine();
    let other = Counter::new(1).bad(Bad::Trap(31));
    let replayed = again(&recording, "n", &with(&engine, &other));
    let fault = replayed.fault.as_ref().expect("a fault");
    assert_eq!((fault.kind.as_str(), fault.at), ("trap", 300_000_000));
    assert_eq!(replayed.executions + replayed.skipped, 100);
    assert!(!replayed.equal());
}

#[test]
fn what_the_other_component_cannot_hold_is_told_field_by_field() {
    let (_folder, recording) = counter(&Counter { retained: Some("u64"), ..Counter::new(1) }, "200ms");
    let engine = engine();
    let other = Counter { retained: Some("u32"), ..Counter::new(1) };
    let told = |lossy| {
        let options = Options { from: SECOND / 2, lossy, ..with(&engine, &other) };
        again(&recording, "n", &options).notes
    };
    let note = "retained field `count` would lose something from u64 to u32: it keeps what the other component starts \
                with; --allow-lossy clamps it";
    assert!(told(false).iter().any(|n| n == note), "{:#?}", told(false));
    assert!(!told(true).iter().any(|n| n.contains("lose something")), "{:#?}", told(true));
}
