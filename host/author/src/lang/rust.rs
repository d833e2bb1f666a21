//! Rust with std and wit-bindgen, for wasm32-unknown-unknown: nothing is imported, a clock or a random number is a panic.
//!
//! The crate stands by itself: wit-bindgen comes from crates.io, and `class.rs` makes of its trait, which has no `self`, the
//! methods of a struct.

use super::{Block, File, banner};
use crate::class::{Class, Kind, Ty, TypeDef};
use crate::manifest::Step;
use crate::names::{camel, comment, snake, unless};
use std::fmt::Write;

/// The version that the tests build with.
const WIT_BINDGEN: &str = "0.61.1";

/// What wit-bindgen escapes.
const KEYWORDS: &[&str] = &[
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn", "else",
    "enum", "extern", "false", "final", "fn", "for", "if", "impl", "in", "let", "loop", "macro", "match", "mod",
    "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static", "struct", "super", "trait", "true",
    "try", "type", "typeof", "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];

pub(super) fn step(block: &Block) -> Step {
    let output = format!("target/wasm32-unknown-unknown/release/{}.wasm", block.name.replace('-', "_"));
    let command = ["cargo", "build", "--release", "--target", "wasm32-unknown-unknown", "--target-dir", "target"];
    super::step(&command, output)
}

/// As wit-bindgen names a field or a module.
fn ident(name: &str) -> String {
    let name = snake(name);
    if KEYWORDS.contains(&name.as_str()) { name + "_" } else { name }
}

/// What stands in the prelude, in the glue or in the author's file by these names.
#[rustfmt::skip]
const TAKEN: &[&str] = &[
    "AsMut", "AsRef", "Block", "Box", "Clone", "Copy", "Default", "Drop", "Eq", "Err", "Exports", "Extend", "Fn", "FnMut", "FnOnce",
    "From", "Guest", "Hash", "Into", "IntoIterator", "Iterator", "None", "Ok", "Option", "Ord", "PartialEq", "PartialOrd", "RefCell",
    "Result", "Self", "Send", "Sized", "Some", "String", "Sync", "ToOwned", "ToString", "TryFrom", "TryInto", "Unpin", "Vec",
];

fn type_ident(name: &str) -> String {
    unless(TAKEN, camel(name))
}

/// Where wit-bindgen has put a type, under the name that the class has for it.
fn import(ty: &TypeDef) -> String {
    let home = &ty.home;
    let exports = if home.class { "exports::" } else { "" };
    let module = [&home.package.0, &home.package.1, &home.interface].map(|p| ident(p)).join("::");
    // The trait of an interface has that name.
    let there = if home.name == "guest" { "Guest_".to_owned() } else { camel(&home.name) };
    let here = type_ident(&ty.name);
    let renamed = if there == here { String::new() } else { format!(" as {here}") };
    format!("pub use {exports}{module}::{there}{renamed};\n")
}

/// What wit-bindgen does not get through the compiler: it writes a name `gen` as it is, and `Self` for `self`.
pub(super) fn refuses(class: &Class) -> Option<String> {
    let own = class.types.iter().find(|t| camel(&t.home.name) == "Self").map(|t| &t.home.name);
    if let Some(own) = own {
        return Some(format!("a type of the name `{own}` is `Self`, which every type of Rust is to itself"));
    }
    let fields = class.types.iter().enumerate().flat_map(|(i, _)| class.fields(i)).map(|f| &f.name);
    let homes = class.types.iter().flat_map(|t| [&t.home.package.0, &t.home.package.1, &t.home.interface]);
    let mut names = fields.chain(homes).chain([&class.package.0, &class.package.1, &class.name]);
    let taken = names.any(|name| snake(name) == "gen");
    taken.then(|| "`gen` is a word of Rust, which wit-bindgen does not know for one".into())
}

fn constant(ty: &str, label: &str) -> String {
    format!("{}::{}", type_ident(ty), crate::names::shout(label))
}

pub(super) fn generated(block: &Block) -> Vec<File> {
    let class = &block.class;
    let mut out = banner(block, "//");
    out += "#![allow(missing_docs, unused_imports, clippy::all)]\n";
    out += "use crate::Block;\nuse std::cell::RefCell;\n\n";
    out += "wit_bindgen::generate!({ path: \"wit\", world: \"block\", generate_all, additional_derives: [PartialEq] });\n\n";
    let module = [&class.package.0, &class.package.1, &class.name].map(|p| ident(p)).join("::");
    out += "pub use latchwork::block::log;\n";
    for ty in &class.types {
        out += &import(ty);
    }
    out += "\n";
    out +=
        "struct Exports;\n\nthread_local! {\n    static BLOCK: RefCell<Block> = RefCell::new(Block::default());\n}\n\n";
    out += "fn with<R>(call: impl FnOnce(&mut Block) -> R) -> R {\n    BLOCK.with_borrow_mut(call)\n}\n\n";
    let _ = writeln!(out, "impl exports::{module}::Guest for Exports {{");
    if class.defaults {
        out += "    fn defaults() -> Settings {\n        Block::defaults()\n    }\n";
    }
    if class.settings.is_some() {
        out += "    fn configure(settings: Settings) -> Result<(), String> {\n        with(|block| block.configure(settings))\n    }\n";
    }
    let names: Vec<&str> = class.execute_parameters().iter().map(|(n, _)| *n).collect();
    let _ = writeln!(
        out,
        "    fn execute{} {{\n        with(|block| block.execute({}))\n    }}",
        signature(class, ""),
        names.join(", ")
    );
    if class.retained.is_some() {
        out += "    fn save() -> Retained {\n        with(|block| block.save())\n    }\n";
        out += "    fn restore(state: Retained) {\n        with(|block| block.restore(state))\n    }\n";
    }
    out += "}\n\nexport!(Exports);\n";
    vec![File::new("src/class.rs", out)]
}

/// Parameters and result of `execute`.
fn signature(class: &Class, receiver: &str) -> String {
    let parameters = class.execute_parameters().into_iter().map(|(n, _)| format!("{n}: {}", camel(n)));
    let parameters: Vec<String> =
        Some(receiver.to_owned()).filter(|r| !r.is_empty()).into_iter().chain(parameters).collect();
    let results: Vec<String> = class.execute_results().into_iter().map(|(n, _)| camel(n)).collect();
    let result = match &results[..] {
        [] => String::new(),
        [one] => format!(" -> {one}"),
        both => format!(" -> ({})", both.join(", ")),
    };
    format!("({}){result}", parameters.join(", "))
}

pub(super) fn authored(block: &Block) -> Vec<File> {
    let (class, name) = (&block.class, &block.name);
    let manifest = format!(
        "[package]\nname = \"{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[lib]\ncrate-type = [\"cdylib\"]\n\n\
         [dependencies]\nwit-bindgen = \"={WIT_BINDGEN}\"\n\n[profile.release]\nopt-level = \"s\"\nlto = true\npanic = \"abort\"\nstrip = true\n\n\
         # Not part of a workspace that may be around it.\n[workspace]\n"
    );
    let mut out = comment(super::tagline(class), "//!");
    out +=
        "//!\n//! Time is an argument: add up scan.elapsed (ns), and ask no clock. NaN and infinity may come in.\n\n";
    out += "mod class;\n\nuse class::*;\n\npub struct Block {\n";
    let mut fields = Vec::new();
    if let Some(ty) = class.settings {
        fields.push((
            "settings",
            "Settings",
            if class.defaults { "Self::defaults()".into() } else { literal(class, Ty::Named(ty), 3) },
        ));
    }
    if let Some(ty) = class.retained {
        fields.push(("retained", "Retained", literal(class, Ty::Named(ty), 3)));
    }
    for (field, ty, _) in &fields {
        let _ = writeln!(out, "    {field}: {ty},");
    }
    out += "}\n\nimpl Default for Block {\n    fn default() -> Self {\n        Self {\n";
    for (field, _, value) in &fields {
        let _ = writeln!(out, "            {field}: {value},");
    }
    out += "        }\n    }\n}\n\nimpl Block {\n";
    if let Some(ty) = class.settings {
        if class.defaults {
            let zeros = literal(class, Ty::Named(ty), 2);
            let _ = writeln!(out, "    pub fn defaults() -> Settings {{\n        {zeros}\n    }}\n");
        }
        out += "    /// Takes new settings, or refuses them with a sentence.\n";
        out += "    pub fn configure(&mut self, settings: Settings) -> Result<(), String> {\n        self.settings = settings;\n        Ok(())\n    }\n\n";
    }
    let unused = signature(class, "&mut self")
        .replace("scan:", "_scan:")
        .replace("inputs:", "_inputs:")
        .replace("commands:", "_commands:");
    let _ = writeln!(out, "    pub fn execute{unused} {{");
    out += &comment(&super::execute_names(class, ".", &ident, &constant), "        //");
    let outputs = class.outputs.map(|ty| literal(class, Ty::Named(ty), 2));
    match (outputs, class.alarms) {
        (Some(outputs), Some(_)) => {
            let _ = writeln!(out, "        let outputs = {outputs};\n        (outputs, Alarms::empty())");
        }
        (Some(outputs), None) => {
            let _ = writeln!(out, "        {outputs}");
        }
        (None, Some(_)) => out += "        Alarms::empty()\n",
        (None, None) => {}
    }
    out += "    }\n";
    if class.retained.is_some() {
        out += "\n    pub fn save(&mut self) -> Retained {\n        self.retained\n    }\n\n    pub fn restore(&mut self, state: Retained) {\n        self.retained = state;\n    }\n";
    }
    out += "}\n";
    vec![File::new("src/lib.rs", out), File::new("Cargo.toml", manifest)]
}

/// A value at rest.
fn literal(class: &Class, ty: Ty, indent: usize) -> String {
    match ty {
        Ty::Bool => "false".into(),
        Ty::F32 | Ty::F64 => "0.0".into(),
        Ty::Named(index) => {
            let def = &class.types[index];
            let name = type_ident(&def.name);
            match &def.kind {
                Kind::Record(fields) => {
                    let pad = "    ".repeat(indent + 1);
                    let fields = fields
                        .iter()
                        .map(|f| format!("{pad}{}: {},\n", ident(&f.name), literal(class, f.ty, indent + 1)));
                    format!("{name} {{\n{}{}}}", fields.collect::<String>(), "    ".repeat(indent))
                }
                Kind::Flags(_) => format!("{name}::empty()"),
                Kind::Enum(cases) => format!("{name}::{}", camel(&cases[0].name)),
            }
        }
        _ => "0".into(),
    }
}
