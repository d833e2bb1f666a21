//! The ports as structs, and the functions between them and the canonical ABI.

use super::super::{Block, File, banner};
use super::{Dialect, constant, functions, ident, named, place, type_ident, type_name};
use crate::abi::{Core, Leaf, Tuple};
use crate::class::{Class, Kind, Ty, TypeDef};
use crate::names::comment;
use std::fmt::Write;

fn core(core: Core) -> &'static str {
    match core {
        Core::I32 => "uint32_t",
        Core::I64 => "uint64_t",
        Core::F32 => "float",
        Core::F64 => "double",
    }
}

pub(in crate::lang) fn generated(block: &Block, dialect: Dialect) -> Vec<File> {
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
    let name = type_ident(&ty.name);
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
