//! C and C++ by clang, for wasm32-wasi: with the C library, and without an import as long as nothing of WASI is used.
//!
//! C lays structs out as the canonical ABI does, so a result is a static struct and its address.

mod glue;

pub(super) use glue::generated;

use super::{Block, File};
use crate::abi::Tuple;
use crate::class::{Class, Kind, Ty};
use crate::manifest::Step;
use crate::names::{camel, comment, shout, snake, twice};
use std::fmt::Write;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    C,
    Cpp,
}

/// Words of C11 and C++20, and the names of stdint.h that a field could have.
#[rustfmt::skip]
const KEYWORDS: &[&str] = &[
    "alignas", "alignof", "and", "and_eq", "asm", "auto", "bitand", "bitor", "bool", "break", "case", "catch", "char",
    "char8_t", "char16_t", "char32_t", "class", "co_await", "co_return", "co_yield", "compl", "concept", "const",
    "consteval", "constexpr", "constinit", "const_cast", "continue", "decltype", "default", "delete", "do", "double",
    "dynamic_cast", "else", "enum", "explicit", "export", "extern", "false", "float", "for", "friend", "goto", "if",
    "inline", "int", "int8_t", "int16_t", "int32_t", "int64_t", "long", "mutable", "namespace", "new", "noexcept",
    "not", "not_eq", "nullptr", "operator", "or", "or_eq", "private", "protected", "public", "register",
    "reinterpret_cast", "requires", "restrict", "return", "short", "signed", "sizeof", "static", "static_assert",
    "static_cast", "struct", "switch", "template", "this", "thread_local", "throw", "true", "try", "typedef", "typeid",
    "typename", "typeof", "uint8_t", "uint16_t", "uint32_t", "uint64_t", "union", "unsigned", "using", "virtual",
    "void", "volatile", "wchar_t", "while", "xor", "xor_eq",
];

/// What constants of the glue and macros of stdint.h, limits.h, float.h and math.h begin with: INT_MAX, M_PI.
const TAKEN: &[&str] = &[
    "CHAR", "DBL", "FLT", "FP", "INT", "LDBL", "LLONG", "LONG", "M", "SCHAR", "SHRT", "UCHAR", "UINT", "ULLONG",
    "ULONG", "USHRT", "LOG", "SIZE", "INT8", "INT16", "INT32", "INT64", "UINT8", "UINT16", "UINT32", "UINT64",
    "INTMAX", "INTPTR", "PTRDIFF", "UINTMAX", "UINTPTR", "WCHAR", "WINT",
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
    // Below everything else: what it has too much of is a trap, and overwrites no data.
    "-Wl,--stack-first",
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
        Ty::Named(index) => type_ident(&class.types[index].name),
    }
}

fn named(class: &Class, ty: usize) -> String {
    type_name(class, Ty::Named(ty))
}

fn type_ident(name: &str) -> String {
    if TAKEN.contains(&shout(name).as_str()) { camel(name) + "Type" } else { camel(name) }
}

fn constant(ty: &str, label: &str) -> String {
    format!("{}_{}", shout(&type_ident(ty)), shout(label))
}

/// Constants have no scope of their own, and begin with the name of their type.
pub(super) fn refuses(class: &Class) -> Option<String> {
    let names = super::labels(class).map(|(ty, label)| (format!("{}.{label}", ty.name), constant(&ty.name, label)));
    twice(&names.collect::<Vec<_>>()).map(|(first, second)| format!("`{first}` and `{second}` become one name"))
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
