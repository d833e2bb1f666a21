//! What is said about files that are no blocks. One golden holds all messages: read it as a newcomer would.

mod support;

use latchwork_block::{Engine, Limits};
use std::fmt::Write;
use support::class::{Leaf, Spec, Ty};
use support::component::{dummy, generated, wit_only};
use support::evil::{Evil, When};
use support::twins::engine;

/// The first thing that is wrong, on the way from bytes to an instance.
fn verdict(engine: &Engine, bytes: &[u8], class: Option<&str>, limits: &Limits) -> String {
    let made = engine.load_bytes("case", bytes).and_then(|component| {
        let class = component.class(class)?;
        component.template(&class)
    });
    match made {
        Err(error) => format!("{error}"),
        Ok(template) => match template.instantiate(limits) {
            Err(fault) => format!("{}: {fault}", fault.kind.name()),
            Ok(_) => format!("accepted as {}", template.class().name),
        },
    }
}

/// All cases and what is said about them.
#[derive(Default)]
struct Report(String);

impl Report {
    fn case(&mut self, name: &str, bytes: &[u8]) {
        self.with(name, bytes, None, &Limits::default());
    }

    fn with(&mut self, name: &str, bytes: &[u8], class: Option<&str>, limits: &Limits) {
        let said = verdict(engine(None), bytes, class, limits);
        writeln!(self.0, "{name}\n  {}\n", without_offsets(&said).replace('\n', "\n  ")).unwrap();
    }

    /// A class with these items in its interface.
    fn class(&mut self, name: &str, items: &str) {
        self.case(name, &class(items));
    }
}

fn class(items: &str) -> Vec<u8> {
    dummy(&[], &class_wit(items))
}

fn class_wit(items: &str) -> String {
    format!(
        "package acme:line@1.0.0;\ninterface thing {{\n  use latchwork:block/types@0.1.0.{{scan, duration, real-signal}};\n\
         {items}\n}}\nworld w {{ export thing; }}"
    )
}

/// Offsets and sizes move with every version of the tools that encode the cases.
fn without_offsets(said: &str) -> String {
    match said.split_once("(at byte ").and_then(|(before, rest)| Some((before, rest.split_once(')')?.1))) {
        Some((before, after)) => format!("{before}(at byte … of …){after}"),
        None => said.into(),
    }
}

const EXECUTE: &str = "execute: func(scan: scan, inputs: inputs) -> outputs;";
const OUTPUTS: &str = "record outputs { y: bool }";
const INPUTS: &str = "record inputs { u: bool }";

fn small() -> Spec {
    Spec { outputs: vec![Ty::Leaf(Leaf::Bool), Ty::Leaf(Leaf::U8)], ..Spec::default() }
}

#[test]
fn not_components() {
    let mut r = Report::default();
    let good = generated(&small(), Evil::None, When(0));
    r.case("empty file", b"");
    r.case("text", b"[plant]\nname = \"stairs\"\n");
    r.case("text in UTF-16", &"\u{feff}hello".encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>());
    r.case("component as text", b"(component)\n");
    r.case("an ELF program", b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x03\0>\0");
    r.case("zeros", &[0; 4096]);
    r.case("core module", &wat::parse_str("(module (func (export \"execute\")))").unwrap());
    r.case("cut after the magic number", &good[..4]);
    r.case("cut after the header", &good[..8]);
    r.case("cut in the middle", &good[..good.len() / 2]);
    r.case("cut before the last byte", &good[..good.len() - 1]);
    let mut version = good.clone();
    version[4] = 0xff;
    r.case("unknown version", &version);
    let mut tail = good.clone();
    tail.extend([0xff; 40]);
    r.case("garbage behind the end", &tail);
    r.case("a WIT package without code", &wit_only(&class_wit(&format!("{INPUTS}\n{OUTPUTS}\n{EXECUTE}"))));
    r.case("empty component", &wat::parse_str("(component)").unwrap());
    insta::assert_snapshot!(r.0);
}

#[test]
fn files() {
    let folder = tempfile::tempdir().unwrap();
    let mut seen = String::new();
    let here = folder.path().display().to_string();
    let mut say = |name: &str, path: &std::path::Path| {
        let error = engine(None).load_file(path).expect_err("it is no component");
        writeln!(seen, "{name}\n  {}\n", error.to_string().replace(&here, "FOLDER")).unwrap();
    };
    say("not there", &folder.path().join("no.wasm"));
    say("a folder", folder.path());
    let empty = folder.path().join("empty.wasm");
    std::fs::write(&empty, b"").unwrap();
    say("empty", &empty);
    insta::assert_snapshot!(seen);
}

#[test]
fn components_of_other_worlds() {
    let mut r = Report::default();
    r.case("one function", &dummy(&[], "package acme:other; world w { export run: func() -> u32; }"));
    r.case(
        "an interface that is no class",
        &dummy(
            &[],
            "package acme:other; interface calc { add: func(a: u32, b: u32) -> u32; } world w { export calc; }",
        ),
    );
    let cli = "package wasi:cli@0.2.6; interface environment { get-arguments: func() -> list<string>; } \
               interface run { run: func() -> result; }";
    r.case(
        "a command line program",
        &dummy(&[cli], "package acme:other; world w { import wasi:cli/environment@0.2.6; export wasi:cli/run@0.2.6; }"),
    );
    let types = "package latchwork:block@0.2.0; interface types { record scan { now: u64 } }";
    r.case(
        "a class of another version of the contract",
        &dummy(
            &[types],
            "package acme:other; interface thing { use latchwork:block/types@0.2.0.{scan}; record outputs { y: bool } \
             execute: func(scan: scan) -> outputs; } world w { export thing; }",
        ),
    );
    insta::assert_snapshot!(r.0);
}

#[test]
fn classes_against_the_pattern() {
    let mut r = Report::default();
    r.class("no execute", &format!("{INPUTS}\n{OUTPUTS}\nrun: func(scan: scan, inputs: inputs) -> outputs;"));
    r.class("execute without scan", &format!("{INPUTS}\n{OUTPUTS}\nexecute: func(inputs: inputs) -> outputs;"));
    r.class("scan is another type", &format!("{OUTPUTS}\nexecute: func(scan: u64) -> outputs;"));
    r.class(
        "parameters in another order",
        &format!("{INPUTS}\n{OUTPUTS}\nexecute: func(inputs: inputs, scan: scan) -> outputs;"),
    );
    r.class(
        "a parameter too much",
        &format!("{INPUTS}\n{OUTPUTS}\nexecute: func(scan: scan, inputs: inputs, gain: f64) -> outputs;"),
    );
    r.class(
        "inputs are declared and not taken",
        &format!("{INPUTS}\n{OUTPUTS}\nexecute: func(scan: scan) -> outputs;"),
    );
    r.class("inputs are no record", &format!("type inputs = u32;\n{OUTPUTS}\n{EXECUTE}"));
    r.class("no outputs", &format!("{INPUTS}\nexecute: func(scan: scan, inputs: inputs);"));
    r.class(
        "the result is a bool",
        &format!("{INPUTS}\n{OUTPUTS}\nexecute: func(scan: scan, inputs: inputs) -> bool;"),
    );
    r.class(
        "alarms before outputs",
        &format!("{OUTPUTS}\nflags alarms {{ a }}\nexecute: func(scan: scan) -> tuple<alarms, outputs>;"),
    );
    r.class(
        "alarms are declared and not returned",
        &format!("{OUTPUTS}\nflags alarms {{ a }}\nexecute: func(scan: scan) -> outputs;"),
    );
    r.class("execute may fail", &format!("{OUTPUTS}\nexecute: func(scan: scan) -> result<outputs, string>;"));
    r.class(
        "commands are an enum",
        &format!("enum commands {{ start }}\n{OUTPUTS}\nexecute: func(scan: scan, commands: commands) -> outputs;"),
    );
    let settings = "record settings { gain: f64 }";
    let execute = "execute: func(scan: scan) -> outputs;";
    r.class("settings without configure", &format!("{settings}\n{OUTPUTS}\n{execute}"));
    r.class("configure without settings", &format!("{OUTPUTS}\n{execute}\nconfigure: func() -> result<_, string>;"));
    r.class(
        "configure that cannot refuse",
        &format!("{settings}\n{OUTPUTS}\n{execute}\nconfigure: func(settings: settings);"),
    );
    r.class(
        "configure with a number as its error",
        &format!("{settings}\n{OUTPUTS}\n{execute}\nconfigure: func(settings: settings) -> result<_, u32>;"),
    );
    let configure = "configure: func(settings: settings) -> result<_, string>;";
    r.class(
        "defaults of another type",
        &format!("{settings}\n{OUTPUTS}\n{execute}\n{configure}\ndefaults: func() -> f64;"),
    );
    let retained = "record retained { n: u32 }";
    let (save, restore) = ("save: func() -> retained;", "restore: func(state: retained);");
    r.class("retained without save", &format!("{retained}\n{OUTPUTS}\n{execute}\n{restore}"));
    r.class("retained without restore", &format!("{retained}\n{OUTPUTS}\n{execute}\n{save}"));
    r.class(
        "save and restore without retained",
        &format!("{OUTPUTS}\n{execute}\nsave: func() -> u32;\nrestore: func(n: u32);"),
    );
    r.class(
        "restore of another type",
        &format!("{retained}\n{OUTPUTS}\n{execute}\n{save}\nrestore: func(state: u32);"),
    );
    let names: String = (0..65).map(|i| format!(" \"c{i}\"")).collect();
    r.case("more than 32 flags", &wat::parse_str(format!("(component (type (flags{names})))")).unwrap());
    insta::assert_snapshot!(r.0);
}

#[test]
fn refused_port_types() {
    let mut r = Report::default();
    let types = [
        ("string", "", "string"),
        ("char", "", "char"),
        ("list", "", "list<u8>"),
        ("option", "", "option<f64>"),
        ("result", "", "result<u32>"),
        ("tuple", "", "tuple<u32, bool>"),
        ("variant", "variant v { none, level(f64) }", "v"),
        ("resource", "resource door;", "door"),
        ("borrowed resource", "resource door;", "borrow<door>"),
        ("deep inside", "record b { c: string } record a { b: b, n: u32 }", "a"),
    ];
    for (name, define, ty) in types {
        r.class(name, &format!("{define}\nrecord inputs {{ ok: bool, port: {ty} }}\n{OUTPUTS}\n{EXECUTE}"));
    }
    let doubled: String = (1..14).map(|i| format!("record r{i} {{ a: r{0}, b: r{0} }}\n", i - 1)).collect();
    r.class(
        "more than anybody can wire",
        &format!("record r0 {{ a: f64, b: f64 }}\n{doubled}record inputs {{ port: r13 }}\n{OUTPUTS}\n{EXECUTE}"),
    );
    r.class("in outputs", "record outputs { name: string }\nexecute: func(scan: scan) -> outputs;");
    r.class(
        "in settings",
        &format!(
            "record settings {{ limits: list<f64> }}\n{OUTPUTS}\nexecute: func(scan: scan) -> outputs;\n\
             configure: func(settings: settings) -> result<_, string>;"
        ),
    );
    r.class(
        "in retained",
        &format!(
            "record retained {{ last: option<f64> }}\n{OUTPUTS}\nexecute: func(scan: scan) -> outputs;\n\
             save: func() -> retained;\nrestore: func(state: retained);"
        ),
    );
    insta::assert_snapshot!(r.0);
}

#[test]
fn imports() {
    let mut r = Report::default();
    let mut import = |name: &str, package: &str, import: &str| {
        let wit = format!(
            "package acme:line@1.0.0;\ninterface thing {{\n  use latchwork:block/types@0.1.0.{{scan}};\n{OUTPUTS}\n\
             execute: func(scan: scan) -> outputs;\n}}\nworld w {{ {import} export thing; }}"
        );
        let others: &[&str] = if package.is_empty() { &[] } else { &[package] };
        r.case(name, &dummy(others, &wit));
    };
    import("the log is allowed", "", "import latchwork:block/log@0.1.0;");
    let clocks = "package wasi:clocks@0.2.6; interface wall-clock { now: func() -> u64; }";
    import("WASI", clocks, "import wasi:clocks/wall-clock@0.2.6;");
    let many = "package wasi:filesystem@0.2.6; interface types { open: func(n: u32) -> u32; } \
                interface preopens { get: func() -> u32; }";
    import("two of WASI", many, "import wasi:filesystem/types@0.2.6; import wasi:filesystem/preopens@0.2.6;");
    let own = "package bus:bus@3.1.0; interface can { send: func(id: u32); }";
    import("an interface of its own", own, "import bus:bus/can@3.1.0;");
    import("a function", "", "import random: func() -> u32;");
    import("another class, not composed", "", "import latchwork:device/motor@0.1.0;");
    insta::assert_snapshot!(r.0);
}

#[test]
fn choosing_a_class() {
    let mut r = Report::default();
    let items = |out: &str| {
        format!(
            "use latchwork:block/types@0.1.0.{{scan}}; record outputs {{ {out}: bool }} execute: func(scan: scan) -> outputs;"
        )
    };
    let two = dummy(
        &[],
        &format!(
            "package acme:line@1.0.0; interface pump {{ {} }} interface turbo-pump {{ {} }} world w {{ export pump; export turbo-pump; }}",
            items("a"),
            items("b")
        ),
    );
    let limits = Limits::default();
    r.with("two and none chosen", &two, None, &limits);
    r.with("one of two", &two, Some("acme:line/turbo-pump"), &limits);
    r.with("one of two, with its version", &two, Some("acme:line/pump@1.0.0"), &limits);
    r.with("nearly one of two", &two, Some("acme:line/turbo-pumpe"), &limits);
    r.with("without its package", &two, Some("pump"), &limits);
    r.with("another version", &two, Some("acme:line/pump@2.0.0"), &limits);
    let one = generated(&small(), Evil::None, When(0));
    r.with("the only one is another", &one, Some("latchwork:device/ton"), &limits);
    r.with("nothing", &one, Some(""), &limits);
    insta::assert_snapshot!(r.0);
}

#[test]
fn what_fails_at_instantiation() {
    let mut r = Report::default();
    let limits = Limits { memory: 1 << 20, ..Limits::default() };
    let mut evil = |name: &str, evil| r.with(name, &generated(&small(), evil, When(0)), None, &limits);
    evil("memory as large as the limit", Evil::Pages(16));
    evil("memory larger than the limit", Evil::Pages(17));
    evil("memory of 4 GiB", Evil::Pages(65536));
    evil("two memories", Evil::TwoMemories);
    evil("start function traps", Evil::StartTraps);
    evil("start function never ends", Evil::StartLoops);
    evil("data outside of memory", Evil::DataOutside);
    insta::assert_snapshot!(r.0);
}
