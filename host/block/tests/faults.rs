//! Limits: whatever a block does, the call comes back, says what happened and has changed nothing.

mod support;

use latchwork_block::{CallPath, Engine, EngineOptions, FaultKind, Instance, Level, Limits, Scan, Ticker};
use std::time::Duration;
use support::class::{Leaf, Spec, Ty};
use support::component::generated;
use support::evil::{Answer, Evil, When};
use support::guest::LOG_LINE;
use support::strategy::Cells;
use support::twins::{Twins, engine, first_scan, next, patient, templates};

const PATHS: [CallPath; 2] = [CallPath::Component, CallPath::Plain];
const SCAN: Scan = Scan { now: 1, elapsed: 0, first: true };

/// Two outputs, so that results stand in memory; as many inputs as make parameters stand there, too.
fn spec() -> Spec {
    Spec {
        inputs: vec![Ty::RealSignal; 8],
        outputs: vec![Ty::Leaf(Leaf::F64), Ty::Leaf(Leaf::Bool)],
        post_return: true,
        ..Spec::default()
    }
}

/// Executes until the fault comes; the executions before it are good ones.
fn fault(evil: Evil, good: u64) -> FaultKind {
    let spec = spec();
    // The good executions before must not be late on a busy machine.
    let limits = if evil == Evil::Loop { Limits { budget_ticks: 60, ..patient() } } else { patient() };
    let mut twins = Twins::new(templates(&generated(&spec, evil, When(good))), &limits).unwrap();
    let (mut cells, mut scan) = (Cells::new(3), first_scan());
    for _ in 0..good {
        let arguments = cells.of(&spec.argument_leaves());
        twins.execute(next(&mut scan, &mut cells), &arguments).expect("it is still good");
    }
    let arguments = cells.of(&spec.argument_leaves());
    let kind = twins.execute(next(&mut scan, &mut cells), &arguments).expect_err("it misbehaves now");
    // New instances of the same templates are as good as ever.
    twins.renew();
    twins.execute(first_scan(), &arguments).expect("a new instance works");
    kind
}

#[test]
fn a_loop_without_end_costs_its_budget() {
    assert_eq!(fault(Evil::Loop, 2), FaultKind::Budget);
}

#[test]
fn a_recursion_without_end_meets_the_end_of_the_stack() {
    assert_eq!(fault(Evil::Recurse, 2), FaultKind::Stack);
}

#[test]
fn memory_ends_at_its_limit() {
    assert_eq!(fault(Evil::GrowForEver, 2), FaultKind::Memory);
}

#[test]
fn traps() {
    for evil in [Evil::Trap, Evil::DivideByZero, Evil::TrapInRealloc] {
        assert_eq!(fault(evil, 2), FaultKind::Trap, "{evil:?}");
    }
}

/// The guest is told that there is no more memory, and takes it well.
#[test]
fn a_refused_growth_that_the_guest_survives() {
    let spec = spec();
    let bytes = generated(&spec, Evil::GrowUntilRefused, When(0));
    let mut twins = Twins::new(templates(&bytes), &patient()).unwrap();
    let arguments = Cells::new(1).of(&spec.argument_leaves());
    for _ in 0..3 {
        twins.execute(SCAN, &arguments).expect("it goes on without");
    }
}

/// A refusal of memory explains the faults of its own call, not those of later ones.
#[test]
fn a_trap_after_a_refused_growth_is_a_trap() {
    let spec = spec();
    let bytes = generated(&spec, Evil::GrowThenTrap, When(0));
    let mut twins = Twins::new(templates(&bytes), &patient()).unwrap();
    let arguments = Cells::new(1).of(&spec.argument_leaves());
    twins.execute(SCAN, &arguments).expect("the growth is refused, and it goes on without");
    assert_eq!(twins.execute(SCAN, &arguments), Err(FaultKind::Trap));
}

fn instances(evil: Evil, limits: &Limits, spec: &Spec) -> Vec<(CallPath, Instance)> {
    let templates = templates(&generated(spec, evil, When(0)));
    templates.iter().map(|t| (t.path(), t.instantiate(limits).unwrap())).collect()
}

fn execute(instance: &mut Instance) -> Result<(), latchwork_block::Fault> {
    let (n, m) = (instance.class().argument_cells(), instance.class().output_cells());
    let ins: Vec<u32> = (0..n as u32).collect();
    instance.execute(SCAN, &ins, n as u32, &mut vec![0; n + m])
}

/// The budget counts the ticks of a call, not those between calls.
#[test]
fn time_between_calls_costs_no_budget() {
    for path in PATHS {
        let engine = Engine::new(EngineOptions { force_path: Some(path), cache: None }).unwrap();
        let spec = Spec { outputs: vec![Ty::Leaf(Leaf::Bool)], ..Spec::default() };
        let component = engine.load_bytes("case", &generated(&spec, Evil::Loop, When(3))).unwrap();
        let template = component.template(&component.class(None).unwrap()).unwrap();
        let mut instance = template.instantiate(&Limits { budget_ticks: 1, ..Limits::default() }).unwrap();
        for _ in 0..3 {
            (0..50).for_each(|_| engine.tick());
            execute(&mut instance).unwrap_or_else(|e| panic!("{path:?}: {e}"));
        }
        // And now it loops: only ticks end it.
        let ticker = Ticker::start(&engine, Duration::from_millis(1));
        assert_eq!(execute(&mut instance).unwrap_err().kind, FaultKind::Budget, "{path:?}");
        drop(ticker);
    }
}

#[test]
fn every_call_has_a_budget_and_refuses_after_a_fault() {
    let spec = Spec {
        outputs: vec![Ty::Leaf(Leaf::Bool)],
        settings: vec![Ty::Leaf(Leaf::F64)],
        retained: vec![Ty::Leaf(Leaf::U32)],
        defaults: true,
        ..Spec::default()
    };
    for (path, mut instance) in instances(Evil::TrapInSave, &patient(), &spec) {
        assert_eq!(instance.save().unwrap_err().kind, FaultKind::Trap, "{path:?}");
        let after = [
            execute(&mut instance).unwrap_err(),
            instance.save().unwrap_err(),
            instance.restore(&[1]).unwrap_err(),
            instance.defaults().unwrap_err(),
            instance.configure(&[0]).unwrap_err(),
        ];
        for fault in after {
            assert!(!fault.message.is_empty(), "{path:?}");
        }
    }
}

/// Messages are bounded in number and length, and what is dropped is counted.
#[test]
fn a_flood_of_messages() {
    let spec = Spec { outputs: vec![Ty::Leaf(Leaf::Bool)], ..Spec::default() };
    for (path, mut instance) in instances(Evil::LogFlood(10_000), &patient(), &spec) {
        for _ in 0..3 {
            execute(&mut instance).unwrap_or_else(|e| panic!("{path:?}: {e}"));
            assert!(instance.has_log());
            let mut lines = 0;
            let dropped = instance.drain_log(|level, _| {
                assert_eq!(level, Level::Warning);
                lines += 1;
            });
            assert!((1..=100).contains(&lines), "{path:?}: {lines} lines kept");
            assert_eq!(lines + dropped, 10_000, "{path:?}");
            assert!(!instance.has_log());
            assert_eq!(instance.drain_log(|_, _| panic!("it was drained")), 0);
        }
        // Nobody drains: memory stays bounded, the count goes on.
        for _ in 0..5 {
            execute(&mut instance).unwrap();
        }
        let mut lines = 0;
        let dropped = instance.drain_log(|_, _| lines += 1);
        assert!(lines <= 100, "{path:?}: {lines} lines kept");
        assert_eq!(lines + dropped, 50_000, "{path:?}");
    }
}

#[test]
fn a_message_of_a_novels_length() {
    let spec = Spec { outputs: vec![Ty::Leaf(Leaf::Bool)], ..Spec::default() };
    // The text starts at 1024; zeros follow, which are UTF-8, too.
    for (path, mut instance) in instances(Evil::LogString(1024, 60_000), &patient(), &spec) {
        execute(&mut instance).unwrap_or_else(|e| panic!("{path:?}: {e}"));
        let mut texts = Vec::new();
        instance.drain_log(|_, text| texts.push(text.to_owned()));
        assert_eq!(texts.len(), 1);
        assert!(texts[0].starts_with(LOG_LINE), "{path:?}: {:?}", &texts[0][..80.min(texts[0].len())]);
        assert!(texts[0].len() <= 1024, "{path:?}: {} bytes kept", texts[0].len());
    }
}

/// There is a longest message and a longest refusal, the same on both paths: to the byte.
#[test]
fn the_longest_text() {
    let spec = Spec { outputs: vec![Ty::Leaf(Leaf::Bool)], settings: vec![Ty::Leaf(Leaf::Bool)], ..Spec::default() };
    let accepted = |evil| {
        let mut twins = Twins::new(templates(&generated(&spec, evil, When(0))), &patient()).unwrap();
        let said = match evil {
            Evil::LogLong(_) => twins.execute(SCAN, &[]).map(drop),
            _ => twins.configure(&[0]).map(|answer| drop(answer.unwrap_err())),
        };
        said != Err(FaultKind::Result)
    };
    for evil in [Evil::LogLong, Evil::RefuseLong] {
        let (mut good, mut bad) = (1000, 600_000);
        assert!(accepted(evil(good)) && !accepted(evil(bad)));
        while bad - good > 1 {
            let middle = (good + bad) / 2;
            *if accepted(evil(middle)) { &mut good } else { &mut bad } = middle;
        }
        assert!((32_000..=128_000).contains(&good), "{:?}", evil(good));
        // The search might have stepped over a gap in which the paths differ.
        for n in good - 64..good + 64 {
            assert_eq!(accepted(evil(n)), n <= good, "{:?}", evil(n));
        }
    }
}

/// `configure` answers with what is no answer.
#[test]
fn answers_that_are_none() {
    let spec = Spec {
        outputs: vec![Ty::Leaf(Leaf::Bool)],
        settings: vec![Ty::Leaf(Leaf::F64)],
        post_return: true,
        ..Spec::default()
    };
    for answer in [
        Answer::Discriminant(2),
        Answer::Discriminant(0xff),
        Answer::Outside,
        Answer::Wraps,
        Answer::InvalidUtf8,
        Answer::At(65526),
        Answer::At(65528),
        Answer::At(0xffff_fffc),
        Answer::At(4098),
    ] {
        let bytes = generated(&spec, Evil::Answer(answer), When(0));
        let mut twins = Twins::new(templates(&bytes), &patient()).unwrap();
        assert_eq!(twins.configure(&[0]), Err(FaultKind::Result), "{answer:?}");
    }
    // The last place where an answer fits; it is zeros: accepted.
    let bytes = generated(&spec, Evil::Answer(Answer::At(65524)), When(0));
    assert_eq!(Twins::new(templates(&bytes), &patient()).unwrap().configure(&[0]), Ok(Ok(())));
}

/// What goes wrong before there is an instance, alike on both paths.
#[test]
fn faults_of_the_start() {
    let starts = [
        (Evil::StartTraps, FaultKind::Trap),
        (Evil::StartLoops, FaultKind::Budget),
        (Evil::DataOutside, FaultKind::Trap),
        (Evil::Pages(17), FaultKind::Memory),
        (Evil::Pages(65536), FaultKind::Memory),
    ];
    for (evil, kind) in starts {
        let limits = Limits { memory: 1 << 20, ..Limits::default() };
        let made = Twins::new(templates(&generated(&spec(), evil, When(0))), &limits);
        assert_eq!(made.err(), Some(kind), "{evil:?}");
    }
    // A start function that logs runs before the tools' own glue is there: only the component path can tell rightly.
    let bytes = generated(&spec(), Evil::StartLogs, When(0));
    let component = engine(None).load_bytes("case", &bytes).unwrap();
    let template = component.template(&component.class(None).unwrap()).unwrap();
    assert_eq!(template.path(), CallPath::Component);
    assert!(template.why_not_plain().is_some_and(|why| why.contains("start function")));
    assert_eq!(template.instantiate(&patient()).unwrap_err().kind, FaultKind::Trap);
}

/// One block's fault is no other's.
#[test]
fn other_instances_go_on() {
    let spec = spec();
    let good = templates(&generated(&spec, Evil::None, When(0)));
    let bad = templates(&generated(&spec, Evil::Recurse, When(0)));
    for (good, bad) in good.iter().zip(&bad) {
        let mut others: Vec<Instance> = (0..3).map(|_| good.instantiate(&patient()).unwrap()).collect();
        for _ in 0..20 {
            let mut instance = bad.instantiate(&patient()).unwrap();
            execute(&mut instance).unwrap_err();
            drop(instance);
            for other in &mut others {
                execute(other).unwrap();
            }
        }
    }
}

#[test]
fn misuse_by_the_host_is_a_panic() {
    let spec = Spec { inputs: vec![Ty::Leaf(Leaf::U8); 2], outputs: vec![Ty::Leaf(Leaf::Bool)], ..Spec::default() };
    for path in PATHS {
        let component = engine(Some(path)).load_bytes("case", &generated(&spec, Evil::None, When(0))).unwrap();
        let template = component.template(&component.class(None).unwrap()).unwrap();
        let misuse: [(&str, &[u32], u32); 4] =
            [("too few", &[0], 2), ("too many", &[0, 1, 0], 2), ("no such cell", &[0, 3], 2), ("no room", &[0, 1], 3)];
        for (name, ins, out) in misuse {
            let mut instance = template.instantiate(&patient()).unwrap();
            let mut cells = [0; 3];
            let done =
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| instance.execute(SCAN, ins, out, &mut cells)));
            assert!(done.is_err(), "{path:?}: {name}: {done:?}");
        }
    }
}
