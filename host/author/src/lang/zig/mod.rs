//! Zig, freestanding: no C library, no runtime, no import.
//!
//! `extern struct` and sized enums lie in memory as the canonical ABI wants them, so a result is a variable and its address.

mod glue;

pub(super) use glue::generated;

use super::{Block, File};
use crate::class::{Class, Kind, Ty};
use crate::manifest::Step;
use crate::names::{camel, comment, snake, unless};
use std::fmt::Write;

const KEYWORDS: &[&str] = &[
    "addrspace",
    "align",
    "allowzero",
    "and",
    "anyframe",
    "anytype",
    "asm",
    "async",
    "await",
    "break",
    "callconv",
    "catch",
    "comptime",
    "const",
    "continue",
    "defer",
    "else",
    "enum",
    "errdefer",
    "error",
    "export",
    "extern",
    "fn",
    "for",
    "if",
    "inline",
    "linksection",
    "noalias",
    "noinline",
    "nosuspend",
    "opaque",
    "or",
    "orelse",
    "packed",
    "pub",
    "resume",
    "return",
    "struct",
    "suspend",
    "switch",
    "test",
    "threadlocal",
    "try",
    "type",
    "union",
    "unreachable",
    "usingnamespace",
    "var",
    "volatile",
    "while",
    "true",
    "false",
    "null",
    "undefined",
    "bool",
    "void",
];

pub(super) fn step(block: &Block) -> Step {
    let output = format!("build/{}.wasm", block.name);
    let emit = format!("-femit-bin={output}");
    let command = [
        "zig",
        "build-exe",
        "block.zig",
        "-target",
        "wasm32-freestanding",
        "-fno-entry",
        "-rdynamic",
        "-O",
        "ReleaseSmall",
        "--stack",
        "16384",
        &emit,
    ];
    super::step(&command, output.clone())
}

fn ident(name: &str) -> String {
    let name = snake(name);
    if KEYWORDS.contains(&name.as_str()) || is_number_type(&name) { format!("@\"{name}\"") } else { name }
}

/// `u8`, `i3`: names that Zig has taken.
fn is_number_type(name: &str) -> bool {
    let rest = name.strip_prefix(['u', 'i', 'f']);
    rest.is_some_and(|r| !r.is_empty() && r.chars().all(|c| c.is_ascii_digit()))
}

/// `Result` is the glue's.
fn type_ident(name: &str) -> String {
    unless(&["Result"], camel(name))
}

fn type_name(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "bool".into(),
        Ty::U8 => "u8".into(),
        Ty::S8 => "i8".into(),
        Ty::U16 => "u16".into(),
        Ty::S16 => "i16".into(),
        Ty::U32 => "u32".into(),
        Ty::S32 => "i32".into(),
        Ty::U64 => "u64".into(),
        Ty::S64 => "i64".into(),
        Ty::F32 => "f32".into(),
        Ty::F64 => "f64".into(),
        Ty::Named(index) => type_ident(&class.types[index].name),
    }
}

pub(super) fn authored(block: &Block) -> Vec<File> {
    let class = &block.class;
    let mut out = comment(super::tagline(class), "//!");
    out += "//!\n//! Time is an argument: add up scan.elapsed (ns), and ask no clock. NaN and infinity may come in.\n";
    out += "const class = @import(\"class.zig\");\n\ncomptime {\n    _ = class; // The exports.\n}\n\n";
    if let Some(settings) = class.settings {
        let _ = writeln!(out, "var current: class.Settings = {};", literal(class, Ty::Named(settings), 0));
    }
    if let Some(retained) = class.retained {
        let _ = writeln!(out, "var retained: class.Retained = {};", literal(class, Ty::Named(retained), 0));
    }
    out += "\n";
    if let Some(settings) = class.settings {
        if class.defaults {
            let zeros = literal(class, Ty::Named(settings), 1);
            let _ = writeln!(out, "pub fn defaults() class.Settings {{\n    return {zeros};\n}}\n");
        }
        out += "/// Takes new settings (null), or refuses them with a sentence.\n";
        out += "pub fn configure(settings: class.Settings) ?[]const u8 {\n    current = settings;\n    return null;\n}\n\n";
    }
    let parameters = class.execute_parameters().into_iter().map(|(n, _)| format!("{n}: class.{}", camel(n)));
    let result = execute_result(class);
    let typed = if result == "void" { "void".to_owned() } else { format!("class.{result}") };
    let _ = writeln!(out, "pub fn execute({}) {typed} {{", parameters.collect::<Vec<_>>().join(", "));
    let names = super::execute_names(class, ".", &ident, &|t, l| format!("{t}.{}", ident(l)));
    out += &comment(&names, "    //");
    for (name, _) in class.execute_parameters() {
        let _ = writeln!(out, "    _ = {name};");
    }
    let outputs = class.outputs.map(|ty| literal(class, Ty::Named(ty), 1));
    match (outputs, class.alarms) {
        (Some(outputs), Some(_)) => {
            let _ = writeln!(out, "    return .{{ .outputs = {outputs}, .alarms = .{{}} }};");
        }
        (Some(outputs), None) => {
            let _ = writeln!(out, "    return {outputs};");
        }
        (None, Some(_)) => out += "    return .{};\n",
        (None, None) => {}
    }
    out += "}\n";
    if class.retained.is_some() {
        out += "\npub fn save() class.Retained {\n    return retained;\n}\n\npub fn restore(state: class.Retained) void {\n    retained = state;\n}\n";
    }
    vec![File::new("block.zig", out)]
}

/// A value at rest.
fn literal(class: &Class, ty: Ty, indent: usize) -> String {
    match ty {
        Ty::Bool => "false".into(),
        Ty::Named(index) => match &class.types[index].kind {
            Kind::Record(fields) => {
                let pad = "    ".repeat(indent + 1);
                let fields = fields
                    .iter()
                    .map(|f| format!("{pad}.{} = {},\n", ident(&f.name), literal(class, f.ty, indent + 1)));
                format!(".{{\n{}{}}}", fields.collect::<String>(), "    ".repeat(indent))
            }
            Kind::Flags(_) => ".{}".into(),
            Kind::Enum(cases) => format!(".{}", ident(&cases[0].name)),
        },
        _ => "0".into(),
    }
}

fn execute_result(class: &Class) -> &'static str {
    match (class.outputs, class.alarms) {
        (Some(_), Some(_)) => "Result",
        (Some(_), None) => "Outputs",
        (None, Some(_)) => "Alarms",
        (None, None) => "void",
    }
}
