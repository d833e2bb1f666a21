//! Small components made to measure: versions of one counter, good and bad.
//!
//! The counter adds `settings.step` at each execution unless `inputs.hold` is true; its count is what a swap must neither lose
//! nor repeat. A version may have other ports, another type of its count, and misbehave from some execution on.

use std::path::Path;
use wit_component::{ComponentEncoder, StringEncoding, embed_component_metadata};
use wit_parser::{Resolve, SourceMap};

/// How a version misbehaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bad {
    /// Not at all.
    No,
    /// It traps in this execution of the instance, from 1.
    Trap(u64),
    /// It loops in it.
    Loop(u64),
    /// It wants more memory than it may have in it, and traps without.
    Grow(u64),
    /// It refuses steps beyond this one.
    RefusesBeyond(u32),
    /// It traps when it is configured.
    Configure,
    /// It traps when its state is saved after an execution.
    Save,
    /// It traps when its state is saved after more executions than these.
    SaveAfter(u64),
    /// It loops when its state is saved after an execution.
    SaveForEver,
    /// It traps when it gets a state.
    Restore,
    /// It traps when it gets a state with a count beyond this one.
    RestoreBeyond(u32),
    /// It takes long when it gets a state.
    RestoreSlowly,
}

/// A version of the counter.
#[derive(Clone, Debug)]
pub struct Counter {
    /// What it says of itself: `outputs.version`.
    pub version: u32,
    /// Name of its class, `counter` if it is one.
    pub class: &'static str,
    /// Version of its class.
    pub class_version: &'static str,
    /// Type of the count in its retained state; none without one.
    pub retained: Option<&'static str>,
    /// Further fields of its settings: name and type, one flat value each.
    pub settings: &'static [(&'static str, &'static str)],
    /// Further fields of its inputs: name and type, one flat value each.
    pub inputs: &'static [(&'static str, &'static str)],
    /// It has the output `elapsed`.
    pub elapsed: bool,
    /// A further output, twice the count.
    pub double: bool,
    /// Added to the count that it shows, from this execution on, from 1.
    pub off: Option<(u64, u32)>,
    /// The step it proposes itself.
    pub default_step: u32,
    /// How it misbehaves.
    pub bad: Bad,
    /// Memory it begins with, pages of 64 KiB.
    pub pages: u32,
}

impl Counter {
    /// A good one.
    pub fn new(version: u32) -> Self {
        Self {
            version,
            class: "counter",
            class_version: "0.1.0",
            retained: Some("u32"),
            settings: &[],
            inputs: &[],
            elapsed: true,
            double: false,
            off: None,
            default_step: 1,
            bad: Bad::No,
            pages: 1,
        }
    }

    /// The same, misbehaving.
    pub fn bad(self, bad: Bad) -> Self {
        Self { bad, ..self }
    }

    /// Its component.
    ///
    /// # Panics
    /// If the text it is made from is wrong.
    pub fn component(&self) -> Vec<u8> {
        component(&self.wit(), &self.wat())
    }

    fn wit(&self) -> String {
        let fields = |list: &[(&str, &str)]| list.iter().map(|(n, ty)| format!(", {n}: {ty}")).collect::<String>();
        let state = |ty: &str| {
            format!("record retained {{ count: {ty} }}\nsave: func() -> retained;\nrestore: func(state: retained);\n")
        };
        let Self { class, class_version, .. } = self;
        format!(
            "package test:unit@{class_version};\ninterface {class} {{\nuse latchwork:block/types@0.1.0.{{scan}};\n\
             record settings {{ step: u32{} }}\nrecord inputs {{ hold: bool{} }}\nflags commands {{ clear }}\n\
             record outputs {{ count: u32, version: u32{}{}, first: bool }}\nflags alarms {{ high }}\n{}\
             configure: func(settings: settings) -> result<_, string>;\ndefaults: func() -> settings;\n\
             execute: func(scan: scan, inputs: inputs, commands: commands) -> tuple<outputs, alarms>;\n}}\n\
             world w {{ export {class}; }}\n",
            fields(self.settings),
            fields(self.inputs),
            if self.double { ", double: u32" } else { "" },
            if self.elapsed { ", elapsed: u64" } else { "" },
            self.retained.map(state).unwrap_or_default(),
        )
    }

    fn wat(&self) -> String {
        let name = format!("test:unit/{}@{}", self.class, self.class_version);
        let Self { version, pages, bad, default_step, .. } = self;
        let flat = |ty: &str| match ty {
            "u64" | "s64" => "i64",
            "f32" => "f32",
            "f64" => "f64",
            _ => "i32",
        };
        let params =
            |list: &[(&str, &str)]| list.iter().map(|(_, ty)| format!("(param {})", flat(ty))).collect::<String>();
        let at = |n: u64, what: &str| format!("(if (i64.eq (global.get $n) (i64.const {n})) (then {what}))");
        let execute = match bad {
            Bad::Trap(n) => at(*n, "unreachable"),
            Bad::Loop(n) => at(*n, "(loop $l (br $l))"),
            Bad::Grow(n) => at(*n, "(if (i32.eq (memory.grow (i32.const 4096)) (i32.const -1)) (then unreachable))"),
            _ => String::new(),
        };
        let configure = match bad {
            Bad::Configure => "unreachable".to_owned(),
            Bad::RefusesBeyond(most) => format!(
                "(if (i32.gt_u (local.get 0) (i32.const {most})) (then (i32.store (i32.const 64) (i32.const 1)) \
                 (return (i32.const 64))))"
            ),
            _ => String::new(),
        };
        // Outputs: count, version, [double], [elapsed], first; then the alarms.
        let (mut at, mut store) = (8, String::new());
        if self.double {
            store += &format!(
                "(i32.store (i32.const {}) (i32.mul (i32.wrap_i64 (global.get $count)) (i32.const 2)))\n",
                256 + at
            );
            at += 4;
        }
        let mut align = 4;
        if self.elapsed {
            at = (at + 7) & !7;
            store += &format!("(i64.store (i32.const {}) (local.get 1))\n", 256 + at);
            at += 8;
            align = 8;
        }
        store += &format!("(i32.store8 (i32.const {}) (local.get 2))\n", 256 + at);
        let alarms = (at + 1 + align - 1) & !(align - 1);
        store +=
            &format!("(i32.store8 (i32.const {}) (i64.ge_u (global.get $count) (i64.const 1000000)))\n", 256 + alarms);
        let off = match self.off {
            Some((from, off)) => format!("(i32.mul (i32.const {off}) (i64.ge_u (global.get $n) (i64.const {from})))"),
            None => "(i32.const 0)".into(),
        };
        let state = match self.retained {
            None => String::new(),
            Some(ty) => {
                let (to, from) = match flat(ty) {
                    "i64" => ("(global.get $count)", "(local.get 0)"),
                    "f64" => ("(f64.convert_i64_u (global.get $count))", "(i64.trunc_f64_u (local.get 0))"),
                    "f32" => ("(f32.convert_i64_u (global.get $count))", "(i64.trunc_f32_u (local.get 0))"),
                    _ => ("(i32.wrap_i64 (global.get $count))", "(i64.extend_i32_u (local.get 0))"),
                };
                let beyond = |n: u64, what| format!("(if (i64.gt_u (global.get $n) (i64.const {n})) (then {what}))");
                let save = match bad {
                    Bad::Save => beyond(0, "unreachable"),
                    Bad::SaveAfter(n) => beyond(*n, "unreachable"),
                    Bad::SaveForEver => beyond(0, "(loop $l (br $l))"),
                    _ => String::new(),
                };
                let restore = match bad {
                    Bad::Restore => "unreachable".to_owned(),
                    Bad::RestoreBeyond(most) => {
                        format!("(if (i64.gt_u {from} (i64.const {most})) (then unreachable))")
                    }
                    Bad::RestoreSlowly => "(local $left i64) (local.set $left (i64.const 25000000)) (loop $l \
                        (local.set $left (i64.sub (local.get $left) (i64.const 1))) \
                        (br_if $l (i64.ne (local.get $left) (i64.const 0))))"
                        .to_owned(),
                    _ => String::new(),
                };
                let flat = flat(ty);
                format!(
                    "(func (export \"{name}#save\") (result {flat}) {save} {to})\n\
                     (func (export \"{name}#restore\") (param {flat}) {restore} (global.set $count {from}))\n"
                )
            }
        };
        let commands = 4 + self.inputs.len();
        // Settings with one field are one flat result; more stand in memory.
        let defaults = if self.settings.is_empty() {
            format!("(i32.const {default_step})")
        } else {
            format!("(i32.store (i32.const 512) (i32.const {default_step})) (i32.const 512)")
        };
        format!(
            r#"(module
(memory (export "memory") {pages})
(data (i32.const 128) "this step is too wide")
(data (i32.const 68) "\80\00\00\00\15\00\00\00")
(global $count (mut i64) (i64.const 0))
(global $n (mut i64) (i64.const 0))
(global $step (mut i64) (i64.const 1))
(func (export "cabi_realloc") (param i32 i32 i32 i32) (result i32) (i32.const 1024))
(func (export "{name}#configure") (param i32) {settings} (result i32)
  {configure}
  (global.set $step (i64.extend_i32_u (local.get 0)))
  (i32.store (i32.const 64) (i32.const 0))
  (i32.const 64))
(func (export "{name}#defaults") (result i32) {defaults})
(func (export "{name}#execute") (param i64 i64 i32 i32) {inputs} (param i32) (result i32)
  (global.set $n (i64.add (global.get $n) (i64.const 1)))
  {execute}
  (if (i32.eqz (local.get 3)) (then (global.set $count (i64.add (global.get $count) (global.get $step)))))
  (if (local.get {commands}) (then (global.set $count (i64.const 0))))
  (i32.store (i32.const 256) (i32.add (i32.wrap_i64 (global.get $count)) {off}))
  (i32.store (i32.const 260) (i32.const {version}))
  {store}
  (i32.const 256))
{state})"#,
            settings = params(self.settings),
            inputs = params(self.inputs),
        )
    }
}

/// A component out of the WIT text of its package, whose only world is `w`, and a core module as text.
///
/// # Panics
/// If one of them is wrong.
pub fn component(wit: &str, wat: &str) -> Vec<u8> {
    let mut resolve = Resolve::default();
    let mut push = |texts: &[(&str, &str)]| {
        let mut map = SourceMap::default();
        for (path, text) in texts {
            map.push(Path::new(path), *text);
        }
        let group = map.parse().unwrap_or_else(|(_, e)| panic!("{e:?}\n{texts:?}"));
        resolve.push_group(group).unwrap_or_else(|e| panic!("{e:#}\n{texts:?}"))
    };
    for package in latchwork_wit::PACKAGES {
        push(package.files);
    }
    let package = push(&[("test.wit", wit)]);
    let world = resolve.select_world(&[package], Some("w")).unwrap_or_else(|e| panic!("{e:#}\n{wit}"));
    let mut module = wat::parse_str(wat).unwrap_or_else(|e| panic!("{e}\n{wat}"));
    embed_component_metadata(&mut module, &resolve, world, StringEncoding::UTF8).expect("metadata");
    let encoder = ComponentEncoder::default().module(&module).unwrap_or_else(|e| panic!("{e:#}\n{wit}"));
    encoder.validate(true).encode().unwrap_or_else(|e| panic!("{e:#}\n{wit}\n{wat}"))
}
