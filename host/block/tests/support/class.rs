//! A device class as tests describe it: types of ports, their canonical-ABI layout and the WIT text.
//!
//! Layout is computed here from the specification of the canonical ABI and not with the crate under test: it is the
//! second opinion.

use std::fmt::Write;

/// WIT package and interface of every generated class.
pub const CLASS: &str = "made:up/thing";

/// Type of a port.
#[derive(Clone, Debug, PartialEq)]
pub enum Ty {
    Leaf(Leaf),
    Duration,
    RealSignal,
    BoolSignal,
    Record(Vec<Ty>),
}

/// A scalar of the canonical ABI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Leaf {
    Bool,
    U8,
    U16,
    U32,
    U64,
    S8,
    S16,
    S32,
    S64,
    F32,
    F64,
    /// Number of cases.
    Enum(u16),
    /// Number of flags.
    Flags(u8),
}

/// Core type of a flat value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flat {
    I32,
    I64,
    F32,
    F64,
}

impl Flat {
    pub fn name(self) -> &'static str {
        match self {
            Self::I32 => "i32",
            Self::I64 => "i64",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

impl Leaf {
    /// Size and alignment in memory.
    pub fn size(self) -> u32 {
        match self {
            Self::Bool | Self::U8 | Self::S8 | Self::Flags(0..=8) | Self::Enum(0..=256) => 1,
            Self::U16 | Self::S16 | Self::Flags(9..=16) | Self::Enum(_) => 2,
            Self::U32 | Self::S32 | Self::F32 | Self::Flags(_) => 4,
            Self::U64 | Self::S64 | Self::F64 => 8,
        }
    }

    pub fn flat(self) -> Flat {
        match self {
            Self::U64 | Self::S64 => Flat::I64,
            Self::F32 => Flat::F32,
            Self::F64 => Flat::F64,
            _ => Flat::I32,
        }
    }

    /// Any bits as a legal cell of this type.
    pub fn normal(self, bits: u64) -> u64 {
        let signed = |i: i32| u64::from(i.cast_unsigned());
        match self {
            Self::Bool => bits & 1,
            Self::U8 => bits & 0xff,
            Self::U16 => bits & 0xffff,
            Self::U32 | Self::S32 | Self::F32 => bits & 0xffff_ffff,
            Self::S8 => signed((bits as i8).into()),
            Self::S16 => signed((bits as i16).into()),
            Self::U64 | Self::S64 | Self::F64 => bits,
            Self::Enum(n) => bits % u64::from(n),
            Self::Flags(n) => bits & ((1 << n) - 1),
        }
    }

    /// A value for a test: every fourth at an edge of the type.
    pub fn value(self, bits: u64) -> u64 {
        let edges: &[u64] = match self {
            Self::F32 => &[
                0,
                0x8000_0000,
                0x7f80_0000,
                0xff80_0000,
                0x7fc0_0000,
                0x7f80_0001,
                0xffbf_ffff,
                1,
                0x3f80_0000,
                0x7f7f_ffff,
            ],
            Self::F64 => &[
                0,
                1 << 63,
                0x7ff0_0000_0000_0000,
                0xfff0_0000_0000_0000,
                0x7ff8_0000_0000_0000,
                0x7ff0_0000_0000_0001,
                0xfff7_ffff_ffff_ffff,
                1,
                0x3ff0_0000_0000_0000,
                0x7fef_ffff_ffff_ffff,
            ],
            _ => &[0, 1, u64::MAX, 0x7f, 0x80, 0x7fff, 0x8000, 0x7fff_ffff, 0x8000_0000, 1 << 63],
        };
        if bits.is_multiple_of(4) { self.normal(edges[(bits >> 2) as usize % edges.len()]) } else { self.normal(bits) }
    }
}

impl Ty {
    /// The leaves in the order of the canonical ABI, appended with their offsets; returns size and alignment.
    pub fn layout(&self, base: u32, out: &mut Vec<(Leaf, u32)>) -> (u32, u32) {
        match self {
            Self::Leaf(leaf) => {
                out.push((*leaf, base));
                (leaf.size(), leaf.size())
            }
            Self::Duration => Self::record_layout(&[Self::Leaf(Leaf::U64)], base, out),
            Self::RealSignal => Self::record_layout(&[Self::Leaf(Leaf::F64), Self::Leaf(Leaf::Enum(3))], base, out),
            Self::BoolSignal => Self::record_layout(&[Self::Leaf(Leaf::Bool), Self::Leaf(Leaf::Enum(3))], base, out),
            Self::Record(fields) => Self::record_layout(fields, base, out),
        }
    }

    fn record_layout(fields: &[Self], base: u32, out: &mut Vec<(Leaf, u32)>) -> (u32, u32) {
        let (mut at, mut align) = (0u32, 1);
        for field in fields {
            let a = field.layout(0, &mut Vec::new()).1;
            at = at.next_multiple_of(a);
            at += field.layout(base + at, out).0;
            align = align.max(a);
        }
        (at.next_multiple_of(align), align)
    }

    /// The leaves alone.
    pub fn leaves(&self) -> Vec<Leaf> {
        let mut out = Vec::new();
        self.layout(0, &mut out);
        out.into_iter().map(|(leaf, _)| leaf).collect()
    }
}

/// A class with its parts; an empty list is a part the class has not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spec {
    pub inputs: Vec<Ty>,
    pub outputs: Vec<Ty>,
    pub settings: Vec<Ty>,
    pub commands: u8,
    pub alarms: u8,
    pub retained: Vec<Ty>,
    /// The class has `defaults`; only with settings.
    pub defaults: bool,
    /// The guest logs in every execution.
    pub log: bool,
    /// Every function with a result has a post-return.
    pub post_return: bool,
    /// `configure` refuses some settings.
    pub refuses: bool,
}

/// A function: flattened parameters and the type of its result.
pub struct Signature {
    pub params: Vec<Ty>,
    pub result: Option<Ty>,
}

impl Spec {
    pub fn execute(&self) -> Signature {
        let time = || Ty::Leaf(Leaf::U64);
        let mut params = vec![Ty::Record(vec![time(), time(), Ty::Leaf(Leaf::Bool)])];
        if !self.inputs.is_empty() {
            params.push(Ty::Record(self.inputs.clone()));
        }
        if self.commands > 0 {
            params.push(Ty::Leaf(Leaf::Flags(self.commands)));
        }
        let outputs = Ty::Record(self.outputs.clone());
        let result = match self.alarms {
            0 => outputs,
            n => Ty::Record(vec![outputs, Ty::Leaf(Leaf::Flags(n))]),
        };
        Signature { params, result: Some(result) }
    }

    /// Cells that `execute` reads: input leaves, then the commands.
    pub fn argument_leaves(&self) -> Vec<Leaf> {
        self.execute().params[1..].iter().flat_map(Ty::leaves).collect()
    }

    /// Cells that `execute` writes: output leaves, then the alarms.
    pub fn result_leaves(&self) -> Vec<Leaf> {
        self.execute().result.map(|r| r.leaves()).unwrap_or_default()
    }

    pub fn setting_leaves(&self) -> Vec<Leaf> {
        Ty::Record(self.settings.clone()).leaves()
    }

    pub fn retained_leaves(&self) -> Vec<Leaf> {
        Ty::Record(self.retained.clone()).leaves()
    }

    /// The WIT package of the class, with a world that exports it.
    pub fn wit(&self) -> String {
        let mut types = String::new();
        let mut record = |name: &str, fields: &[Ty], letter: char| {
            if !fields.is_empty() {
                define(name, fields, letter, &mut types);
            }
        };
        record("inputs", &self.inputs, 'i');
        record("outputs", &self.outputs, 'o');
        record("settings", &self.settings, 'p');
        record("retained", &self.retained, 'r');
        for (name, letter, n) in [("commands", 'c', self.commands), ("alarms", 'a', self.alarms)] {
            if n > 0 {
                writeln!(types, "  flags {name} {{ {} }}", names(letter, n.into())).unwrap();
            }
        }
        let mut functions = String::new();
        if !self.settings.is_empty() {
            functions += "  configure: func(settings: settings) -> result<_, string>;\n";
            if self.defaults {
                functions += "  defaults: func() -> settings;\n";
            }
        }
        let inputs = if self.inputs.is_empty() { "" } else { ", inputs: inputs" };
        let commands = if self.commands == 0 { "" } else { ", commands: commands" };
        let result = if self.alarms == 0 { "outputs" } else { "tuple<outputs, alarms>" };
        writeln!(functions, "  execute: func(scan: scan{inputs}{commands}) -> {result};").unwrap();
        if !self.retained.is_empty() {
            functions += "  save: func() -> retained;\n  restore: func(state: retained);\n";
        }
        let log = if self.log { "  import latchwork:block/log@0.1.0;\n" } else { "" };
        format!(
            "package made:up;\ninterface thing {{\n  use latchwork:block/types@0.1.0.{{scan, duration, real-signal, \
             bool-signal}};\n{types}{functions}}}\nworld w {{\n{log}  export thing;\n}}\n"
        )
    }
}

fn names(letter: char, n: u16) -> String {
    (0..n).map(|i| format!("{letter}{i}")).collect::<Vec<_>>().join(", ")
}

/// Writes a record's definition, the types of its fields first.
fn define(name: &str, fields: &[Ty], letter: char, out: &mut String) {
    let mut body = Vec::new();
    for (i, field) in fields.iter().enumerate() {
        let own = format!("{name}-{letter}{i}");
        let ty = match field {
            Ty::Leaf(Leaf::Enum(n)) => {
                writeln!(out, "  enum {own} {{ {} }}", names('e', *n)).unwrap();
                own
            }
            Ty::Leaf(Leaf::Flags(n)) => {
                writeln!(out, "  flags {own} {{ {} }}", names('f', (*n).into())).unwrap();
                own
            }
            Ty::Leaf(leaf) => format!("{leaf:?}").to_lowercase(),
            Ty::Duration => "duration".into(),
            Ty::RealSignal => "real-signal".into(),
            Ty::BoolSignal => "bool-signal".into(),
            Ty::Record(fields) => {
                define(&own, fields, letter, out);
                own
            }
        };
        body.push(format!("{letter}{i}: {ty}"));
    }
    writeln!(out, "  record {name} {{ {} }}", body.join(", ")).unwrap();
}
