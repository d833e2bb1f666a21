//! The ports as structs, and the functions between them and the canonical ABI.

use super::super::{Block, File, banner};
use super::{place, type_ident, type_name};
use crate::abi::{Core, Leaf, Tuple, word};
use crate::class::{Class, Kind, Ty, TypeDef};
use crate::names::{camel, comment};
use std::fmt::Write;

fn core(core: Core) -> &'static str {
    match core {
        Core::I32 => "uint32",
        Core::I64 => "uint64",
        Core::F32 => "float32",
        Core::F64 => "float64",
    }
}

pub(in crate::lang) fn generated(block: &Block) -> Vec<File> {
    let (class, abi) = (&block.class, &block.abi);
    let mut out = format!(
        "// Code generated from wit/; DO NOT EDIT.\n{}\npackage main\n\nimport \"unsafe\"\n\n",
        banner(block, "//")
    );
    for ty in &class.types {
        out += &type_text(class, ty);
    }
    out += LOG;
    out += "func main() {}\n\n// Plant time: what Go's clock shows during an execution.\nvar now uint64\n\n//go:wasmexport latchwork_now\nfunc latchworkNow() uint64 { return now }\n\n";
    if let Some(size) = abi.spill() {
        let words = size.div_ceil(8);
        let _ = writeln!(
            out,
            "// More than 16 parameters come by a pointer into this memory; one call at a time.\nvar spill [{words}]uint64\n"
        );
        out += "//go:wasmexport cabi_realloc\nfunc cabiRealloc(old, oldSize, align, size uint32) unsafe.Pointer {\n";
        let _ = writeln!(
            out,
            "\tif old != 0 || align > 8 || size > {} {{\n\t\tpanic(\"an allocation that no call needs\")\n\t}}\n\treturn unsafe.Pointer(&spill)\n}}\n",
            words * 8
        );
    }
    if let Some((ty, tuple)) = class.settings.zip(abi.settings.as_ref()) {
        if class.defaults {
            export(&mut out, class, "defaults", None, &[("settings", ty)], "result.settings = Defaults()");
        }
        export(&mut out, class, "configure", Some((&[("settings", ty)], tuple)), &[], CONFIGURE);
    }
    let names: Vec<&str> = class.execute_parameters().iter().map(|(n, _)| *n).collect();
    let results = class.execute_results();
    let to: Vec<String> = results.iter().map(|(n, _)| format!("result.{n}")).collect();
    let to = if to.is_empty() { String::new() } else { format!("{} = ", to.join(", ")) };
    let call = format!("now = scan.Now\n\t{to}Execute({})", names.join(", "));
    export(&mut out, class, "execute", Some((&class.execute_parameters(), &abi.execute)), &results, &call);
    if let Some((ty, tuple)) = class.retained.zip(abi.retained.as_ref()) {
        export(&mut out, class, "save", None, &[("state", ty)], "result.state = Save()");
        export(&mut out, class, "restore", Some((&[("state", ty)], tuple)), &[], "Restore(state)");
    }
    vec![File::new("class.go", out.trim_end().to_owned() + "\n")]
}

const CONFIGURE: &str = "err := Configure(settings)
	result.refused = err != nil
	if err != nil {
		text := []byte(err.Error())
		result.why, result.bytes = uint32(uintptr(unsafe.Pointer(unsafe.SliceData(text)))), uint32(len(text))
		refusal = text
	}";

const LOG: &str = r#"// LogLevel is the level of a message.
type LogLevel uint32

const (
	LogDebug LogLevel = iota
	LogInfo
	LogWarning
	LogError
)

//go:wasmimport latchwork:block/log@0.1.0 write
func hostLog(level uint32, message unsafe.Pointer, bytes uint32)

// Log writes a line for the plant's records. Only a block that calls it imports the log.
func Log(level LogLevel, message string) {
	hostLog(uint32(level), unsafe.Pointer(unsafe.StringData(message)), uint32(len(message)))
}

"#;

fn type_text(class: &Class, ty: &TypeDef) -> String {
    let mut out = comment(&ty.doc, "//");
    let name = type_ident(&ty.name);
    match &ty.kind {
        Kind::Record(fields) => {
            let _ = writeln!(out, "type {name} struct {{");
            for field in fields {
                out += &comment(&field.doc, "\t//");
                let _ = writeln!(out, "\t{} {}", camel(&field.name), type_name(class, field.ty));
            }
            out += "}\n\n";
        }
        kind => {
            let flags = matches!(kind, Kind::Flags(_));
            let (Kind::Flags(labels) | Kind::Enum(labels)) = kind else { return out };
            let _ = writeln!(out, "type {name} uint{}\n\nconst (", word(kind) * 8);
            for (i, label) in labels.iter().enumerate() {
                out += &comment(&label.doc, "\t//");
                let value = if flags { format!("1 << {i}") } else { i.to_string() };
                let _ = writeln!(out, "\t{name}{} {name} = {value}", camel(&label.name));
            }
            out += ")\n\n";
        }
    }
    out
}

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
    let groups: &[(&str, usize)] = parameters.map_or(&[], |(g, _)| g);
    let spilled = parameters.is_some_and(|(_, t)| t.spilled());
    let refusal = name == "configure";
    let list = if spilled {
        "at unsafe.Pointer".to_owned()
    } else {
        let typed = leaves.iter().enumerate().map(|(i, l)| format!("p{i} {}", core(l.core())));
        typed.collect::<Vec<_>>().join(", ")
    };
    let returned = match &tuple.leaves[..] {
        _ if refusal => " unsafe.Pointer",
        [] => "",
        [one] => match one.core() {
            Core::I32 => " uint32",
            Core::I64 => " uint64",
            Core::F32 => " float32",
            Core::F64 => " float64",
        },
        _ => " unsafe.Pointer",
    };
    let fields = |list: &[(&str, usize)]| {
        let fields = list.iter().map(|(n, t)| format!("{n} {}", type_name(class, Ty::Named(*t))));
        fields.collect::<Vec<_>>().join("; ")
    };
    if refusal {
        out.push_str("var refusal []byte // Kept until the host has read it.\n");
        out.push_str("var configureResult struct { refused bool; why, bytes uint32 }\n\n");
    } else if !results.is_empty() {
        let _ = writeln!(out, "var {name}Result struct {{ {} }}\n", fields(results));
    }
    let _ = writeln!(out, "//go:wasmexport {}#{name}\nfunc latchwork{}({list}){returned} {{", class.id, camel(name));
    if spilled {
        let _ = writeln!(out, "\targuments := (*struct {{ {} }})(at)", fields(groups));
    }
    for (group, ty) in groups {
        if spilled {
            let _ = writeln!(out, "\t{group} := arguments.{group}");
            continue;
        }
        let _ = writeln!(out, "\tvar {group} {}", type_name(class, Ty::Named(*ty)));
        for (i, leaf) in leaves.iter().enumerate().filter(|(_, l)| l.path[0] == **group) {
            let value = match leaf.ty {
                Ty::Bool => format!("p{i} != 0"),
                ty => format!("{}(p{i})", type_name(class, ty)),
            };
            let _ = writeln!(out, "\t{} = {value}", place(&leaf.path));
        }
    }
    if refusal || !results.is_empty() {
        let _ = writeln!(out, "\tresult := &{name}Result");
    }
    let _ = writeln!(out, "\t{call}");
    match &tuple.leaves[..] {
        [] if !refusal => {}
        [one] => {
            let from = format!("result.{}", place(&one.path));
            let line = match (one.ty, one.core()) {
                (Ty::Bool, _) => format!("\tif {from} {{\n\t\treturn 1\n\t}}\n\treturn 0"),
                (_, kind) => format!("\treturn {}({from})", core(kind)),
            };
            let _ = writeln!(out, "{line}");
        }
        _ => out.push_str("\treturn unsafe.Pointer(result)\n"),
    }
    out.push_str("}\n\n");
}
