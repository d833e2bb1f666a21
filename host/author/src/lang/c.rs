//! C and C++ by clang, for wasm32-wasi: with the C library, and without an import as long as nothing of WASI is used.
//!
//! C lays structs out as the canonical ABI does, so a result is a static struct and its address.

use super::{Block, File, banner};
use crate::abi::{Core, Leaf, Tuple};
use crate::class::{Class, Kind, Ty, TypeDef};
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
        Dialect::C => vec!["clang-19", "-std=c11"],
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

fn core(core: Core) -> &'static str {
    match core {
        Core::I32 => "uint32_t",
        Core::I64 => "uint64_t",
        Core::F32 => "float",
        Core::F64 => "double",
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

pub(super) fn generated(block: &Block, dialect: Dialect) -> Vec<File> {
    vec![File::new("class.h", header(block)), File::new(dialect.glue(), glue(block))]
}

fn header(block: &Block) -> String {
    let class = &block.class;
    let mut out = banner(block, "//");
    out += "#pragma once\n#include <stdbool.h>\n#include <stdint.h>\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n";
    for ty in &class.types {
        out += &type_text(class, ty);
    }
    out += "// Yours to write.\n\n";
    for (doc, signature) in functions(class) {
        let _ = writeln!(out, "// {doc}\n{signature};");
    }
    out += LOG;
    out + "\n#ifdef __cplusplus\n}\n#endif\n"
}

const LOG: &str = r#"
// A line for the plant's records. Only a block that calls it imports the log.
enum { LOG_DEBUG, LOG_INFO, LOG_WARNING, LOG_ERROR };
__attribute__((import_module("latchwork:block/log@0.1.0"), import_name("write")))
void latchwork_log_write(uint32_t level, const char *message, uint32_t bytes);
static inline void block_log(uint32_t level, const char *message) {
    latchwork_log_write(level, message, (uint32_t)__builtin_strlen(message));
}
"#;

fn type_text(class: &Class, ty: &TypeDef) -> String {
    let name = camel(&ty.name);
    let mut out = comment(&ty.doc, "//");
    match &ty.kind {
        Kind::Record(fields) => {
            out += "typedef struct {\n";
            for field in fields {
                out += &comment(&field.doc, "    //");
                let _ = writeln!(out, "    {} {};", type_name(class, field.ty), ident(&field.name));
            }
            let _ = writeln!(out, "}} {name};\n");
        }
        Kind::Flags(labels) | Kind::Enum(labels) => {
            let flags = matches!(ty.kind, Kind::Flags(_));
            let _ = writeln!(out, "typedef uint{}_t {name};\nenum {{", crate::abi::word(&ty.kind) * 8);
            for (i, label) in labels.iter().enumerate() {
                out += &comment(&label.doc, "    //");
                let value = if flags { format!("1u << {i}") } else { i.to_string() };
                let _ = writeln!(out, "    {} = {value},", constant(&ty.name, &label.name));
            }
            out += "};\n\n";
        }
    }
    out
}

fn constant(ty: &str, label: &str) -> String {
    format!("{}_{}", shout(ty), shout(label))
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

fn glue(block: &Block) -> String {
    let (class, abi) = (&block.class, &block.abi);
    let mut out = banner(block, "//");
    out += "#include \"class.h\"\n\n#define EXPORT(name) __attribute__((export_name(name)))\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n";
    out += "// Plant time: what the clock of the C library shows during an execution.\nstatic uint64_t now;\n";
    out += "EXPORT(\"latchwork_now\") uint64_t latchwork_now(void) { return now; }\n\n";
    if let Some(size) = abi.spill() {
        let _ = writeln!(out, "// More than 16 parameters come by a pointer into this memory; one call at a time.");
        let _ = writeln!(out, "static uint64_t arguments[{}];", size.div_ceil(8));
        out += "EXPORT(\"cabi_realloc\") void *cabi_realloc(void *old, uint32_t old_size, uint32_t align, uint32_t size) {\n";
        out += "    if (old || old_size || align > 8 || size > sizeof arguments) __builtin_trap();\n    return arguments;\n}\n\n";
    }
    let mut function =
        |name: &str, parameters: Option<(&[(&str, usize)], &Tuple)>, results: &[(&str, usize)], call: String| {
            export(&mut out, class, name, parameters, results, &call);
        };
    let settings = class.settings.zip(abi.settings.as_ref());
    if let Some((ty, tuple)) = settings {
        if class.defaults {
            function("defaults", None, &[("settings", ty)], "result.settings = block_defaults();".into());
        }
        function("configure", Some((&[("settings", ty)], tuple)), &[], CONFIGURE.into());
    }
    let mut arguments = vec!["&scan"];
    arguments.extend(class.inputs.map(|_| "&inputs"));
    arguments.extend(class.commands.map(|_| "commands"));
    arguments.extend(class.outputs.map(|_| "&result.outputs"));
    let alarms = if class.alarms.is_some() { "result.alarms = " } else { "" };
    let zeros = if class.outputs.is_some() { "__builtin_memset(&result, 0, sizeof result);\n    " } else { "" };
    let call = format!("now = scan.now;\n    {zeros}{alarms}block_execute({});", arguments.join(", "));
    function("execute", Some((&class.execute_parameters(), &abi.execute)), &class.execute_results(), call);
    if let Some((ty, tuple)) = class.retained.zip(abi.retained.as_ref()) {
        function("save", None, &[("state", ty)], "result.state = block_save();".into());
        function("restore", Some((&[("state", ty)], tuple)), &[], "block_restore(&state);".into());
    }
    out + "#ifdef __cplusplus\n}\n#endif\n"
}

const CONFIGURE: &str = "const char *why = block_configure(&settings);
    result.refused = why != 0;
    result.why = why;
    result.bytes = why ? (uint32_t)__builtin_strlen(why) : 0;";

/// One exported function.
fn export(
    out: &mut String,
    class: &Class,
    name: &str,
    parameters: Option<(&[(&str, usize)], &Tuple)>,
    results: &[(&str, usize)],
    call: &str,
) {
    let tuple = Tuple::new(class, results);
    let leaves: &[Leaf] = parameters.map_or(&[], |(_, t)| &t.leaves);
    let spilled = parameters.is_some_and(|(_, t)| t.spilled());
    let list = if spilled {
        "const void *arguments_at".to_owned()
    } else if leaves.is_empty() {
        "void".to_owned()
    } else {
        let typed = leaves.iter().enumerate().map(|(i, l)| format!("{} p{i}", core(l.core())));
        typed.collect::<Vec<_>>().join(", ")
    };
    let refusal = name == "configure";
    let result = match &tuple.leaves[..] {
        _ if refusal => "const void *",
        [] => "void ",
        [one] => match one.core() {
            Core::I32 => "uint32_t ",
            Core::I64 => "uint64_t ",
            Core::F32 => "float ",
            Core::F64 => "double ",
        },
        _ => "const void *",
    };
    let id = &class.id;
    let _ = writeln!(out, "EXPORT(\"{id}#{name}\") {result}latchwork_{name}({list}) {{");
    if refusal {
        out.push_str("    static struct { uint8_t refused; const char *why; uint32_t bytes; } result;\n");
    } else if !results.is_empty() {
        let fields: Vec<String> = results.iter().map(|(n, t)| format!("{} {n};", named(class, *t))).collect();
        let _ = writeln!(out, "    static struct {{ {} }} result;", fields.join(" "));
    }
    if let Some((groups, _)) = parameters {
        if spilled {
            let fields: Vec<String> = groups.iter().map(|(n, t)| format!("{} {n};", named(class, *t))).collect();
            let _ = writeln!(out, "    typedef struct {{ {} }} Arguments;", fields.join(" "));
            for (n, t) in groups {
                let _ = writeln!(out, "    {} {n} = ((const Arguments *)arguments_at)->{n};", named(class, *t));
            }
        } else {
            for (n, t) in groups {
                let _ = writeln!(out, "    {} {n};", named(class, *t));
            }
            for (i, leaf) in leaves.iter().enumerate() {
                let to = place(&leaf.path, &format!("{}.", leaf.path[0]));
                let value = if leaf.ty == Ty::Bool {
                    format!("p{i} != 0")
                } else {
                    format!("({})p{i}", type_name(class, leaf.ty))
                };
                let _ = writeln!(out, "    {to} = {value};");
            }
        }
    }
    let _ = writeln!(out, "    {call}");
    match &tuple.leaves[..] {
        _ if refusal => out.push_str("    return &result;\n"),
        [] => {}
        [one] => {
            let from = place(&one.path, &format!("result.{}.", one.path[0]));
            // Narrow signed numbers are extended with their sign.
            let cast = if one.core() == Core::I32 { "(uint32_t)" } else { "" };
            let _ = writeln!(out, "    return {cast}{from};");
        }
        _ => out.push_str("    return &result;\n"),
    }
    out.push_str("}\n\n");
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
