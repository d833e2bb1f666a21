//! C and C++ by clang, for wasm32-wasi: with the C library, and without an import as long as nothing of WASI is used.
//!
//! C lays structs out as the canonical ABI does, so a result is a static struct and its address.

mod glue;

pub(super) use glue::generated;

use super::{Block, File};
use crate::abi::Tuple;
use crate::class::{Class, Kind, Ty};
use crate::manifest::Step;
use crate::names::{camel, comment, shout, snake};
use std::fmt::Write;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    C,
    Cpp,
}

const KEYWORDS: &[&str] = &[
    "and",
    "asm",
    "auto",
    "bool",
    "break",
    "case",
    "catch",
    "char",
    "class",
    "const",
    "continue",
    "default",
    "delete",
    "do",
    "double",
    "else",
    "enum",
    "explicit",
    "export",
    "extern",
    "false",
    "float",
    "for",
    "friend",
    "goto",
    "if",
    "inline",
    "int",
    "long",
    "mutable",
    "namespace",
    "new",
    "not",
    "operator",
    "or",
    "private",
    "protected",
    "public",
    "register",
    "restrict",
    "return",
    "short",
    "signed",
    "sizeof",
    "static",
    "struct",
    "switch",
    "template",
    "this",
    "throw",
    "true",
    "try",
    "typedef",
    "typename",
    "union",
    "unsigned",
    "using",
    "virtual",
    "void",
    "volatile",
    "while",
    "xor",
];

/// The flags that both dialects are compiled with.
const FLAGS: &[&str] = &[
    "--target=wasm32-wasi",
    "-mexec-model=reactor",
    "-O2",
    "-Wall",
    "-Wl,--strip-all",
    "-Wl,--gc-sections",
    "-Wl,-z,stack-size=16384",
];

/// `clang` makes the core module in one call.
pub(super) fn step(block: &Block, dialect: Dialect) -> Step {
    let output = format!("build/{}.wasm", block.name);
    let mut command = match dialect {
        Dialect::C => vec!["clang-19", "-std=gnu11"],
        Dialect::Cpp => vec!["clang++-19", "-std=c++20", "-fno-exceptions", "-fno-rtti"],
    };
    command.extend(FLAGS);
    command.extend(["-o", &output, dialect.source(), dialect.glue()]);
    super::step(&command, output.clone())
}

impl Dialect {
    fn source(self) -> &'static str {
        match self {
            Self::C => "block.c",
            Self::Cpp => "block.cpp",
        }
    }

    fn glue(self) -> &'static str {
        match self {
            Self::C => "glue.c",
            Self::Cpp => "glue.cpp",
        }
    }
}

/// A name that is no keyword of either dialect.
fn ident(name: &str) -> String {
    let name = snake(name);
    if KEYWORDS.contains(&name.as_str()) { name + "_" } else { name }
}

fn type_name(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "bool".into(),
        Ty::U8 => "uint8_t".into(),
        Ty::S8 => "int8_t".into(),
        Ty::U16 => "uint16_t".into(),
        Ty::S16 => "int16_t".into(),
        Ty::U32 => "uint32_t".into(),
        Ty::S32 => "int32_t".into(),
        Ty::U64 => "uint64_t".into(),
        Ty::S64 => "int64_t".into(),
        Ty::F32 => "float".into(),
        Ty::F64 => "double".into(),
        Ty::Named(index) => camel(&class.types[index].name),
    }
}

fn named(class: &Class, ty: usize) -> String {
    type_name(class, Ty::Named(ty))
}

fn constant(ty: &str, label: &str) -> String {
    format!("{}_{}", shout(ty), shout(label))
}

pub(super) fn authored(block: &Block, dialect: Dialect) -> Vec<File> {
    let class = &block.class;
    let mut out = comment(super::tagline(class), "//");
    out += "//\n// Time is an argument: add up scan->elapsed (ns), and ask no clock. NaN and infinity may come in.\n";
    out += "#include \"class.h\"\n\n";
    let mut part = |signature: &str, body: String| {
        let _ = writeln!(out, "{signature} {{\n{body}}}\n");
    };
    let zeros = |ty: usize, first: &str| -> String {
        let tuple = Tuple::new(class, &[("x", ty)]);
        tuple.leaves.iter().map(|l| format!("    {} = {};\n", place(&l.path, first), zero(class, l.ty))).collect()
    };
    for (_, signature) in functions(class) {
        let signature = if dialect == Dialect::Cpp { signature.replace("(void)", "()") } else { signature };
        let function = signature.split('(').next().unwrap_or_default();
        let body = match function.rsplit("block_").next().unwrap_or_default() {
            "defaults" => {
                let zeros = class.settings.map_or_else(String::new, |ty| zeros(ty, "defaults."));
                format!("    Settings defaults;\n{zeros}    return defaults;\n")
            }
            "configure" => "    current = *settings;\n    return 0;\n".into(),
            "save" => "    return retained;\n".into(),
            "restore" => "    retained = *state;\n".into(),
            _ => {
                let names = super::execute_names(class, "->", &ident, &|t, l| constant(t, l));
                let outputs = class.outputs.map_or_else(String::new, |ty| zeros(ty, "outputs->"));
                let end = if class.alarms.is_some() { "    return 0;\n" } else { "" };
                format!("{}{outputs}{end}", comment(&names, "    //"))
            }
        };
        part(&signature, body);
    }
    let mut statics = String::new();
    if class.settings.is_some() {
        statics += "static Settings current;\n";
    }
    if class.retained.is_some() {
        statics += "static Retained retained;\n";
    }
    if !statics.is_empty() {
        out = out.replacen("#include \"class.h\"\n\n", &format!("#include \"class.h\"\n\n{statics}\n"), 1);
    }
    vec![File::new(dialect.source(), out.trim_end().to_owned() + "\n")]
}

fn zero(class: &Class, ty: Ty) -> String {
    match ty {
        Ty::Bool => "false".into(),
        Ty::F32 | Ty::F64 => "0.0".into(),
        Ty::Named(index) => match &class.types[index].kind {
            Kind::Enum(cases) => constant(&class.types[index].name, &cases[0].name),
            _ => "0".into(),
        },
        _ => "0".into(),
    }
}

/// `inputs.value.quality`, the first name with what stands behind it.
fn place(path: &[String], first: &str) -> String {
    let rest: Vec<String> = path[1..].iter().map(|p| ident(p)).collect();
    if rest.is_empty() {
        first.trim_end_matches(['.', '-', '>']).to_owned()
    } else {
        format!("{first}{}", rest.join("."))
    }
}

/// What an author writes: meaning and signature.
fn functions(class: &Class) -> Vec<(&'static str, String)> {
    let mut list = Vec::new();
    if class.defaults {
        list.push(("The settings that a plant file need not set.", "Settings block_defaults(void)".to_owned()));
    }
    if class.settings.is_some() {
        let doc = "Takes new settings (0), or refuses them with a sentence.";
        list.push((doc, "const char *block_configure(const Settings *settings)".to_owned()));
    }
    list.push(("One execution. `outputs` comes with zeros in it.", execute(class)));
    if class.retained.is_some() {
        list.push(("The state that a restart or a swap carries over.", "Retained block_save(void)".to_owned()));
        list.push(("Goes on from a saved state.", "void block_restore(const Retained *state)".to_owned()));
    }
    list
}

fn execute(class: &Class) -> String {
    let mut parameters = vec!["const Scan *scan"];
    parameters.extend(class.inputs.map(|_| "const Inputs *inputs"));
    parameters.extend(class.commands.map(|_| "Commands commands"));
    parameters.extend(class.outputs.map(|_| "Outputs *outputs"));
    let result = if class.alarms.is_some() { "Alarms" } else { "void" };
    format!("{result} block_execute({})", parameters.join(", "))
}
