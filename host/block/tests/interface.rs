//! How a class is read from a component: names, order, types, signals, documentation.

mod support;

use latchwork_block::{Class, Port};
use latchwork_image::Type;
use std::fmt::Write;
use support::class::{CLASS, Leaf, Spec, Ty};
use support::component::{dummy, generated, with_section};
use support::evil::{Evil, When};
use support::model::Model;
use support::strategy::Cells;
use support::twins::{Twins, engine, first_scan, next, patient, templates};

fn classes(bytes: &[u8]) -> Vec<Class> {
    let component = engine(None).load_bytes("case", bytes).unwrap_or_else(|e| panic!("{e}"));
    component.classes().cloned().collect()
}

fn wit(items: &str) -> String {
    format!(
        "package acme:line@1.2.3;\ninterface thing {{\n  use latchwork:block/types@0.1.0.{{scan, duration, real-signal, bool-signal, quality}};\n\
         {items}\n}}\nworld w {{ export thing; }}"
    )
}

/// The only input of a class whose input `u` has this type.
fn ports(define: &str, ty: &str) -> Vec<(String, Type, bool)> {
    let items = format!(
        "{define}\nrecord inputs {{ u: {ty} }}\nrecord outputs {{ y: bool }}\nexecute: func(scan: scan, inputs: inputs) -> outputs;"
    );
    let class = classes(&dummy(&[], &wit(&items))).remove(0);
    class.inputs.into_iter().map(|p| (p.path, p.ty, p.signal)).collect()
}

#[test]
fn every_type_of_port() {
    let names = |n: &[&str]| n.iter().map(|s| s.to_string()).collect();
    let table = [
        ("bool", Type::Bool),
        ("u8", Type::U8),
        ("u16", Type::U16),
        ("u32", Type::U32),
        ("u64", Type::U64),
        ("s8", Type::S8),
        ("s16", Type::S16),
        ("s32", Type::S32),
        ("s64", Type::S64),
        ("f32", Type::F32),
        ("f64", Type::F64),
        ("duration", Type::Duration),
        ("mode", Type::Enum(names(&["off", "auto"]))),
        ("parts", Type::Flags(names(&["a", "b-c"]))),
        ("alias", Type::U16),
        ("quality", Type::Enum(names(&["good", "uncertain", "bad"]))),
    ];
    let define = "enum mode { off, auto }\nflags parts { a, b-c }\ntype alias = u16;";
    for (ty, expected) in table {
        assert_eq!(ports(define, ty), [("u".into(), expected, false)], "{ty}");
    }
    assert_eq!(ports("", "real-signal"), [("u".into(), Type::F64, true)]);
    assert_eq!(ports("", "bool-signal"), [("u".into(), Type::Bool, true)]);
    // Fields with a record's own names stay what they are.
    assert_eq!(
        ports("record pair { value: u16, other: bool }", "pair"),
        [("u.value".into(), Type::U16, false), ("u.other".into(), Type::Bool, false)]
    );
    assert_eq!(
        ports("record c { d: u8, e: real-signal }\nrecord b { c: c, f: duration }", "b"),
        [("u.c.d".into(), Type::U8, false), ("u.c.e".into(), Type::F64, true), ("u.f".into(), Type::Duration, false)]
    );
}

const DOCUMENTED: &str = "
    enum mode { off, auto }
    record drive { speed: real-signal, current: f32 }
    record settings { ramp: duration, limit: real-signal }
    record inputs { go: bool, drive: drive, mode: mode }
    flags commands { start, stop }
    record outputs { run: bool-signal, drive: drive }
    flags alarms { jam, hot }
    record retained { hours: f64, last: bool-signal }
    configure: func(settings: settings) -> result<_, string>;
    defaults: func() -> settings;
    execute: func(scan: scan, inputs: inputs, commands: commands) -> tuple<outputs, alarms>;
    save: func() -> retained;
    restore: func(state: retained);
    helper: func(n: u32) -> string;";

const DOCS: &str = r#"{"acme:line/thing@1.2.3": {"class": "A conveyor.\n\nIt conveys.", "ports": {
    "inputs.go": "Run request.", "inputs.drive.speed": "Measured, m/s.", "commands.stop": "Stops.", "alarms.hot": "Too hot.",
    "settings.limit.value": "Upper limit, m/s.", "inputs.nothing": "There is no such port."}},
    "acme:line/other@1.2.3": {"class": "Another."}}"#;

/// A class as a table.
fn table(class: &Class) -> String {
    let mut out = format!("{}: {:?}\n", class.name, class.doc);
    let mut group = |name: &str, ports: &[Port]| {
        for p in ports {
            let signal = if p.signal { " + quality" } else { "" };
            writeln!(out, "{name}.{}: {}{signal}  {}", p.path, p.ty, p.doc.as_deref().unwrap_or("-")).unwrap();
        }
    };
    group("inputs", &class.inputs);
    group("outputs", &class.outputs);
    group("settings", &class.settings);
    group("retained", &class.retained);
    for (group, names) in [("commands", &class.commands), ("alarms", &class.alarms)] {
        for (bit, name) in names.iter().enumerate() {
            writeln!(out, "{group}.{name}: bit {bit}  {}", class.flag_doc(group, name).as_deref().unwrap_or("-"))
                .unwrap();
        }
    }
    writeln!(out, "cells: {} in, {} out", class.argument_cells(), class.output_cells()).unwrap();
    out
}

#[test]
fn a_documented_class() {
    let plain = dummy(&[], &wit(DOCUMENTED));
    let documented = with_section(&plain, "latchwork-docs", DOCS.as_bytes());
    insta::assert_snapshot!(table(&classes(&documented)[0]));
    // Whatever a section holds, ports and types are the same.
    let without = table(&classes(&plain)[0]);
    for damaged in [&b""[..], b"{", b"[1, 2]", b"\xff\xfe", br#"{"acme:line/thing@1.2.3": {"class": 7}}"#] {
        assert_eq!(table(&classes(&with_section(&plain, "latchwork-docs", damaged))[0]), without);
    }
}

#[test]
fn a_component_with_two_classes_and_more() {
    let items = |out: &str| {
        format!(
            "use latchwork:block/types@0.1.0.{{scan}}; record outputs {{ {out}: bool }} execute: func(scan: scan) -> outputs;"
        )
    };
    let bytes = dummy(
        &[],
        &format!(
            "package acme:line; interface b {{ {} }} interface a {{ {} }} interface calc {{ add: func(a: u32) -> u32; }}\n\
             world w {{ export b; export a; export calc; export version: func() -> string; }}",
            items("x"),
            items("y")
        ),
    );
    let mut names: Vec<String> = classes(&bytes).into_iter().map(|c| c.name).collect();
    names.sort();
    assert_eq!(names, ["acme:line/a", "acme:line/b"], "what is no class is ignored");
    let component = engine(None).load_bytes("case", &bytes).unwrap();
    for (name, output) in [("acme:line/a", "y"), ("acme:line/b", "x")] {
        let class = component.class(Some(name)).unwrap();
        assert_eq!(class.outputs[0].path, output);
        let template = component.template(&class).unwrap();
        assert_eq!(template.class().name, name);
    }
}

#[test]
fn what_a_component_says_of_itself() {
    let bytes = dummy(
        &[],
        "package acme:line; interface thing { use latchwork:block/types@0.1.0.{scan}; record outputs { y: bool } \
         execute: func(scan: scan) -> outputs; } world w { import latchwork:block/log@0.1.0; export thing; }",
    );
    let component = engine(None).load_bytes("case", &bytes).unwrap();
    assert_eq!(component.name(), "case");
    assert_eq!(component.size(), bytes.len() as u64);
    assert_eq!(component.imports(), ["latchwork:block/log@0.1.0"], "an interface that holds types alone is no import");
    assert_eq!(component.hash().len(), 64);
    let other = engine(None).load_bytes("other name", &bytes).unwrap();
    assert_eq!(component.hash(), other.hash());
    let changed = with_section(&bytes, "build", b"2");
    assert_ne!(component.hash(), engine(None).load_bytes("case", &changed).unwrap().hash());

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my-block.wasm");
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(engine(None).load_file(&path).unwrap().name(), "my-block");
}

/// A class that only this test knows, with every type a port can have, in every group: values arrive, come back and
/// survive `save` and `restore` into another instance.
#[test]
fn a_class_of_everything_goes_round() {
    let scalars = [
        Leaf::Bool,
        Leaf::U8,
        Leaf::U16,
        Leaf::U32,
        Leaf::U64,
        Leaf::S8,
        Leaf::S16,
        Leaf::S32,
        Leaf::S64,
        Leaf::F32,
        Leaf::F64,
        Leaf::Enum(3),
        Leaf::Enum(300),
        Leaf::Flags(1),
        Leaf::Flags(9),
        Leaf::Flags(32),
    ]
    .map(Ty::Leaf);
    let inner = Ty::Record(vec![Ty::Duration, Ty::RealSignal, Ty::Record(vec![Ty::BoolSignal, Ty::Leaf(Leaf::S8)])]);
    let all: Vec<Ty> = scalars.into_iter().chain([Ty::Duration, Ty::RealSignal, Ty::BoolSignal, inner]).collect();
    let spec = Spec {
        inputs: all.clone(),
        outputs: all.clone(),
        settings: all.clone(),
        commands: 5,
        alarms: 32,
        retained: all,
        defaults: true,
        log: true,
        post_return: true,
        refuses: false,
    };
    let mut twins = Twins::new(templates(&generated(&spec, Evil::None, When(0))), &patient()).unwrap();
    assert_eq!(twins.class().name, CLASS);
    let mut model = Model::new(&spec);
    let (mut cells, mut scan) = (Cells::new(1), first_scan());
    for _ in 0..20 {
        let settings = cells.of(&spec.setting_leaves());
        assert!(model.configure(&settings));
        assert_eq!(twins.configure(&settings), Ok(Ok(())));
        for _ in 0..10 {
            let arguments = cells.of(&spec.argument_leaves());
            let scan = next(&mut scan, &mut cells);
            assert_eq!(twins.execute(scan, &arguments), Ok(model.execute(scan, &arguments)));
        }
        let state = model.save().unwrap();
        assert_eq!(twins.save(), Ok(Some(state.clone())));
        twins.renew();
        assert_eq!(twins.configure(&settings), Ok(Ok(())));
        assert_eq!(twins.restore(&state), Ok(()));
        assert_eq!(twins.defaults(), Ok(model.defaults()));
    }
}

/// Two thousand outputs and as many inputs: far more than anybody has, and still both paths agree.
#[test]
fn a_class_of_thousands_of_ports() {
    let group = Ty::Record(vec![Ty::RealSignal, Ty::Leaf(Leaf::Enum(3)), Ty::Leaf(Leaf::Flags(20)), Ty::Duration]);
    let wide = Ty::Record(vec![Ty::Record(vec![group; 20]); 20]);
    let spec = Spec {
        inputs: vec![wide.clone()],
        outputs: vec![wide],
        commands: 32,
        alarms: 32,
        post_return: true,
        ..Spec::default()
    };
    // The generated guest has room for some hundred parameters only; a dummy answers nothing, but is bound and called.
    let wit = format!("{}\n", spec.wit());
    let bytes = dummy(&[], &wit);
    let mut twins = Twins::new(templates(&bytes), &patient()).unwrap();
    assert_eq!(twins.class().argument_cells(), 2001);
    assert_eq!(twins.execute(first_scan(), &vec![0; 2001]), Err(latchwork_block::FaultKind::Trap));
}
