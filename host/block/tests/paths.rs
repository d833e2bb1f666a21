//! Both call paths do the same: on generated classes, on hostile guests and on every shipped component.

mod support;

use latchwork_block::{Class, FaultKind};
use proptest::prelude::*;
use std::fmt::Write;
use std::path::Path;
use support::class::{Leaf, Spec, Ty};
use support::component::generated;
use support::evil::{self, Evil, When};
use support::guest::REFUSAL_LINE;
use support::model::Model;
use support::shipped::shipped;
use support::strategy::{self, Cells};
use support::twins::{
    self, Twins, argument_leaves, engine, first_scan, leaves, next, patient, result_leaves, templates,
};

/// One call.
#[derive(Clone, Copy, Debug)]
enum Op {
    Execute,
    Configure,
    Defaults,
    /// Saves, makes a new instance and restores into it.
    Move,
}

fn ops() -> impl Strategy<Value = Vec<Op>> {
    let op =
        prop_oneof![6 => Just(Op::Execute), 1 => Just(Op::Configure), 1 => Just(Op::Defaults), 1 => Just(Op::Move)];
    prop::collection::vec(op, 1..24)
}

proptest! {
    #![proptest_config(strategy::config(200))]

    /// Good guests: both paths give what the model gives.
    #[test]
    fn generated_guests_answer_as_the_model(spec in strategy::spec(), ops in ops(), seed: u64) {
        let bytes = generated(&spec, Evil::None, When(0));
        let mut twins = Twins::new(templates(&bytes), &patient()).unwrap();
        prop_assert_eq!(argument_leaves(twins.class()), spec.argument_leaves());
        prop_assert_eq!(result_leaves(twins.class()), spec.result_leaves());
        prop_assert_eq!(leaves(&twins.class().settings), spec.setting_leaves());
        prop_assert_eq!(leaves(&twins.class().retained), spec.retained_leaves());
        let mut model = Model::new(&spec);
        let (mut cells, mut scan) = (Cells::new(seed), first_scan());
        for op in ops {
            match op {
                Op::Execute => {
                    let arguments = cells.of(&spec.argument_leaves());
                    let now = next(&mut scan, &mut cells);
                    let logs = twins.logs;
                    prop_assert_eq!(twins.execute(now, &arguments), Ok(model.execute(now, &arguments)));
                    prop_assert_eq!(twins.logs - logs, u64::from(spec.log));
                }
                Op::Configure => {
                    let settings = cells.of(&spec.setting_leaves());
                    let taken = settings.is_empty() || model.configure(&settings);
                    let answer = if taken { Ok(()) } else { Err(REFUSAL_LINE.to_string()) };
                    prop_assert_eq!(twins.configure(&settings), Ok(answer));
                }
                Op::Defaults => prop_assert_eq!(twins.defaults(), Ok(model.defaults())),
                Op::Move => {
                    let state = model.save();
                    prop_assert_eq!(twins.save(), Ok(state.clone()));
                    twins.renew();
                    model = Model::new(&spec);
                    if let Some(state) = state {
                        model.restore(&state);
                        prop_assert_eq!(twins.restore(&state), Ok(()));
                    }
                }
            }
        }
    }

    /// Hostile guests: the same results before, the same fault, or none, after.
    #[test]
    fn hostile_guests_are_treated_alike(
        spec in strategy::spec(),
        evil in prop::sample::select(evil::ALL),
        when in 1..4u64,
        seed: u64,
    ) {
        let bytes = generated(&spec, evil, When(when));
        let mut twins = Twins::new(templates(&bytes), &patient()).unwrap();
        let (mut cells, mut scan) = (Cells::new(seed), first_scan());
        for _ in 0..6 {
            let arguments = cells.of(&spec.argument_leaves());
            match twins.execute(next(&mut scan, &mut cells), &arguments) {
                Ok(results) => {
                    for (leaf, cell) in spec.result_leaves().iter().zip(results) {
                        prop_assert_eq!(leaf.normal(cell), cell, "{:?} {:#x} is no legal cell", leaf, cell);
                    }
                }
                Err(_) => return Ok(()),
            }
        }
        match twins.save() {
            Ok(state) => prop_assert_eq!(state.is_some(), !spec.retained.is_empty()),
            Err(kind) => prop_assert_eq!((kind, evil), (FaultKind::Trap, Evil::TrapInSave)),
        }
    }
}

/// Classes that take every way through a call: parameters flat or in memory, cleaning up or not, results flat or in memory.
fn ways() -> Vec<(&'static str, Spec)> {
    let leaf = |leaf| vec![Ty::Leaf(leaf)];
    let results = || {
        let all = [
            Leaf::Bool,
            Leaf::Enum(3),
            Leaf::Enum(300),
            Leaf::Flags(3),
            Leaf::Flags(9),
            Leaf::Flags(17),
            Leaf::F32,
            Leaf::S8,
            Leaf::U16,
        ];
        all.map(Ty::Leaf).into_iter().chain([Ty::RealSignal]).collect::<Vec<_>>()
    };
    let lean = Spec { inputs: vec![Ty::RealSignal; 3], outputs: results(), alarms: 3, ..Spec::default() };
    let flat = |result| Spec { outputs: leaf(result), inputs: vec![Ty::RealSignal], ..Spec::default() };
    vec![
        ("lean", lean.clone()),
        ("cleaning up", Spec { post_return: true, ..lean.clone() }),
        ("many inputs", Spec { inputs: vec![Ty::RealSignal; 8], retained: leaf(Leaf::U64), post_return: true, ..lean }),
        ("one bool", flat(Leaf::Bool)),
        ("one enum", flat(Leaf::Enum(3))),
        ("one flags", flat(Leaf::Flags(9))),
        ("one u8", flat(Leaf::U8)),
        ("one s16", flat(Leaf::S16)),
        ("one f32", flat(Leaf::F32)),
        ("one f64 and cleaning up", Spec { post_return: true, ..flat(Leaf::F64) }),
    ]
}

/// What each hostile guest gets, on every way through a call.
#[test]
fn faults_of_hostile_guests() {
    let mut seen = String::new();
    for evil in evil::ALL {
        writeln!(seen, "{evil:?}").unwrap();
        let mut answers: Vec<(String, Vec<&str>)> = Vec::new();
        for (way, spec) in ways() {
            let said = said(&spec, *evil);
            match answers.iter_mut().find(|(known, _)| *known == said) {
                Some((_, ways)) => ways.push(way),
                None => answers.push((said, vec![way])),
            }
        }
        if let [(said, _)] = &answers[..] {
            writeln!(seen, "  {said}").unwrap();
        } else {
            for (said, ways) in answers {
                writeln!(seen, "  {}\n    {said}", ways.join(", ")).unwrap();
            }
        }
    }
    insta::assert_snapshot!(seen);
}

/// Executes until there is a fault, and says which, on each path if the texts differ.
fn said(spec: &Spec, evil: Evil) -> String {
    let mut twins = Twins::new(templates(&generated(spec, evil, When(1))), &patient()).unwrap();
    let (mut cells, mut scan) = (Cells::new(7), first_scan());
    for n in 0..4 {
        let arguments = cells.of(&spec.argument_leaves());
        match twins.execute(next(&mut scan, &mut cells), &arguments) {
            Ok(results) => {
                for (leaf, cell) in spec.result_leaves().iter().zip(results) {
                    assert_eq!(leaf.normal(cell), cell, "{evil:?}: {leaf:?} {cell:#x} is no legal cell");
                }
            }
            Err(kind) => {
                assert!(n > 0, "{evil:?}: the first execution is a good one");
                let [a, b] = &twins.last_messages;
                let differs = if a == b { String::new() } else { format!("; on the plain path: {b}") };
                return format!("{}: {a}{differs}", kind.name());
            }
        }
    }
    format!("no fault; {} messages", twins.logs)
}

// ---- shipped components ----

#[test]
fn shipped_components() {
    for path in shipped("components") {
        exercise(&path);
    }
}

#[test]
fn components_of_the_tests() {
    // `save` of `defects` changes its state: that is what it is for.
    for path in shipped("test-components").into_iter().filter(|p| !p.ends_with("defects.wasm")) {
        exercise(&path);
    }
}

/// Random calls to every class of a component that can take the plain path; the others are executed on theirs.
fn exercise(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    let component = engine(None).load_file(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    for class in component.classes() {
        println!("{} {}", path.display(), class.name);
        let both = [latchwork_block::CallPath::Component, latchwork_block::CallPath::Plain].map(|p| {
            let component = engine(Some(p)).load_bytes("twin", &bytes).unwrap();
            component.template(&component.class(Some(&class.name)).unwrap()).unwrap_or_else(|e| panic!("{e}"))
        });
        for seed in 0..40 {
            exercise_class(class, Twins::new(both.clone(), &patient()).unwrap(), seed);
        }
    }
}

fn exercise_class(class: &Class, mut twins: Twins, seed: u64) {
    let (mut cells, mut scan) = (Cells::new(seed), first_scan());
    let (settings, arguments) = (leaves(&class.settings), argument_leaves(class));
    for step in 0..60 {
        let settled = match twins::pick(cells.bits(), step) {
            0 => twins.configure(&cells.of(&settings)).map(drop),
            1 => twins.defaults().map(|d| {
                assert!(d.is_none() || !class.settings.is_empty());
            }),
            2 => twins.save().and_then(|state| {
                twins.renew();
                assert_eq!(state.is_some(), !class.retained.is_empty());
                let Some(state) = state else { return Ok(()) };
                twins.restore(&state)?;
                assert_eq!(twins.save()?, Some(state), "{}: a state does not come back as it was", class.name);
                Ok(())
            }),
            _ => {
                let mut arguments = cells.of(&arguments);
                keep_short(class, &mut arguments);
                twins.execute(next(&mut scan, &mut cells), &arguments).map(drop)
            }
        };
        if settled.is_err() {
            twins.renew();
        }
    }
}

/// Takes the loops out of what `stress` is told to do: how long one runs is a matter of the clock, and not of the path.
/// The ends of loops are in `faults.rs`.
fn keep_short(class: &Class, arguments: &mut [u64]) {
    let input = |name: &str| class.inputs.iter().position(|p| p.path == name);
    if let Some(burn) = input("burn") {
        arguments[burn] %= 1000;
    }
    if let Some(fault) = input("fault")
        && class.inputs[fault].ty.format(arguments[fault]) == "endless-loop"
    {
        arguments[fault] = 0;
    }
    if let (Some(bit), Some(word)) = (class.commands.iter().position(|c| c == "endless-loop"), arguments.last_mut()) {
        *word &= !(1 << bit);
    }
}
